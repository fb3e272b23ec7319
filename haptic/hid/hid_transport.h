// One HID device held open through hidapi: reports in, reports out, and words for what fails.
#pragma once

#include "haptic/hid/report_descriptor.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

struct hid_device_;

namespace stylet::haptic::hid {

/// A device cannot be opened or asked. One line: which, why, what to do.
class HidError final : public std::runtime_error {
public:
  using std::runtime_error::runtime_error;
};

/// Larger than any report with its id, so that hidapi never cuts one short.
inline constexpr std::size_t kReadBuffer = kMaxReportBytes + 1;

/// The report descriptor of a device by its hidapi path, a node such as /dev/hidraw0 or of libusb such as 1-1:1.0,
/// from sysfs: needs no permission on the device. Of libusb's only while nobody has it open.
/// @throws HidError
std::vector<std::uint8_t> report_descriptor(const std::string& path);

/// The udev rule that lets the user at the seat open such devices: a line of kUdevRulesFile.
std::string udev_rule_line(std::uint16_t vendor_id, std::uint16_t product_id);
inline constexpr const char* kUdevRulesFile = "/etc/udev/rules.d/70-stylet.rules";

/// The udev rule that lets the user at the seat open such devices, and where to put it.
std::string udev_rule(std::uint16_t vendor_id, std::uint16_t product_id);

/// Reading and writing may be called by two threads, one for each; the features by either while the other stands
/// still. libhidapi-hidraw keeps the text of the last error in the handle without a lock, so each direction has a
/// handle of its own; libhidapi-libusb keeps none, and lets a device be opened once.
class HidTransport {
public:
  /// @throws HidError  it cannot be opened; where that is for want of permission, with the udev rule
  explicit HidTransport(const std::string& path);
  ~HidTransport();
  HidTransport(const HidTransport&) = delete;
  HidTransport& operator=(const HidTransport&) = delete;

  const std::string& path() const { return path_; }

  /// Waits for an input report, at most so long; 0: takes one that is there. With report ids, bytes[0] is the id.
  /// @return bytes read; 0: none came; -1: the device has gone
  int read(std::span<std::uint8_t> bytes, int timeout_ms);
  /// Sends an output report; bytes[0] is its id, 0 where the device has none. Waits for the bus.
  bool write(std::span<const std::uint8_t> bytes);
  /// bytes[0] is the id. @return false: the device refuses it
  bool set_feature(std::span<const std::uint8_t> bytes);
  /// bytes[0] is the id asked for. @return bytes of the report with its id; -1: the device refuses it
  int get_feature(std::span<std::uint8_t> bytes);

private:
  struct Close {
    void operator()(hid_device_* device) const;
  };
  using Handle = std::unique_ptr<hid_device_, Close>;

  std::string path_;
  Handle in_;
  Handle second_;
  hid_device_* out_ = nullptr;
};

}  // namespace stylet::haptic::hid
