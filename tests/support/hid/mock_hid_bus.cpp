#include "tests/support/hid/mock_hid_bus.h"

#include <fmt/format.h>

#include <cstdlib>
#include <fstream>

namespace stylet::support {
namespace {

namespace fs = std::filesystem;

void write_file(const fs::path& file, const std::string& text) {
  std::ofstream(file, std::ios::binary) << text;
}

}  // namespace

MockHidBus::MockHidBus() {
  for (const char* folder :
       {"dev", "sys/bus/usb/devices", "sys/bus/hid/devices", "sys/class/hidraw", "sys/devices"}) {
    fs::create_directories(folder_ / folder);
  }
  setenv("UMOCKDEV_DIR", folder_.path().c_str(), 1);
}

MockHidBus::~MockHidBus() {
  unsetenv("UMOCKDEV_DIR");
}

fs::path MockHidBus::node(int number) const {
  return folder_ / fmt::format("dev/hidraw{}", number);
}

void MockHidBus::plug(int number, const MockHidIdentity& identity, std::span<const std::uint8_t> descriptor) {
  const std::string port = fmt::format("1-{}", number + 1);
  const std::string hid_name =
      fmt::format("0003:{:04X}:{:04X}.{:04X}", identity.vendor_id, identity.product_id, number + 1);
  const fs::path device = folder_ / "sys/devices" / port;
  const fs::path interface = device / (port + ":1.0");
  const fs::path hid = interface / hid_name;
  const fs::path raw = hid / "hidraw" / fmt::format("hidraw{}", number);
  fs::create_directories(raw);
  std::vector<fs::path>& entries = entries_[number];
  entries = {device, node(number)};
  const auto link = [&](const fs::path& from, const fs::path& to) {
    fs::create_symlink(fs::relative(to, from.parent_path()), from);
    entries.push_back(from);
  };

  write_file(device / "uevent",
             fmt::format("DEVTYPE=usb_device\nPRODUCT={:x}/{:x}/100\n", identity.vendor_id, identity.product_id));
  write_file(device / "manufacturer", identity.manufacturer + "\n");
  write_file(device / "product", identity.product + "\n");
  write_file(device / "serial", identity.serial + "\n");
  write_file(device / "bcdDevice", "0100\n");
  write_file(device / "idVendor", fmt::format("{:04x}\n", identity.vendor_id));
  write_file(device / "idProduct", fmt::format("{:04x}\n", identity.product_id));
  link(device / "subsystem", folder_ / "sys/bus/usb");
  link(folder_ / "sys/bus/usb/devices" / port, device);

  write_file(interface / "uevent", "DEVTYPE=usb_interface\n");
  write_file(interface / "bInterfaceNumber", "00\n");
  link(interface / "subsystem", folder_ / "sys/bus/usb");
  link(folder_ / "sys/bus/usb/devices" / interface.filename(), interface);

  write_file(
      hid / "uevent",
      fmt::format("HID_ID=0003:{:08X}:{:08X}\nHID_NAME={} {}\nHID_PHYS=mock/input0\nHID_UNIQ={}\n",
                  identity.vendor_id, identity.product_id, identity.manufacturer, identity.product, identity.serial));
  write_file(hid / "report_descriptor", std::string(descriptor.begin(), descriptor.end()));
  link(hid / "subsystem", folder_ / "sys/bus/hid");
  link(folder_ / "sys/bus/hid/devices" / hid_name, hid);

  write_file(raw / "uevent", fmt::format("MAJOR=240\nMINOR={}\nDEVNAME=hidraw{}\n", number, number));
  write_file(raw / "dev", fmt::format("240:{}\n", number));
  link(raw / "subsystem", folder_ / "sys/class/hidraw");
  link(raw / "device", hid);
  link(folder_ / "sys/class/hidraw" / raw.filename(), raw);
}

void MockHidBus::unplug(int number) {
  for (auto entry = entries_[number].rbegin(); entry != entries_[number].rend(); ++entry) fs::remove_all(*entry);
  entries_.erase(number);
}

}  // namespace stylet::support
