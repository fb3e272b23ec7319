#include "haptic/hid/hid_devices.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>

namespace stylet::haptic::hid {
namespace {

TEST(HidDevices, EveryListedPathExistsAndTheListIsSorted) {
  const std::vector<HidDeviceSummary> devices = list_hid_devices();
  EXPECT_TRUE(
      std::is_sorted(devices.begin(), devices.end(), [](const auto& a, const auto& b) { return a.path < b.path; }));
  for (const HidDeviceSummary& device : devices) EXPECT_TRUE(std::filesystem::exists(device.path)) << device.path;
  // A machine without hidraw nodes must give an empty list.
  bool any_node = false;
  for (const auto& entry : std::filesystem::directory_iterator("/dev")) {
    any_node = any_node || entry.path().filename().string().starts_with("hidraw");
  }
  if (!any_node) {
    EXPECT_TRUE(devices.empty());
  }
}

TEST(HidDevices, LibraryNamesItsVersion) {
  EXPECT_TRUE(hid_library_version().starts_with("0.")) << hid_library_version();
}

}  // namespace
}  // namespace stylet::haptic::hid
