// The part of sysfs that libudev and hidapi read, in a folder of its own: devices that are not there.
#pragma once

#include "tests/support/temporary_folder.h"

#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace stylet::support {

/// What a device says of itself.
struct MockHidIdentity {
  std::uint16_t vendor_id = 0x1209;
  std::uint16_t product_id = 0x0001;
  std::string manufacturer = "Stylet";
  std::string product = "Mocked stylus";
  std::string serial = "0001";
};

/// While one is alive, UMOCKDEV_DIR names its folder: this process and its children see the devices of the bus, and
/// no others, provided that they load hidraw_shim and umockdev-preload (libraries of the executable, or LD_PRELOAD).
/// Make it before there are threads.
class MockHidBus {
public:
  MockHidBus();
  ~MockHidBus();
  MockHidBus(const MockHidBus&) = delete;
  MockHidBus& operator=(const MockHidBus&) = delete;

  /// Adds the entries of /dev/hidraw`number`, a USB device.
  void plug(int number, const MockHidIdentity& identity, std::span<const std::uint8_t> descriptor);
  void unplug(int number);
  /// Where the node's socket listens.
  std::filesystem::path node(int number) const;
  const std::filesystem::path& folder() const { return folder_.path(); }

private:
  TemporaryFolder folder_;
  std::map<int, std::vector<std::filesystem::path>> entries_;
};

}  // namespace stylet::support
