// A training session: a scenario, somebody or something that leads the needle, and what it leaves in a folder.
#pragma once

#include "engine/app/link_session.h"
#include "engine/app/load_scene.h"
#include "engine/app/observer.h"
#include "engine/session/session_report.h"
#include "engine/training/training_report.h"

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

namespace stylet::app {

enum class SessionView : std::uint8_t {
  automatic,  ///< a window where there is a display; else headless, as is a session in lockstep
  window,
  headset,  ///< OpenXR; where no runtime answers as automatic
  headless,
};

/// Whose attempts are kept in the lab's records.
struct TraineeSettings {
  std::string name{};           ///< or pseudonym; empty: nobody's, nothing is kept
  std::string course{};         ///< a name in content/courses, or a file; empty: none
  std::filesystem::path lab{};  ///< folder of the records; empty: lab::store::default_lab_folder()
};

struct SessionSettings {
  std::string scenario{};      ///< a name in content/scenarios, or a file
  std::string stylus{};        ///< as of open_stylus(); empty: the default_stylus()
  std::string probe_device{};  ///< as of ProbeDevice; empty: keys, a headset or the link move the probe, or the scene
  SessionView view = SessionView::automatic;
  bool stereo = false;
  bool left_handed = false;             ///< window mirrored; in a headset the left hand holds the needle
  bool mute = false;                    ///< no sound, until the user wants it
  bool lockstep = false;                ///< one thread, fixed schedule: the same bits every time
  std::string coupling{};               ///< empty: the scenario's
  double haptic_hz = 0;                 ///< 0: the scenario's
  std::optional<std::uint32_t> seed{};  ///< of the start; none: drawn anew with every attempt
  double seconds = 0;                   ///< 0: as long as the stylus moves
  std::filesystem::path record{};       ///< motion file of the hand; empty: none is written
  std::string expert{};                 ///< as of chosen_expert()
  bool film = true;
  std::filesystem::path out = "out/session";
  std::string language{};  ///< of the window: "de", "en"; empty: that of the environment
  std::string gpu{};       ///< by a part of its name or its number; empty: the best
  ScannerSettings scanner{};
  SessionLinkSettings link{};
  TraineeSettings trainee{};
};

/// What a session came to.
struct SessionResult {
  std::string title{};  ///< of the scenario
  session::SessionReport report{};
  training::TrainingReport training{};
  std::string account{};            ///< lines of the stylus, the link and the procedure
  std::filesystem::path folder{};   ///< holds session.rec, session.json, the force
  std::string procedure{};          ///< what was sampled or destroyed, lines
  bool waits_for_user = false;      ///< somebody at the window reads what it came to
  bool page_written = false;        ///< and the debrief
  bool drawn = false;               ///< and pictures and, where wanted, the film
  std::string not_drawn_because{};  ///< of the graphics; empty and not drawn: the observer asked for the end
  int film_frames = 0;
  std::string not_kept_because{};  ///< of the lab's records; empty: they have the attempt, or nobody asked for it
  std::string still_moment{};      ///< of the pictures: "at the end of the heating"

  bool identical() const { return report.replay_identical.value_or(false); }
  /// The recording was replayed, and is another session.
  bool replay_differs() const { return report.replay_identical.has_value() && !*report.replay_identical; }
};

class SessionObserver : public Observer {
public:
  /// The session is over and measured; its pictures are still to be drawn. Without a window its replay is compared.
  virtual void measured(const SessionResult& /*result*/) {}
  /// Another session follows one that is over, in the same window.
  virtual void left(const SessionResult& /*result*/) {}
};

/// Runs a session, as often as the trainee begins anew (the attempt before is kept in OUT/attempt-N, the last one is
/// in OUT), keeps its numbers, then makes debrief and pictures and replays its recording to see that it gives the
/// same bits. In a window the trainee then tries again or goes on to the next scenario (into OUT-2, OUT-3, ...). A
/// stop while it runs ends the session; a second one leaves out what is not made yet. Main thread. @return the last
/// session
/// @throws files::ContentError, gpu::GpuError, haptic::hid::HidError, link::LinkError
/// @throws Stopped  before there was anything to keep
SessionResult run_session(const SessionSettings& settings, SessionObserver& observer);

}  // namespace stylet::app
