#include "engine/readers/device_profile_file.h"

#include "engine/readers/scenario.h"
#include "haptic/hid/force_output.h"
#include "haptic/hid/stylus_map.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>

namespace stylet::readers {
namespace {

namespace hid = haptic::hid;
using Eigen::Vector3d;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

const std::filesystem::path kDevices = std::filesystem::path(STYLET_SOURCE_DIR) / "content" / "devices";

/// A profile with these keys, and its problems.
hid::DeviceProfile read_profile(const std::string& keys, std::vector<std::string>* problems = nullptr) {
  files::JsonFile file("device.json", R"({"format": "stylet-device", "version": 1, "name": "n", )" + keys + "}");
  hid::DeviceProfile profile = read_device_profile(file);
  if (problems != nullptr) {
    *problems = file.problems();
  } else {
    EXPECT_THAT(file.problems(), ElementsAre());
  }
  return profile;
}

TEST(DeviceProfile, ShippedOnesAreSoundAndChosenByWhatFitsBest) {
  for (const auto& entry : std::filesystem::directory_iterator(kDevices)) {
    if (entry.path().extension() != ".json") continue;
    EXPECT_THAT(validate(entry.path()), ElementsAre()) << entry.path();
  }
  const auto profiles = load_device_profiles(kDevices);
  const auto chosen = [&](std::uint16_t vendor, std::uint16_t product, hid::DeviceKind kind) {
    return choose_profile(profiles, {.vendor_id = vendor, .product_id = product}, kind);
  };
  EXPECT_EQ(chosen(0x046D, 0xC626, hid::DeviceKind::kSpaceMouse).name, "3Dconnexion");
  EXPECT_EQ(chosen(0x046D, 0xC52B, hid::DeviceKind::kUnusable).name, "") << "a mouse of Logitech";
  EXPECT_EQ(chosen(0x1234, 1, hid::DeviceKind::kStylus).name, "Force stylus");
  EXPECT_EQ(chosen(0x1234, 1, hid::DeviceKind::kPen).name, "Pen");
  EXPECT_THAT(chosen(0x2988, 0x0304, hid::DeviceKind::kUnusable).unusable, HasSubstr("not published"));
  EXPECT_EQ(chosen(0x2988, 0x0303, hid::DeviceKind::kUnusable).unusable, "");
}

TEST(DeviceProfile, EachLimitOverridesItsDefault) {
  const auto profile = read_profile(R"("matches": [{"vendor_id": "256F", "product_ids": ["c635", "0001"]}],
      "limits": {"max_force_n": 12, "continuous_force_n": 8})");
  ASSERT_TRUE(profile.limits);
  EXPECT_EQ(profile.limits->max_force_n, 12);
  EXPECT_EQ(profile.limits->continuous_force_n, 8);
  EXPECT_EQ(profile.limits->max_stiffness_n_per_m, haptic::DeviceLimits{}.max_stiffness_n_per_m);
  EXPECT_EQ(profile.matches[0].vendor_id, 0x256F);
  EXPECT_THAT(profile.matches[0].product_ids, ElementsAre(0xC635, 1));
  EXPECT_FALSE(read_profile(R"("matches": [{"kind": "pen"}])").limits);
}

TEST(DeviceProfile, AxesAreRowsOfTheDeviceFrame) {
  const auto profile = read_profile(R"("matches": [{"kind": "stylus"}], "axes": ["-y", "+x", "+z"],
      "needle_at_rest": ["+y", "+z", "+x"])");
  EXPECT_EQ(Vector3d(profile.device_from_report * Vector3d(1, 2, 3)), Vector3d(-2, 1, 3));
  EXPECT_EQ(profile.rotation_from_report, profile.device_from_report);
  EXPECT_EQ(Vector3d(profile.device_from_needle_at_rest * Vector3d::UnitZ()), Vector3d::UnitX());
  // A mirror turns rotations round.
  const auto mirror = read_profile(R"("matches": [{"kind": "stylus"}], "axes": ["-x", "+y", "+z"])");
  EXPECT_EQ(mirror.rotation_from_report, -mirror.device_from_report);
}

TEST(DeviceProfile, InvalidFilesAreReportedWithPlaceAndReason) {
  const auto expect = [](const std::string& keys, const char* problem) {
    std::vector<std::string> problems;
    read_profile(keys, &problems);
    ASSERT_EQ(problems.size(), 1U) << keys;
    EXPECT_THAT(problems[0], HasSubstr(problem));
  };
  const std::string pen = R"("matches": [{"kind": "pen"}], )";
  expect(R"("matches": [{}])", "/matches/0: fits every device");
  expect(R"("matches": [{"vendor_id": "25"}])", "four hexadecimal digits");
  expect(R"("matches": [{"kind": "pen", "product_ids": ["0001"]}])", "mean nothing without vendor_id");
  expect(pen + R"("axes": ["+x", "+x", "+y"])", "/axes: is not three different axes");
  expect(pen + R"("needle_at_rest": ["-x", "+z", "-y"])", "left-handed");
  expect(pen + R"("limits": {"max_force_n": 1, "continuous_force_n": 2})", "is 2, above max_force_n (1)");
  expect(pen + R"("limits": {"max_force": 1})", "max_force");
  const auto field = [&](const char* rest) {
    return pen + R"("reports": [{"id": 1, "bytes": 3, "fields": [{"usage": )" + rest + "}]}]";
  };
  expect(field(R"("q", "bit": 0, "bits": 8)"), "/reports/0/fields/0/usage: is \"q\", none of x, y");
  expect(field(R"("x", "bit": 1, "bits": 16)"), "end at 17, beyond the 16");
  expect(field(R"("x", "bit": 0, "bits": 8, "logical": [0, 256])"), "is not within 0 to 255");
  expect(field(R"("x", "bit": 0, "bits": 8, "physical": [0, 0.5])"), "whole numbers");
  expect(R"("matches": [{"vendor_id": "0001"}], "reports": [{"id": 1, "bytes": 2, "fields": []}])", "give a kind");
}

TEST(DeviceProfile, VendorReportsGetTheirMeaningFromIt) {
  // One input and one output report of vendor bytes.
  const std::vector<std::uint8_t> bytes = {0x06, 0x00, 0xFF, 0x09, 0x01, 0xA1, 0x01, 0x85, 0x07, 0x75,
                                           0x08, 0x95, 0x09, 0x26, 0xFF, 0x00, 0x09, 0x01, 0x81, 0x02,
                                           0x85, 0x08, 0x95, 0x06, 0x09, 0x02, 0x91, 0x02, 0xC0};
  const hid::ReportDescriptor opaque = hid::parse_report_descriptor(bytes);
  const hid::StylusMap alone(opaque, {});
  EXPECT_FALSE(alone.usable());
  EXPECT_THAT(alone.reason(), HasSubstr("vendor's own kind"));

  const auto axis = [](const char* usage, int bit, const char* physical, const char* unit) {
    return fmt::format(R"({{"usage": "{}", "bit": {}, "bits": 16, "signed": true, "logical": [-1000, 1000],
        "physical": {}, "unit": "{}"}})",
                       usage, bit, physical, unit);
  };
  const auto profile = read_profile(
      R"("matches": [{"vendor_id": "2988", "kind": "stylus"}], "axes": ["+x", "+y", "+z"], "reports": [
        {"id": 7, "bytes": 10, "fields": [)" +
      axis("x", 16, "[-200, 200]", "mm") + "," + axis("y", 32, "[-200, 200]", "mm") + "," +
      axis("z", 48, "[-200, 200]", "mm") + R"(, {"usage": "button_2", "bit": 5, "bits": 1}]},
        {"type": "output", "id": 8, "bytes": 7, "fields": [)" +
      axis("x", 0, "[-5, 5]", "n") + "," + axis("y", 16, "[-5, 5]", "n") + "," + axis("z", 32, "[-5, 5]", "n") +
      "]}]");
  EXPECT_GT(profile.match({.vendor_id = 0x2988}, hid::DeviceKind::kUnusable), 0);
  const hid::ReportDescriptor full = hid::with_vendor_reports(opaque, profile);
  const hid::StylusMap map(full, profile);
  ASSERT_EQ(map.kind(), hid::DeviceKind::kStylus) << map.reason();
  hid::HidReading reading;
  // 500, -250 and 1000 at bytes 2, 4 and 6 after the id.
  const std::vector<std::uint8_t> report = {7, 0x20, 0, 0xF4, 0x01, 0x06, 0xFF, 0xE8, 0x03, 0};
  ASSERT_EQ(map.decode(report, reading), hid::Decoded::kReading);
  EXPECT_LT((reading.position - Vector3d(0.1, -0.05, 0.2)).norm(), 1e-12);
  EXPECT_EQ(reading.buttons, 2U);
  const hid::ForceOutput output(full, profile);
  ASSERT_EQ(output.way(), hid::ForceOutput::Way::kForceSample);
  std::array<std::uint8_t, 7> out{};
  ASSERT_EQ(output.encode(0, {1, -2.5, 9}, Vector3d::Zero(), out), out.size());
  EXPECT_THAT(out, ElementsAre(8, 200, 0, 0x0C, 0xFE, 0xE8, 0x03));
}

}  // namespace
}  // namespace stylet::readers
