// A device's firmware on a port of this kernel: what MockHidNode is to the mocked node.
#pragma once

#include "tests/kernel/device_port.h"
#include "tests/support/hid/mock_firmware.h"

#include <atomic>
#include <chrono>
#include <memory>
#include <mutex>
#include <thread>

namespace stylet::kernel_test {

enum class PortKind : std::uint8_t { kUhid, kUsb };

/// Runs the firmware: an input report each period while it is plugged in and streams, forces and features as the host
/// sends them. Not plugged in at first. Calls of the firmware come one at a time.
class KernelDevice final : private HostRequests {
public:
  /// @param firmware  outlives the device
  KernelDevice(PortKind kind, support::MockFirmware& firmware, const DeviceIdentity& identity,
               std::chrono::nanoseconds period = std::chrono::milliseconds(1));
  ~KernelDevice() override;

  void plug();
  void unplug();
  /// The device says nothing while this is off; its force time-out goes on.
  void set_streaming(bool on) { streaming_ = on; }

  /// Runs `look` while the firmware stands still.
  template <typename Look>
  auto with_firmware(const Look& look) const {
    const std::scoped_lock lock(mutex_);
    return look();
  }

private:
  void output(std::span<const std::uint8_t> report) override;
  std::vector<std::uint8_t> get_feature(std::uint8_t id) override;
  bool set_feature(std::span<const std::uint8_t> report) override;
  void run(const std::stop_token& stop, std::chrono::nanoseconds period);

  support::MockFirmware& firmware_;
  mutable std::mutex mutex_;  ///< of the firmware
  std::unique_ptr<DevicePort> port_;
  std::atomic<bool> plugged_{false};
  std::atomic<bool> streaming_{true};
  std::jthread thread_;
};

}  // namespace stylet::kernel_test
