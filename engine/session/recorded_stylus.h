// The hand of a motion file.
#pragma once

#include "engine/content/scene.h"
#include "haptic/recorded_device.h"

#include <string>
#include <utility>
#include <vector>

namespace stylet::session {

/// A valid reading of a stylus that is where a motion's is.
inline haptic::StylusSample stylus_sample(const content::MotionSample& sample, double time_s) {
  return {.time_s = time_s,
          .position = sample.pose.position,
          .orientation = sample.pose.orientation,
          .buttons = sample.buttons,
          .valid = true};
}

/// A stylus that moves as a motion's stylus track. @throws std::invalid_argument  it has no such track
inline haptic::RecordedDevice recorded_stylus(const content::Motion& motion, std::string name = "recorded stylus") {
  std::vector<haptic::StylusSample> track;
  for (const content::MotionSample& sample : motion.stylus) {
    track.push_back(stylus_sample(sample, sample.time_s));
  }
  return haptic::RecordedDevice(std::move(track), haptic::DeviceLimits{}, std::move(name));
}

}  // namespace stylet::session
