// A recording run again: is every bit the same, what did it look like?
#pragma once

#include "engine/app/observer.h"
#include "engine/app/recorded_session.h"
#include "engine/debrief/session_replay.h"
#include "engine/training/training_report.h"

#include <filesystem>
#include <limits>
#include <string>

namespace stylet::app {

struct ReplaySettings {
  std::string recording{};  ///< file or folder
  std::string scenario{};   ///< instead of the one named in the recording; empty: that
  bool window = false;      ///< it is shown
  std::string gpu{};        ///< by a part of its name or its number; empty: the best
  // Of what is drawn; the physics always runs from the start.
  double from_s = 0;
  double to_s = std::numeric_limits<double>::infinity();
  double speed = 1;
};

/// What write_film() has left.
struct ReplayFilm {
  std::filesystem::path folder{};
  int frames = 0;
  std::string still_moment{};  ///< of the pictures: "at the end of the heating"
};

/// Main thread.
class Replay {
public:
  /// Opens the recording and its scenario. @throws files::ContentError, Stopped
  Replay(const ReplaySettings& settings, Observer& observer);
  /// Of one that is open.
  Replay(RecordedSession session, Observer& observer);
  Replay(const Replay&) = delete;
  Replay& operator=(const Replay&) = delete;

  /// Once. @return false: its window was closed before the end
  /// @throws files::ContentError, gpu::GpuError, Stopped
  bool run();

  // After run().
  const recording::Recording& recording() const { return session_.recording; }
  const session::ReplayResult& result() const { return replay_.result(); }
  std::uint64_t state_hash() const { return replay_.state_hash(); }
  training::TrainingReport training() const { return training::assess(replay_.trace(), session_.scene); }
  /// Leaves session.mp4, stills and force in a folder. @throws files::ContentError, gpu::GpuError, Stopped
  ReplayFilm write_film(const std::filesystem::path& folder);

private:
  ReplaySettings settings_;
  Observer& observer_;
  RecordedSession session_;
  debrief::SessionReplay replay_;
};

}  // namespace stylet::app
