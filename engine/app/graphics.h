// The device that a session is drawn with, and the one after it where it is lost.
#pragma once

#include "engine/app/observer.h"
#include "engine/gpu/device.h"

#include <fmt/format.h>

#include <memory>
#include <string>

namespace stylet::app {

/// Thread: the one that draws.
class Graphics {
public:
  /// @throws gpu::GpuError  no device can be made
  Graphics(gpu::DeviceSettings settings, Observer& observer);

  /// Makes one where there is none any more. @throws gpu::GpuError
  gpu::Device& device();
  /// Whether the headset's runtime makes the devices: only what it made can be shown in it.
  bool of_headset() const { return settings_.maker != nullptr; }

  /// In a running session, when nothing made from the device is left: tries for some seconds to make another, and
  /// notes how that ended.
  /// @param if_none  what the session does then: "going on headless"
  /// @return false: there is no other, or one after the other was lost
  bool recover(const gpu::DeviceLost& lost, const std::string& if_none);

  /// Calls `drawing` with the device, and once more with another where it is lost meanwhile, which is noted. @throws
  /// gpu::GpuError
  template <typename Drawing>
  auto draw(const Drawing& drawing) {
    try {
      return drawing(device());
    } catch (const gpu::DeviceLost& lost) {
      device_.reset();
      observer_.note(Note::notice,
                     fmt::format("the graphics device was lost ({}); drawing again with another", lost.why()));
    }
    return drawing(device());
  }

private:
  gpu::DeviceSettings settings_;
  Observer& observer_;
  std::unique_ptr<gpu::Device> device_;
  int losses_ = 0;
};

}  // namespace stylet::app
