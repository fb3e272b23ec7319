#include "tests/support/hid/stylus_firmware.h"

#include <gtest/gtest.h>

namespace stylet::support {
namespace {

constexpr std::array<std::uint8_t, 2> kEnable{3, 1};
constexpr std::array<std::uint8_t, 7> kPush{2, 0xFF, 0x7F, 0, 0, 0, 0};  // 3.3 N along X

// What haptic/README.md demands of a device: the host may die at any time.
TEST(StylusFirmware, DropsTheForce20MillisecondsAfterTheLastReport) {
  StylusFirmware firmware;
  firmware.output(0, kEnable);
  for (std::int64_t now = 0; now <= 100'000'000; now += 1'000'000) {
    firmware.output(now, kPush);
    firmware.tick(now);
    ASSERT_NEAR(firmware.applied_force().x(), 3.3, 1e-9);
  }
  firmware.tick(119'999'999);
  EXPECT_NEAR(firmware.applied_force().x(), 3.3, 1e-9);
  firmware.tick(120'000'000);
  EXPECT_TRUE(firmware.applied_force().isZero(0));
  EXPECT_EQ(firmware.count(FirmwareEvent::kTimeOut), 1u);
}

TEST(StylusFirmware, DropsTheForceWhileTheHandleIsOutOfRange) {
  bool in_range = true;
  StylusFirmware firmware([&](double) { return haptic::hid::ForceStylusPose{.in_range = in_range}; });
  std::array<std::uint8_t, 64> report{};
  firmware.output(0, kEnable);
  const auto millisecond = [&](std::int64_t ms) {
    firmware.input(ms * 1'000'000, report);
    firmware.output(ms * 1'000'000, kPush);
    return firmware.applied_force().x();
  };
  EXPECT_NEAR(millisecond(1), 3.3, 1e-9);
  in_range = false;
  firmware.input(2'000'000, report);
  EXPECT_TRUE(firmware.applied_force().isZero(0)) << "before the host has seen it";
  EXPECT_EQ(millisecond(3), 0) << "a host that does not look";
  in_range = true;
  EXPECT_NEAR(millisecond(4), 3.3, 1e-9);
  EXPECT_EQ(firmware.count(FirmwareEvent::kOutOfRange), 1u);
}

TEST(StylusFirmware, GivesNoForceBeforeTheMotorsAreEnabledAndAfter) {
  StylusFirmware firmware;
  firmware.output(0, kPush);
  EXPECT_TRUE(firmware.applied_force().isZero(0));
  firmware.output(0, kEnable);
  EXPECT_TRUE(firmware.applied_force().isZero(0)) << "of before";
  firmware.output(0, kPush);
  EXPECT_FALSE(firmware.applied_force().isZero(0));
  firmware.output(0, std::array<std::uint8_t, 2>{3, 2});
  EXPECT_TRUE(firmware.applied_force().isZero(0));
}

}  // namespace
}  // namespace stylet::support
