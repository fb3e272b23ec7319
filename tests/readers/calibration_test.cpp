#include "engine/readers/calibration_file.h"

#include "engine/readers/scenario.h"
#include "tests/support/temporary_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <optional>

namespace stylet::readers {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
namespace fs = std::filesystem;

/// The variable as it was, when the test is over.
class Environment {
public:
  Environment(const char* name, const char* value) : name_(name) {
    if (const char* before = std::getenv(name)) before_ = before;
    value != nullptr ? setenv(name, value, 1) : unsetenv(name);
  }
  ~Environment() { before_ ? setenv(name_, before_->c_str(), 1) : unsetenv(name_); }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;

private:
  const char* name_;
  std::optional<std::string> before_;
};

const CalibratedDevice kStylus{0x1209, 0xAB01, "SN/7 \xC3\xA9", "Stylus"};

TEST(Calibration, WhatIsSavedIsLoaded) {
  const support::TemporaryFolder folder;
  const Environment config("XDG_CONFIG_HOME", folder.path().c_str());
  EXPECT_FALSE(load_calibration(kStylus));
  haptic::hid::Calibration calibration;
  calibration.rest = Eigen::Vector3d(0.01, -0.02, 0.03);
  calibration.user_from_device = Eigen::AngleAxisd(0.4, Eigen::Vector3d(0.6, 0, 0.8));
  calibration.scale = 1.75;
  calibration.centre = {0.01, 0.02, 0.03, -0.04, 0.05, 0};
  calibration.dead_zone = {0.1, 0.2, 0.3, 0.4, 0.5, 0};
  const fs::path file = save_calibration(kStylus, calibration);
  EXPECT_EQ(file, folder.path() / "stylet" / "devices" / "1209-ab01-SN_7___.json");
  EXPECT_THAT(validate(file), ElementsAre());
  const auto back = load_calibration(kStylus);
  ASSERT_TRUE(back);
  EXPECT_LT((*back->rest - *calibration.rest).norm(), 1e-15);
  EXPECT_LT(back->user_from_device.angularDistance(calibration.user_from_device), 1e-12);
  EXPECT_EQ(back->scale, 1.75);
  EXPECT_EQ(back->centre, calibration.centre);
  EXPECT_EQ(back->dead_zone, calibration.dead_zone);
  // Another one in its place; nothing of the first is left.
  save_calibration(kStylus, {});
  const auto plain = load_calibration(kStylus);
  ASSERT_TRUE(plain);
  EXPECT_FALSE(plain->rest || plain->centre || plain->dead_zone);
  EXPECT_EQ(std::distance(fs::directory_iterator(file.parent_path()), {}), 1);
}

TEST(Calibration, HasItsPlaceInTheUsersConfiguration) {
  const Environment home("HOME", "/home/ann");
  const Environment none("XDG_CONFIG_HOME", nullptr);
  EXPECT_EQ(calibration_file({0x046D, 0xC626, "", ""}), "/home/ann/.config/stylet/devices/046d-c626.json");
  const Environment relative("XDG_CONFIG_HOME", "config");  // which the specification tells to ignore
  EXPECT_EQ(calibration_file({1, 2, "3", ""}), "/home/ann/.config/stylet/devices/0001-0002-3.json");
  const Environment homeless("HOME", nullptr);
  EXPECT_EQ(calibration_file(kStylus), "");
  EXPECT_FALSE(load_calibration(kStylus));
  EXPECT_THROW(save_calibration(kStylus, {}), files::ContentError);
}

TEST(Calibration, InvalidFilesAreReportedInOneLine) {
  const support::TemporaryFolder folder;
  const Environment config("XDG_CONFIG_HOME", folder.path().c_str());
  const auto problem = [&](const std::string& keys) -> std::string {
    const fs::path file = save_calibration(kStylus, {});
    std::ofstream(file) << R"({"format": "stylet-calibration", )" << keys << "}";
    try {
      load_calibration(kStylus);
    } catch (const files::ContentError& error) {
      EXPECT_THAT(error.what(), HasSubstr(file.string()));
      EXPECT_THAT(error.what(), HasSubstr("run `stylet devices --calibrate` to make it anew"));
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
      return error.what();
    }
    return "none";
  };
  const std::string whole = R"("version": 1, "vendor_id": "1209", "product_id": "ab01", "serial_number": "SN/7 é")";
  EXPECT_EQ(problem(whole), "none");
  EXPECT_THAT(problem(R"("version": 2)"), HasSubstr("version"));
  EXPECT_THAT(problem(whole + R"(, "scale": 11)"), HasSubstr("/scale: is 11"));
  EXPECT_THAT(problem(whole + R"(, "rest_mm": [1, 2])"), HasSubstr("/rest_mm"));
  EXPECT_THAT(problem(whole + R"(, "user_from_device": [1, 1, 0, 0])"), HasSubstr("/user_from_device"));
  EXPECT_THAT(problem(whole + R"(, "deflection": {"centre": [0, 0, 0, 0, 0, 0.3], "dead_zone": [0, 0, 0, 0, 0, 0]})"),
              HasSubstr("/deflection/centre"));
  EXPECT_THAT(problem(whole + R"(, "deflection": {"centre": [0, 0, 0, 0, 0, 0]})"), HasSubstr("dead_zone"));
  EXPECT_THAT(problem(whole + R"(, "sacle": 1)"), HasSubstr("scale"));
  EXPECT_THAT(problem(R"("version": 1, "vendor_id": "1209", "product_id": "ab01", "serial_number": "8")"),
              HasSubstr("is of another device (1209:ab01, serial number \"8\")"));
  EXPECT_THAT(problem(R"("version": )"), HasSubstr("1209-ab01"));
}

}  // namespace
}  // namespace stylet::readers
