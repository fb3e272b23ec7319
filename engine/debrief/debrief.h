// What a session leaves for people, drawn from what was kept of it.
#pragma once

#include "engine/content/scene.h"
#include "engine/debrief/collect.h"
#include "engine/debrief/film.h"
#include "engine/figures/force_trace.h"
#include "engine/files/output_directory.h"
#include "engine/gpu/device.h"
#include "engine/recording/recording.h"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace stylet::debrief {

struct DebriefSettings {
  StillSettings stills{};                   ///< with the look of the film
  bool film = true;                         ///< session.mp4 is made (or is there), and the page leads to it
  std::optional<Expert> expert{};           ///< to compare with
  std::vector<DebriefAttempt> attempts{};   ///< before this one
  std::vector<DebriefPicture> saved{};      ///< that the trainee saved, shown with those of the key moments
  std::vector<training::Metric> metrics{};  ///< as the session set them; empty: measured on the trace
};

/// Writes force.csv and force.png, with the recording's events.
/// @throws files::ContentError
void write_force(const files::OutputDirectory& out, const recording::Recording& recording,
                 const figures::ForceTrace& trace);

/// Writes debrief.html, debrief.json, debrief.csv and path.csv of a session.
/// @throws files::ContentError, gpu::GpuError
void write_page(const files::OutputDirectory& out, const content::Scene& scene, gpu::Device& device,
                const recording::Recording& recording, Footage& footage, const DebriefSettings& settings);

/// What a session was, and what was kept of it.
struct KeptSession {
  const content::Scene& scene;
  const recording::Recording& recording;
  Footage& footage;
  const figures::ForceTrace& force;
};

/// All that a session leaves for people, piece by piece: what shows the session goes on between two pieces. Each file
/// is in the folder as soon as it exists, and stays there whatever becomes of the rest. Thread: the device's.
class DebriefWork {
public:
  /// Keeps references to `out` and what `session` refers to.
  DebriefWork(files::OutputDirectory& out, const KeptSession& session, DebriefSettings settings);
  ~DebriefWork();
  DebriefWork(const DebriefWork&) = delete;
  DebriefWork& operator=(const DebriefWork&) = delete;

  /// Does the next piece, of a second at most where the processor draws: the page and its numbers first, then
  /// view.png, ultrasound.png and session.png (of the still_moment()), then session.mp4 where one is wanted, and the
  /// page again with the way to it.
  /// @throws files::ContentError, gpu::GpuError  step() then does the piece again, with that device or another
  void step(gpu::Device& device);
  /// Before a device goes: lets go of what was made with it.
  void release_device();
  bool done() const { return next_ == Piece::nothing; }
  /// debrief.html is in the folder.
  bool page_written() const { return page_written_; }
  /// An expert to compare with is known now: the page is written again with it.
  void compare_with(Expert expert);
  /// A film is wanted.
  void add_film();
  /// It is not, unless add_film() asks for it later.
  void leave_out_film() { settings_.film = false; }
  /// What is still to come is not made.
  void give_up();
  /// Of the film written; 0: there is none.
  int film_frames() const { return film_frames_; }
  /// What is done next, and how much of it is.
  std::string doing() const;
  double share() const;

private:
  enum class Piece : std::uint8_t { moments, page, stills, film, nothing };
  void write_page();
  Piece after_page() const;

  files::OutputDirectory& out_;
  KeptSession session_;
  DebriefSettings settings_;
  Piece next_ = Piece::moments;
  std::unique_ptr<KeyMomentPictures> moments_;
  std::unique_ptr<Film> film_;
  std::vector<DebriefPicture> pictures_;
  bool page_written_ = false;
  bool stills_written_ = false;
  int film_frames_ = 0;
};

}  // namespace stylet::debrief
