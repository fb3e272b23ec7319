// A headset of the mock runtime, under Debian's loader, on a real device.
#pragma once

#include "engine/gpu/commands.h"
#include "engine/headset/headset.h"
#include "tests/support/openxr/mock_runtime.h"

#include <gtest/gtest.h>

#include <atomic>
#include <optional>

namespace stylet::tests {

namespace mock = mock_xr;

/// Plays a script from the instance on. Call expect_clean() at the end.
class Rig {
public:
  explicit Rig(const mock::Script& script = {}, const headset::HeadsetSettings& settings = {});

  headset::HeadsetRuntime& runtime() { return *runtime_; }
  gpu::Device& device() { return *device_; }
  headset::Headset& headset() { return *headset_; }

  /// One turn of a session's loop: events, and a frame if the runtime wants one. Its picture is `picture`, or grey.
  std::optional<headset::HeadsetFrame> turn(const gpu::Image* picture = nullptr);
  /// Turns until the trainee sees the session and holds its controllers; the frame of the last.
  headset::HeadsetFrame turn_until_focused();

  /// Ends everything in order; then the runtime has refused nothing, nothing was left behind and validation was
  /// silent. @param refused  calls that the test made to fail
  void expect_clean(std::size_t refused = 0);

private:
  std::atomic<std::uint32_t> messages_{0};
  std::optional<headset::HeadsetRuntime> runtime_;
  std::optional<gpu::Device> device_;
  std::optional<gpu::Image> grey_;
  std::optional<headset::Headset> headset_;
};

/// What the loader finds: the mock runtime, or nothing.
void use_mock_runtime();
void use_no_runtime();

/// An image of two eyes with these bytes, each [height][width][4].
gpu::Image two_eyes(gpu::Device& device, std::uint32_t width, std::uint32_t height,
                    const std::vector<std::uint8_t>& both);

Eigen::Isometry3d isometry(const XrPosef& pose);

}  // namespace stylet::tests
