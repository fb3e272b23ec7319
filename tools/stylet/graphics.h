// The device that a session is drawn with, and the one after it where it is lost.
#pragma once

#include "engine/gpu/device.h"

#include <fmt/format.h>

#include <cstdio>
#include <memory>
#include <string>

namespace stylet::tools {

/// Thread: the one that draws.
class Graphics {
public:
  /// @throws gpu::GpuError  no device can be made
  explicit Graphics(gpu::DeviceSettings settings);

  /// Makes one where there is none any more. @throws gpu::GpuError
  gpu::Device& device();
  /// Whether the headset's runtime makes the devices: only what it made can be shown in it.
  bool of_headset() const { return settings_.maker != nullptr; }

  /// In a running session, when nothing made from the device is left: tries for some seconds to make another. One
  /// line on stderr says how that ended.
  /// @param if_none  what the session does then: "going on headless"
  /// @return false: there is no other, or one after the other was lost
  bool recover(const gpu::DeviceLost& lost, const std::string& if_none);

  /// Calls `drawing` with the device, and once more with another where it is lost meanwhile, which one line on stderr
  /// says. @throws gpu::GpuError
  template <typename Drawing>
  auto draw(const Drawing& drawing) {
    try {
      return drawing(device());
    } catch (const gpu::DeviceLost& lost) {
      device_.reset();
      fmt::print(stderr, "stylet: the graphics device was lost ({}); drawing again with another\n", lost.why());
    }
    return drawing(device());
  }

private:
  gpu::DeviceSettings settings_;
  std::unique_ptr<gpu::Device> device_;
  int losses_ = 0;
};

}  // namespace stylet::tools
