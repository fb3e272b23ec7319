// A recording made elsewhere becomes an attempt in the lab's records, scored again.
#pragma once

#include "engine/app/observer.h"
#include "engine/lab/store/lab.h"

#include <optional>
#include <string>

namespace stylet::app {

struct TakeSettings {
  std::string recording{};  ///< file or folder
  std::string course{};     ///< as of TraineeSettings
  bool graded = false;      ///< counts for a gate: who asks for it knows that it is not the best of several
};

struct TakenRecording {
  std::string attempt{};
  std::optional<double> total{};
  std::optional<bool> passed{};
  bool broken_off = false;  ///< as its recording says: it is a failure where it counts
  bool compared = false;    ///< with the numbers of a session.json beside it
};

/// Replays the recording bit for bit and measures it; its numbers are those, and where session.json lies beside it,
/// they are the same to the last bit. It began when its file was written last, less its duration.
/// @throws files::ContentError  the replay or the numbers differ, the recording is not whole or here already, a
/// demonstration or a lockstep session is to be graded; nothing is kept
/// @throws Stopped
TakenRecording take_recording(lab::store::Lab& lab, const lab::store::Person& person, const TakeSettings& settings,
                              Observer& observer);

}  // namespace stylet::app
