// One HID device held open through hidapi: reports in, reports out, and words for what fails.
#pragma once

#include "haptic/hid/report_descriptor.h"
#include "haptic/hid/report_transport.h"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

struct hid_device_;

namespace stylet::haptic::hid {

/// The report descriptor of a device by its hidapi path, a node such as /dev/hidraw0 or of libusb such as 1-1:1.0,
/// from sysfs: needs no permission on the device. Of libusb's only while nobody has it open.
/// @throws HidError
std::vector<std::uint8_t> report_descriptor(const std::string& path);

/// The udev rule that lets the user at the seat open such devices: a line of kUdevRulesFile.
std::string udev_rule_line(std::uint16_t vendor_id, std::uint16_t product_id);
inline constexpr const char* kUdevRulesFile = "/etc/udev/rules.d/70-stylet.rules";

/// The udev rule that lets the user at the seat open such devices, and where to put it.
std::string udev_rule(std::uint16_t vendor_id, std::uint16_t product_id);

/// libhidapi-hidraw keeps the text of the last error in the handle without a lock, so each direction has a handle of
/// its own; libhidapi-libusb keeps none, and lets a device be opened once.
class HidTransport final : public ReportTransport {
public:
  /// @throws HidError  it cannot be opened; where that is for want of permission, with the udev rule
  explicit HidTransport(const std::string& path);
  ~HidTransport() override;
  HidTransport(const HidTransport&) = delete;
  HidTransport& operator=(const HidTransport&) = delete;

  const std::string& path() const { return path_; }

  int read(std::span<std::uint8_t> bytes, int timeout_ms) override;
  bool write(std::span<const std::uint8_t> bytes) override;
  bool set_feature(std::span<const std::uint8_t> bytes) override;
  int get_feature(std::span<std::uint8_t> bytes) override;

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
