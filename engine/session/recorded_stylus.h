// The hand of a motion file.
#pragma once

#include "engine/content/scene.h"
#include "haptic/recorded_device.h"

#include <string>
#include <utility>
#include <vector>

namespace stylet::session {

/// A stylus that moves as a motion's stylus track. @throws std::invalid_argument  it has no such track
inline haptic::RecordedDevice recorded_stylus(const content::Motion& motion, std::string name = "recorded stylus") {
  std::vector<haptic::StylusSample> track;
  for (const content::MotionSample& sample : motion.stylus) {
    track.push_back({sample.time_s, sample.pose.position, sample.pose.orientation, sample.buttons, true});
  }
  return haptic::RecordedDevice(std::move(track), haptic::DeviceLimits{}, std::move(name));
}

}  // namespace stylet::session
