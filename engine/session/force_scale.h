// How much of the needle's force goes to the hand.
#pragma once

#include "engine/content/scene.h"
#include "haptic/device.h"

#include <algorithm>
#include <cstdint>

namespace stylet::session {

/// The largest share, at most 1, at which ordinary use of the scenario stays below what the device gives: its peak
/// force, and the force that its motors hold for ever against the one expected to be held. 1 for a device without
/// force, and for a scenario that expects nothing.
inline double force_scale(const content::HandForce& expected, const haptic::DeviceLimits& limits) {
  double scale = 1;
  if (!limits.renders_force) return scale;
  if (expected.peak > 0) scale = std::min(scale, limits.max_force_n / expected.peak);
  if (expected.held > 0 && limits.continuous_force_n > 0) {
    scale = std::min(scale, limits.continuous_force_n / expected.held);
  }
  return scale;
}

/// What a device that renders force was given.
struct ForceOutput {
  double scale = 1;                 ///< of the needle's force, force_scale()
  double max_force = 0;             ///< of the device, N
  double clipped_s = 0;             ///< time for which it could not give even that: peak or heat of its motors
  std::uint64_t clipped_times = 0;  ///< how often, half a second apart
};

}  // namespace stylet::session
