// The device's end of the cable: how a program in user space plugs a HID device into the kernel.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

namespace stylet::kernel_test {

/// What the device says of itself. Texts are ASCII.
struct DeviceIdentity {
  std::uint16_t vendor = 0x1209;
  std::uint16_t product = 0x0001;
  std::string manufacturer = "Stylet";
  std::string name = "Test stylus";
  std::string serial = "0042";
};

using ReportDescriptor = std::vector<std::uint8_t>;

/// What the host asks of the device; called on threads of the port. Reports begin with their id.
class HostRequests {
public:
  virtual ~HostRequests() = default;
  virtual void output(std::span<const std::uint8_t> report) = 0;
  /// Empty: there is no such report, and the host gets an error.
  virtual std::vector<std::uint8_t> get_feature(std::uint8_t id) = 0;
  virtual bool set_feature(std::span<const std::uint8_t> report) = 0;
};

/// A socket for one device, to be unplugged before it is destroyed. plug() and unplug() throw std::system_error that
/// names the file and the reason.
class DevicePort {
public:
  virtual ~DevicePort() = default;
  virtual void plug() = 0;
  virtual void unplug() = 0;
  /// Hands an input report to the kernel; over USB it waits until the host has fetched it. False: nobody took it.
  virtual bool send(std::span<const std::uint8_t> report) = 0;
};

/// /dev/uhid: the kernel's HID core gets the reports as they are, without a bus.
std::unique_ptr<DevicePort> make_uhid_port(const DeviceIdentity& identity, const ReportDescriptor& descriptor,
                                           HostRequests& requests);

/// A USB gadget (FunctionFS) on the emulated bus of dummy_hcd: descriptors, control requests and interrupt transfers
/// are those of a real cable. Needs configfs in /sys/kernel/config. One at a time.
std::unique_ptr<DevicePort> make_usb_port(const DeviceIdentity& identity, const ReportDescriptor& descriptor,
                                          HostRequests& requests);

}  // namespace stylet::kernel_test
