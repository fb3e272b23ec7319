// A device held open, whatever holds it: reports in, reports out.
#pragma once

#include "haptic/hid/hid_devices.h"
#include "haptic/hid/report_descriptor.h"

#include <Eigen/Core>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace stylet::haptic::hid {

/// A device cannot be opened or asked. One line: which, why, what to do.
class HidError final : public std::runtime_error {
public:
  using std::runtime_error::runtime_error;
};

/// Larger than any report with its id, so that none is ever cut short.
inline constexpr std::size_t kReadBuffer = kMaxReportBytes + 1;

/// Reading and writing may be called by two threads, one for each; the features by either while the other stands
/// still. With report ids, bytes[0] is the id.
class ReportTransport {
public:
  virtual ~ReportTransport() = default;

  /// Waits for an input report, at most so long; 0: takes one that is there.
  /// @return bytes read; 0: none came; -1: the device has gone
  virtual int read(std::span<std::uint8_t> bytes, int timeout_ms) = 0;
  /// Sends an output report; bytes[0] is its id, 0 where the device has none. May wait.
  virtual bool write(std::span<const std::uint8_t> bytes) = 0;
  /// @return false: the device refuses it
  virtual bool set_feature(std::span<const std::uint8_t> bytes) = 0;
  /// bytes[0] is the id asked for. @return bytes of the report with its id; -1: the device refuses it
  virtual int get_feature(std::span<std::uint8_t> bytes) = 0;
  /// What the user should do before the device can lead or push, one line; empty: nothing. Any thread.
  virtual std::string needs() const { return {}; }
  /// The force that the device says its motors give, axes of the reports, N; none: it says nothing of it.
  virtual std::optional<Eigen::Vector3d> told_force() const { return {}; }
};

/// Where devices are found and opened. Any thread; not for running loops.
class DeviceSource {
public:
  virtual ~DeviceSource() = default;

  /// What is there now, sorted by path.
  virtual std::vector<HidDeviceSummary> list() const = 0;
  /// Why there may be nothing, and what to do: one line.
  virtual std::string missing() const = 0;
  /// The same where what it needs is installed, and so somebody may look for a device here; else empty.
  virtual std::string complaint() const { return {}; }
  /// @throws HidError
  virtual std::vector<std::uint8_t> descriptor(const std::string& path) const = 0;
  /// @throws HidError
  virtual std::unique_ptr<ReportTransport> open(const std::string& path) const = 0;
};

/// The computer's HID devices, through hidapi.
const DeviceSource& hid_source();

}  // namespace stylet::haptic::hid
