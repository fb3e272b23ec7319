#include "engine/gpu/device.h"

#include <gtest/gtest.h>

namespace stylet::gpu {
namespace {

TEST(Device, IsChosenByNameOrIndex) {
  const auto names = device_names();
  ASSERT_FALSE(names.empty()) << "no Vulkan device: install mesa-vulkan-drivers";
  for (std::size_t i = 0; i < names.size(); ++i) {
    const Device device({.gpu = std::to_string(i)});
    EXPECT_EQ(device.identity().name, names[i]);
  }
  std::string shouted = names.back();
  for (char& c : shouted) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  EXPECT_EQ(Device({.gpu = shouted}).identity().name, names.back());
}

TEST(Device, UnknownNameSaysWhichThereAre) {
  try {
    const Device device({.gpu = "Voodoo 2"});
    FAIL() << "no such GPU, yet a device was made";
  } catch (const GpuError& error) {
    const std::string text = error.what();
    EXPECT_NE(text.find("Voodoo 2"), std::string::npos) << text;
    EXPECT_NE(text.find(device_names().front()), std::string::npos) << text;
    EXPECT_EQ(text.find('\n'), std::string::npos) << text;
  }
}

TEST(Device, IndexBeyondTheListIsRefused) {
  EXPECT_THROW(Device({.gpu = std::to_string(device_names().size())}), GpuError);
  EXPECT_THROW(Device({.gpu = "99999999999999999999"}), GpuError);
}

TEST(Device, NamesItsDriver) {
  const Device device;
  EXPECT_FALSE(device.identity().name.empty());
  EXPECT_FALSE(device.identity().driver.empty());
  EXPECT_EQ(device.identity().api_version.substr(0, 2), "1.");
}

}  // namespace
}  // namespace stylet::gpu
