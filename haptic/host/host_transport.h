// A device host as a stylus that sends reports: the process is started, watched and ended here.
#pragma once

#include "haptic/hid/report_transport.h"
#include "haptic/host/channel.h"

#include <sys/types.h>

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace stylet::haptic::host {

/// A vendor whose library is loaded by a device host of its own.
struct Vendor {
  std::string kind{};  ///< as in --device; of make_driver()
  std::string name{};  ///< for people
  std::uint16_t usb_id = 0;
  std::string library{};  ///< path; empty: where it is found
  std::string program{};  ///< the device host
};

/// Names the program stylet_device_host: STYLET_DEVICE_HOST, else beside this one.
std::string host_program();

/// A device host with its device open. While it lives the program may stand still or die: the device host drops the
/// force 20 ms after the last report 2, and ends when this process has gone.
class HostTransport final : public hid::ReportTransport {
public:
  /// Starts it and waits until the device is open, at most kPatience. @throws hid::HidError
  /// @param must_open  false: where the device is not open state() and needs() say why
  explicit HostTransport(const Vendor& vendor, bool must_open = true);
  /// Asks it to end and waits; after kGrace it is killed.
  ~HostTransport() override;
  HostTransport(const HostTransport&) = delete;
  HostTransport& operator=(const HostTransport&) = delete;

  int read(std::span<std::uint8_t> bytes, int timeout_ms) override;
  bool write(std::span<const std::uint8_t> bytes) override;
  bool set_feature(std::span<const std::uint8_t> bytes) override { return write(bytes); }
  /// The gain that was set: the device host does not answer.
  int get_feature(std::span<std::uint8_t> bytes) override;
  std::optional<Eigen::Vector3d> told_force() const override;

  std::string name() const { return text_of(channel_->name); }
  std::string serial() const { return text_of(channel_->serial); }
  /// What the device needs, or why it is not open; empty: nothing.
  std::string needs() const override { return text_of(channel_->message); }
  HostState state() const { return channel_->state.load(std::memory_order_acquire); }
  pid_t process() const { return process_; }

  static constexpr double kPatience = 10;               ///< s
  static constexpr double kGrace = 1;                   ///< s
  static constexpr std::int64_t kSilent = 500'000'000;  ///< ns without a turn: its library hangs

private:
  bool over();
  void end(double grace_s);

  SharedChannel channel_;
  pid_t process_ = -1;
  int life_ = -1;  // the end of a pipe that closes with this process
  std::uint64_t next_ = 0;
  std::int64_t looked_ns_ = 0;
  std::uint8_t gain_ = 255;
};

/// The devices of a vendor: its library opens the first it finds. Path: KIND:SERIAL
class HostSource final : public hid::DeviceSource {
public:
  explicit HostSource(Vendor vendor) : vendor_(std::move(vendor)) {}

  /// Opens it for a moment, motors off. Nothing where the library is not installed or has no device.
  std::vector<hid::HidDeviceSummary> list() const override;
  std::string missing() const override;
  std::string complaint() const override;
  std::vector<std::uint8_t> descriptor(const std::string& path) const override;
  std::unique_ptr<hid::ReportTransport> open(const std::string& path) const override;

private:
  Vendor vendor_;
};

/// STYLET_DHD_LIBRARY says where the library is.
const HostSource& force_dimension_source();
/// STYLET_HD_LIBRARY says where the library is.
const HostSource& openhaptics_source();

}  // namespace stylet::haptic::host
