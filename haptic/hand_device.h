// A tracked hand as a stylus: a controller of a headset moves the hub, without force.
#pragma once

#include "haptic/device.h"
#include "haptic/workspace_map.h"

#include <array>
#include <atomic>
#include <string>

namespace stylet::haptic {

struct HandSettings {
  Eigen::Vector3d start = Eigen::Vector3d::Zero();  ///< of the hub until the hand takes it up, patient frame, m
  Eigen::Quaterniond start_orientation = Eigen::Quaterniond::Identity();  ///< needle frame -> patient frame
  /// Time constant of each of the two low-passes. A headset tells where a hand will be when the next frame is shown,
  /// some 20 ms ahead: what both delay.
  double smoothing_s = 0.010;
};

/// The display's thread calls follow(), release() and press() with each frame (some 90 Hz); the haptic thread reads a
/// smooth pose. From where the hand takes it up the hub moves as the hand does (WorkspaceMap), so that nothing
/// jumps when a clutch is let go or tracking returns. The threads share atomics; neither waits for the other.
class HandDevice final : public Device {
public:
  /// @throws std::invalid_argument  one line: a setting is not finite, or the smoothing time is not positive
  explicit HandDevice(const HandSettings& settings, DeviceLimits limits = {});

  /// Display thread: the hand is here, patient frame. A pose that is not finite releases the hub.
  void follow(const Eigen::Vector3d& position, const Eigen::Quaterniond& orientation);
  /// Display thread: the hand lets go, or is not seen; the hub stays.
  void release() { map_.release(); }
  /// Display thread: the buttons that are down, one bit each.
  void press(std::uint32_t buttons) { buttons_.store(buttons, std::memory_order_relaxed); }

  std::string name() const override { return "hand"; }
  DeviceLimits limits() const override { return limits_; }
  StylusSample read(double now_s) override;
  /// A controller renders no force.
  void write(const Eigen::Vector3d&, const Eigen::Vector3d&) override {}

private:
  DeviceLimits limits_;
  double smoothing_s_;
  WorkspaceMap map_;  // display thread's
  // Position, then x y z w of the orientation, whose sign is that of the one before. Read one by one: a mixture of
  // two frames lies between them.
  std::array<std::atomic<double>, 7> goal_{};
  std::atomic<std::uint32_t> buttons_{0};
  // Haptic thread's.
  std::array<Eigen::Vector3d, 2> position_stages_;
  std::array<Eigen::Quaterniond, 2> orientation_stages_;
  double last_read_s_ = 0;
  bool read_before_ = false;
};

}  // namespace stylet::haptic
