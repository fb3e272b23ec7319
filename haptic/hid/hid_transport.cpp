#include "haptic/hid/hid_transport.h"

#include "haptic/hid/hid_devices.h"

#include <fmt/format.h>
#include <hidapi.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>

namespace stylet::haptic::hid {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostDescriptor = 4096;  // of the kernel

/// Paths of libhidapi-libusb name a USB interface.
bool is_node(const std::string& path) {
  return path.starts_with("/dev/");
}

fs::path descriptor_file(const std::string& path) {
  constexpr const char* kName = "report_descriptor";
  if (is_node(path)) return fs::path("/sys/class/hidraw") / fs::path(path).filename() / "device" / kName;
  const fs::path interface = fs::path("/sys/bus/usb/devices") / path;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(interface, error)) {
    if (fs::exists(entry.path() / kName, error)) return entry.path() / kName;
  }
  return interface / kName;
}

/// hidapi 0.13 says no more than that it failed, but leaves errno as open() set it.
HidError cannot_open(const std::string& path, int error) {
  if (error == EACCES || error == EPERM) {
    for (const HidDeviceSummary& device : list_hid_devices()) {
      if (device.path != path) continue;
      return HidError(
          fmt::format("{}: no permission to open it; {}", path, udev_rule(device.vendor_id, device.product_id)));
    }
    return HidError(fmt::format("{}: no permission to open it; `stylet devices` has the udev rule", path));
  }
  return HidError(fmt::format("{}: cannot be opened ({}); see `stylet devices`", path,
                              error != 0 ? std::strerror(error) : "unknown reason"));
}

}  // namespace

std::vector<std::uint8_t> report_descriptor(const std::string& path) {
  const std::filesystem::path file = descriptor_file(path);
  std::ifstream in(file, std::ios::binary);
  std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(in), {}};
  if (!in.is_open() || in.bad() || bytes.empty()) {
    throw HidError(fmt::format("{}: no report descriptor in {}; plug the device in again", path, file.string()));
  }
  if (bytes.size() > kMostDescriptor) {
    throw HidError(fmt::format("{}: report descriptor of more than {} bytes", path, kMostDescriptor));
  }
  return bytes;
}

std::string udev_rule_line(std::uint16_t vendor_id, std::uint16_t product_id) {
  return fmt::format(
      R"(KERNEL=="hidraw*", ATTRS{{idVendor}}=="{:04x}", ATTRS{{idProduct}}=="{:04x}", TAG+="uaccess")", vendor_id,
      product_id);
}

std::string udev_rule(std::uint16_t vendor_id, std::uint16_t product_id) {
  return fmt::format("put {} into {}, run `udevadm control --reload` and plug it in again",
                     udev_rule_line(vendor_id, product_id), kUdevRulesFile);
}

void HidTransport::Close::operator()(hid_device_* device) const {
  hid_close(device);
}

HidTransport::HidTransport(const std::string& path) : path_(path) {
  errno = 0;
  in_.reset(hid_open_path(path.c_str()));
  if (in_ && is_node(path)) second_.reset(hid_open_path(path.c_str()));
  out_ = is_node(path) ? second_.get() : in_.get();
  if (!in_ || out_ == nullptr) throw cannot_open(path, errno);
}

HidTransport::~HidTransport() = default;

int HidTransport::read(std::span<std::uint8_t> bytes, int timeout_ms) {
  return hid_read_timeout(in_.get(), bytes.data(), bytes.size(), timeout_ms);
}

bool HidTransport::write(std::span<const std::uint8_t> bytes) {
  return hid_write(out_, bytes.data(), bytes.size()) == static_cast<int>(bytes.size());
}

bool HidTransport::set_feature(std::span<const std::uint8_t> bytes) {
  return hid_send_feature_report(out_, bytes.data(), bytes.size()) >= 0;
}

int HidTransport::get_feature(std::span<std::uint8_t> bytes) {
  return hid_get_feature_report(out_, bytes.data(), bytes.size());
}

namespace {

class HidSource final : public DeviceSource {
public:
  std::vector<HidDeviceSummary> list() const override { return list_hid_devices(); }
  std::string missing() const override {
    return "no such device is connected; plug it in, `stylet devices` lists what is there";
  }
  std::vector<std::uint8_t> descriptor(const std::string& path) const override { return report_descriptor(path); }
  std::unique_ptr<ReportTransport> open(const std::string& path) const override {
    return std::make_unique<HidTransport>(path);
  }
};

}  // namespace

const DeviceSource& hid_source() {
  static const HidSource source;
  return source;
}

}  // namespace stylet::haptic::hid
