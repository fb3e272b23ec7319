// A stylus that sends HID reports: reports in, forces out, and what happens when it is pulled out.
#pragma once

#include "haptic/device.h"
#include "haptic/hid/force_writer.h"
#include "haptic/hid/hand_follower.h"
#include "haptic/hid/hid_devices.h"
#include "haptic/hid/newest_value.h"
#include "haptic/hid/pose_stream.h"
#include "haptic/hid/report_log.h"
#include "haptic/hid/report_transport.h"
#include "haptic/paced_loop.h"

#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

namespace stylet::haptic::hid {

struct HidStylusSettings {
  HidDeviceSummary device{};                   ///< found again by vendor, product and serial number
  const DeviceSource* source = &hid_source();  ///< which has it; outlives the stylus
  DeviceProfile profile{};
  Workspace workspace{};  ///< patient_from_device: of the device frame
  RateSteering rate{};
  PenSteering pen{};
  std::uint32_t clutch = kSecondaryBarrelButton;
  int fifo_priority = 81;    ///< of its threads, above the haptic thread's; 0: ordinary threads
  double retry_s = 0.25;     ///< before the first look for a device that has gone; twice as long before each next
  ReportLog* log = nullptr;  ///< takes every report; outlives the stylus
};

/// Any thread may read them.
struct HidStylusCounters {
  StreamCounters stream;
  ForceCounters force;
  std::atomic<std::uint64_t> connections{0};  ///< times it was opened
};

/// A thread reads and looks for the device when it has gone; another one writes. The haptic thread meets them in two
/// slots. While the device is away samples are not valid and the hub stays; it is taken up again on its return.
class HidStylus final : public Device {
public:
  /// Opens it. @throws HidError, DescriptorError  one line: which device, why not, what to do
  explicit HidStylus(const HidStylusSettings& settings);
  /// Zero force, motors off.
  ~HidStylus() override;

  std::string name() const override { return name_; }
  const std::string& path() const { return settings_.device.path; }
  DeviceLimits limits() const override { return limits_; }
  DeviceKind kind() const { return kind_; }
  /// A button that nothing is done with, counted from 1; 0: there is none.
  int free_button() const { return free_button_; }
  /// ForceOutput::lets_go(): a host that dies leaves no force.
  bool lets_go() const { return lets_go_; }
  /// As it was when the stylus was made.
  const std::vector<std::uint8_t>& report_descriptor() const { return descriptor_; }
  /// @realtime reads the clock; no other system call
  StylusSample read(double now_s) override;
  /// @realtime at most a wake-up
  void write(const Eigen::Vector3d& force, const Eigen::Vector3d& torque) override;

  /// The force that the device says its motors give, patient frame, N; none: it says nothing of it. Haptic thread.
  /// @realtime
  std::optional<Eigen::Vector3d> told_force();

  /// Any thread.
  bool connected() const { return connected_.load(std::memory_order_acquire); }
  /// The session begins when the hand comes to its rest place.
  bool waits_for_rest() const { return waits_for_rest_.load(std::memory_order_relaxed); }
  DeviceStatus status() const override;
  const HidStylusCounters& counters() const { return counters_; }
  std::string statistics() const override;

private:
  struct Link;  // one plugging in

  std::unique_ptr<Link> open(const std::string& path) const;
  std::unique_ptr<Link> look_for_device() const;
  void run(const std::stop_token& stop, std::unique_ptr<Link> link);
  void serve(Link& link, const std::stop_token& stop);
  void say(std::string needs);

  HidStylusSettings settings_;
  std::string name_;
  std::vector<std::uint8_t> descriptor_;
  DeviceKind kind_ = DeviceKind::kUnusable;
  bool lets_go_ = true;
  int free_button_ = 0;
  DeviceLimits limits_;
  std::unique_ptr<HandFollower> follower_;  // haptic thread's
  std::uint64_t orders_ = 0;                // haptic thread's
  std::int64_t answered_ns_ = 0;            // haptic thread's: when the pose of the last sample was made
  MonotonicClock clock_;
  NewestValue<StreamedPose> poses_;
  NewestValue<std::optional<Eigen::Vector3d>> told_;
  ForceSlot forces_;
  HidStylusCounters counters_;
  std::uint64_t gaps_ = 0;  // reader's
  std::atomic<bool> connected_{false};
  std::atomic<bool> waits_for_rest_{false};
  mutable std::mutex saying_;
  std::string needs_;  // saying_'s
  std::mutex waiting_;
  std::condition_variable_any stopped_;
  std::jthread reader_;
};

}  // namespace stylet::haptic::hid
