#include "haptic/hid/force_stylus.h"
#include "tests/stylet/command.h"
#include "tests/support/temporary_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <span>

namespace stylet {
namespace {

using ::testing::HasSubstr;

std::string hex(std::span<const std::uint8_t> bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) text += fmt::format("{:02X}", byte);
  return text;
}

TEST(Devices, ListsWhatIsThere) {
  const Outcome list = run("devices --json");
  ASSERT_EQ(list.exit_code, 0) << list.output;
  std::size_t nodes = 0;
  for (const auto& entry : fs::directory_iterator("/dev"))
    nodes += entry.path().filename().string().starts_with("hidraw");
  EXPECT_EQ(nlohmann::json::parse(list.output).size(), nodes);
}

TEST(Devices, DescribesTheFieldsOfADescriptor) {
  const support::TemporaryFolder folder;
  const fs::path file = folder.write("stylus.hex", hex(haptic::hid::kForceStylusDescriptor));
  const Outcome said = run(fmt::format("devices --descriptor '{}' --id 1209:0001 --fields", file.string()));
  ASSERT_EQ(said.exit_code, 0) << said.output;
  EXPECT_THAT(said.output, HasSubstr("stylus with force; profile \"Force stylus\""));
  EXPECT_THAT(said.output, HasSubstr("X Y Z     -1000 to 1000 mm, steps of 0.0001, 32 bits, report 1"));
  EXPECT_THAT(said.output, HasSubstr("X 3.3 N, Y 3.3 N, Z 3.3 N by PID Download Force Sample"));
  EXPECT_THAT(said.output, HasSubstr("drops the force 20 ms after the host falls silent"));
  // The bytes themselves say the same.
  const fs::path raw = folder.write(
      "stylus.bin", {haptic::hid::kForceStylusDescriptor.begin(), haptic::hid::kForceStylusDescriptor.end()});
  const Outcome as_json = run(fmt::format("devices --json --descriptor '{}'", raw.string()));
  ASSERT_EQ(as_json.exit_code, 0) << as_json.output;
  const auto device = nlohmann::json::parse(as_json.output)[0];
  EXPECT_EQ(device["kind"], "stylus");
  EXPECT_EQ(device["usable"], true);
  EXPECT_EQ(device["axes"].size(), 6U);
  EXPECT_EQ(device["buttons"], 2);
  EXPECT_NEAR(device["force"]["max_force_n"].get<double>(), 3.3, 1e-9);
}

TEST(Devices, SayWhyOneIsNotUsable) {
  const support::TemporaryFolder folder;
  const Outcome broken = run(fmt::format("devices --descriptor '{}'", folder.write("a.hex", "05 01 C0").string()));
  EXPECT_EQ(broken.exit_code, 2);
  EXPECT_THAT(broken.output, HasSubstr("byte 2: End Collection without a Collection"));
  EXPECT_EQ(broken.lines(), 1);
  const fs::path vendor = folder.write("v.hex", "0600FF0901A101750895080901 8102C0");
  const Outcome opaque = run(fmt::format("devices --descriptor '{}'", vendor.string()));
  EXPECT_THAT(opaque.output, HasSubstr("not usable: it has only reports of the vendor's own kind"));
  const Outcome touch = run(fmt::format("devices --id 2988:0304 --descriptor '{}'", vendor.string()));
  EXPECT_THAT(touch.output,
              HasSubstr("not usable: the report format of the 3D Systems Touch (HID) is not published"));
  EXPECT_EQ(run(fmt::format("devices --id 12 --descriptor '{}'", vendor.string())).exit_code, 2);
}

}  // namespace
}  // namespace stylet
