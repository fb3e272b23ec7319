// A recording and the scene that it was made in.
#pragma once

#include "engine/app/observer.h"
#include "engine/content/scene.h"
#include "engine/recording/recording.h"
#include "engine/session/replay.h"

#include <string>

namespace stylet::app {

struct RecordedSession {
  recording::Recording recording;
  session::ReplayableSteps steps;
  content::Scene scene;

  double duration_s() const { return recording.haptic[steps.haptic - 1].time_s; }
};

/// Notes what the recording holds, what of it can be run again, and where the scenario is another by now.
/// @param named     file or folder, recording::find_recording
/// @param scenario  instead of the one named in the recording; empty: that
/// @throws files::ContentError  also a recording without a step
RecordedSession open_recording(const std::string& named, const std::string& scenario, Observer& observer);

}  // namespace stylet::app
