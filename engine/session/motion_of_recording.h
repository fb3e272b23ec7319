// A session's hand as a motion file, so that it can be shown again.
#pragma once

#include "engine/content/scene.h"
#include "engine/recording/recording.h"

namespace stylet::session {

/// The hub's poses of every haptic step, with the buttons.
inline content::Motion motion_of(const recording::Recording& recording) {
  content::Motion motion;
  motion.stylus.reserve(recording.haptic.size());
  for (const recording::HapticStepRecord& step : recording.haptic) {
    motion.stylus.push_back({.time_s = step.time_s, .pose = step.pose, .buttons = step.buttons});
  }
  return motion;
}

}  // namespace stylet::session
