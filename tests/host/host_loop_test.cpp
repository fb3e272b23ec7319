// What the device host makes of a vendor's library, and that library of it.
#include "haptic/host/host_loop.h"

#include "haptic/hid/device_profile.h"
#include "haptic/hid/report_descriptor.h"
#include "haptic/hid/stylus_adapter.h"
#include "haptic/hid/stylus_map.h"
#include "tests/host/mocked_host.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/vendor/mock_device.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

namespace stylet::haptic::host {
namespace {

using Eigen::Vector3d;
using support::MockDevice;
using ::testing::HasSubstr;

class DeviceHost : public testing::Test {
protected:
  explicit DeviceHost(const Mocked& which) : mocked(which) {
    mock().reset();
    mock().now_ns = now;
  }
  void open() {
    host.emplace(mocked);
    order({hid::kControlReport, 1});
  }
  void order(const std::vector<std::uint8_t>& bytes) { host->channel->orders.put(bytes); }
  void push(const Vector3d& force) {
    std::vector<std::uint8_t> bytes{hid::kForceReport};
    for (int k = 0; k < 3; ++k) {
      const auto raw = static_cast<std::int16_t>(std::lround(force[k] / kMostForce * 32767));
      bytes.push_back(static_cast<std::uint8_t>(raw & 0xFF));
      bytes.push_back(static_cast<std::uint8_t>(raw >> 8 & 0xFF));
    }
    order(bytes);
  }
  bool turn() {
    now += kMs;
    mock().now_ns = now;
    call(mocked, mocked.tick);
    const bool there = host->loop->turn();
    std::array<std::uint8_t, 31> bytes{};
    while (const std::size_t size = host->channel->poses.take(next, bytes)) {
      EXPECT_EQ(map.decode(std::span(bytes).first(size), pose), hid::Decoded::kReading);
    }
    return there;
  }
  void push_for(const Vector3d& force, int ms) {
    for (int k = 0; k < ms; ++k) {
      push(force);
      turn();
    }
  }
  std::string refused(const std::string& library = "") {
    try {
      make_driver(mocked.kind, library.empty() ? mocked.library : library, kTestClock)->open();
    } catch (const DriverError& error) {
      return error.what();
    }
    return "";
  }

  Mocked mocked;
  std::int64_t now = 1000 * kMs;
  std::optional<Host> host;
  std::uint64_t next = 0;
  hid::StylusMap map{hid::parse_report_descriptor(hid::adapted_descriptor(kMostForce)), hid::DeviceProfile{}};
  hid::HidReading pose;
};

class DhdHost : public DeviceHost {
protected:
  DhdHost() : DeviceHost(kDhd) {}
};

class HdHost : public DeviceHost {
protected:
  HdHost() : DeviceHost(kHd) {}
};

TEST_F(DhdHost, AxesButtonsAndForcesGoBothWays) {
  open();
  EXPECT_EQ(host->device.name, "omega.6");
  EXPECT_EQ(host->device.serial, "4711");
  EXPECT_EQ(mock().watch_dog, 160) << "20 ms of the firmware's own";
  // The library: towards the user, right, up.
  mock().x = 0.03, mock().y = 0.01, mock().z = 0.02;
  mock().turn_x = 0.5;
  mock().buttons = 1;
  push_for({1, 2, 3}, 80);
  // Device frame: right, up, towards the user.
  EXPECT_LT((pose.position - Vector3d(0.01, 0.02, 0.03)).norm(), 1e-6);
  const Eigen::Quaterniond rest(hid::DeviceProfile{}.device_from_needle_at_rest);
  const Eigen::AngleAxisd turned(pose.orientation * rest.conjugate());
  EXPECT_LT((turned.axis() * turned.angle() - Vector3d(0, 0, 0.5)).norm(), 1e-5) << "about what points to the user";
  EXPECT_EQ(pose.buttons & 3u, hid::kBarrelButton);
  // Reports: right, near, down.
  EXPECT_LT((Vector3d(mock().fx, mock().fy, mock().fz) - Vector3d(2, 1, -3)).norm(), 1e-3);
  EXPECT_EQ(mock().broken, 0u);
}

TEST_F(DhdHost, WhatItsMotorsGiveIsTold) {
  open();
  mock().gives = 0.5;
  push_for({1, 2, 3}, 80);
  ASSERT_EQ(host->channel->tells.load(), 1u);
  const auto& told = host->channel->told_force;
  EXPECT_LT((Vector3d(told[0], told[1], told[2]) - 0.5 * Vector3d(1, 2, 3)).norm(), 1e-3);
}

TEST_F(DhdHost, ForcesAreNoLargerThanTheDevices) {
  open();
  push_for({16, 16, 16}, 80);
  EXPECT_NEAR(mock().largest, 12, 1e-6);
}

TEST_F(DhdHost, NothingPushesBeforeTheMotorsAreEnabled) {
  host.emplace(mocked);
  push_for({0, 0, 2}, 80);
  EXPECT_EQ(mock().forces, 0u);
  EXPECT_EQ(mock().on, 0);
}

TEST_F(DhdHost, AStyletThatFallsSilentLeavesNoForceAfter20Ms) {
  open();
  push_for({0, 0, 2}, 80);
  ASSERT_GT(mock().applied(), 1.9);
  int ms = 0;
  for (; ms < 100 && mock().applied() > 0; ++ms) turn();
  EXPECT_LE(ms, 21);
  EXPECT_GE(ms, 19);
  EXPECT_EQ(mock().cause, 0) << "the device host itself, not the firmware's watch-dog";
}

TEST_F(DhdHost, ALibraryThatHangsIsLeftToTheFirmware) {
  open();
  push_for({0, 0, 2}, 80);
  now += 20 * kMs;
  mock().now_ns = now;
  EXPECT_EQ(mock().applied(), 0);
  push(Vector3d(0, 0, 2));
  turn();
  EXPECT_EQ(mock().applied(), 0) << "and it is off";
  EXPECT_FALSE(pose.in_range && pose.actuators_enabled);
}

TEST_F(DhdHost, AHandThatWasTooFastFeelsForceWhenItHasBeenSlow) {
  open();
  push_for({0, 0, 2}, 80);
  mock().fault = MockDevice::kBrake;
  push_for({0, 0, 2}, 15);
  EXPECT_FALSE(pose.in_range);
  EXPECT_THAT(host->driver->needs(), HasSubstr("too fast"));
  mock().fault = MockDevice::kNone;
  for (int k = 0; k < 400; ++k) {  // still fast: 0.2 m/s
    mock().x = mock().x + 2e-4;
    push_for({0, 0, 2}, 1);
    ASSERT_EQ(mock().applied(), 0);
  }
  push_for({0, 0, 2}, 700);
  EXPECT_TRUE(pose.in_range);
  EXPECT_GT(mock().applied(), 1.9);
}

TEST_F(DhdHost, AForceThatIsOffForAnotherCauseStaysOff) {
  for (const int cause : {0, 1, 6}) {  // unknown to an old library, its own button, the dead man's switch
    mock().reset();
    mock().now_ns = now;
    open();
    push_for({0, 0, 2}, 80);
    ASSERT_GT(mock().applied(), 1.9);
    mock().on = 0, mock().cause = cause;
    push_for({0, 0, 2}, 2000);
    EXPECT_EQ(mock().on, 0) << cause;
    EXPECT_FALSE(pose.in_range) << cause;
    EXPECT_THAT(host->driver->needs(), HasSubstr("its own button")) << cause;
    host.reset();
  }
}

TEST_F(DhdHost, OtherSuccessIsSuccess) {
  open();
  mock().fault = MockDevice::kSaturated;
  push_for({0, 0, 2}, 80);
  EXPECT_GT(mock().applied(), 1.9);
}

// It was taken as one until it was known that TIMEGUARD gives the pose of before: one for ever is a stall.
TEST_F(DhdHost, ThePoseOfBeforeIsNoNewOne) {
  open();
  for (int k = 0; k < 80; ++k) {  // each second turn
    mock().fault = k % 2 == 0 ? MockDevice::kCached : MockDevice::kNone;
    push_for({0, 0, 2}, 1);
  }
  EXPECT_GT(mock().applied(), 1.9);
  const std::uint64_t poses = host->channel->poses.written();
  mock().fault = MockDevice::kCached;
  push_for({0, 0, 2}, 22);
  EXPECT_EQ(mock().applied(), 0);
  EXPECT_EQ(host->channel->poses.written(), poses);
  EXPECT_TRUE(turn()) << "but it is there";
  mock().fault = MockDevice::kNone;
  push_for({0, 0, 2}, 80);
  EXPECT_GT(mock().applied(), 1.9);
}

TEST_F(DhdHost, StatusOfOldAndNewVersionsIsRead) {
  for (const int size : {13, 17, 32}) {
    mock().reset();
    mock().now_ns = now;
    mock().status_size = size;
    open();
    push_for({0, 0, 2}, 80);
    EXPECT_GT(mock().applied(), 1.9) << size;
    host.reset();
  }
}

TEST_F(DhdHost, WhatItNeedsIsSaid) {
  open();
  mock().fault = MockDevice::kNotHomed;
  push_for({0, 0, 2}, 30);
  EXPECT_FALSE(pose.in_range);
  EXPECT_EQ(mock().applied(), 0);
  EXPECT_THAT(host->driver->needs(), HasSubstr("home it"));
  mock().fault = MockDevice::kNoPower;
  push_for({0, 0, 2}, 30);
  EXPECT_THAT(host->driver->needs(), HasSubstr("no power"));
}

TEST_F(DhdHost, PulledOutItIsGone) {
  open();
  push_for({0, 0, 2}, 80);
  mock().fault = MockDevice::kPulledOut;
  bool there = true;
  for (int ms = 0; ms < 30 && there; ++ms) there = turn();
  EXPECT_FALSE(there);
}

TEST_F(DhdHost, ClosedItIsOff) {
  open();
  push_for({0, 0, 2}, 80);
  host->driver->close();
  EXPECT_EQ(Vector3d(mock().fx, mock().fy, mock().fz), Vector3d(0, 0, 0)) << "told so, before the motors went off";
  EXPECT_EQ(mock().on, 0);
  EXPECT_EQ(mock().closed, 1);
  host.reset();
  EXPECT_EQ(mock().closed, 1) << "once";
  EXPECT_EQ(mock().broken, 0u);
}

TEST_F(DhdHost, WhatCannotBeUsedIsSaidWithWhatToDo) {
  EXPECT_THAT(refused("/nowhere/libdhd.so"), HasSubstr("not installed"));
  const support::TemporaryFolder folder;
  EXPECT_THAT(refused(folder.write("libdhd.so", "no library").string()), HasSubstr("cannot be loaded"));
  EXPECT_THAT(refused(STYLET_MOCK_DHD_OLD), HasSubstr("has no dhdSetWatchdog; install a newer version"));
  mock().major = 2;
  EXPECT_THAT(refused(), HasSubstr("version 2.17"));
  mock().major = 3;
  mock().devices = 0;
  EXPECT_THAT(refused(), HasSubstr("plug it in"));
  mock().devices = 1;
  mock().open_error = 20;
  EXPECT_THAT(refused(), HasSubstr("another program uses it"));
}

TEST_F(HdHost, AxesButtonsAndForcesGoBothWays) {
  open();
  EXPECT_EQ(host->device.name, "Touch");
  EXPECT_EQ(host->device.serial, "0815");
  // The library: right, up, towards the user.
  mock().x = 0.01, mock().y = 0.02, mock().z = 0.03;
  mock().turn_x = 0.5;
  mock().buttons = 2;
  push_for({1, 2, -2}, 80);
  EXPECT_LT((pose.position - Vector3d(0.01, 0.02, 0.03)).norm(), 1e-6);
  const Eigen::Quaterniond rest(hid::DeviceProfile{}.device_from_needle_at_rest);
  const Eigen::AngleAxisd turned(pose.orientation * rest.conjugate());
  EXPECT_LT((turned.axis() * turned.angle() - Vector3d(0.5, 0, 0)).norm(), 1e-3) << "about what points to the right";
  EXPECT_EQ(pose.buttons & 3u, hid::kSecondaryBarrelButton);
  // Reports: right, near, down.
  EXPECT_LT((Vector3d(mock().fx, mock().fy, mock().fz) - Vector3d(1, 2, 2)).norm(), 1e-3);
  EXPECT_EQ(mock().broken, 0u);
}

TEST_F(HdHost, ForcesAreNoLargerThanTheDevices) {
  open();
  push_for({16, 16, 16}, 80);
  EXPECT_NEAR(mock().largest, 3.3, 1e-6);
}

TEST_F(HdHost, NothingPushesBeforeTheMotorsAreEnabled) {
  host.emplace(mocked);
  push_for({0, 0, 2}, 80);
  EXPECT_EQ(mock().forces, 0u);
  EXPECT_EQ(mock().on, 0);
  EXPECT_EQ(mock().broken, 0u);
}

TEST_F(HdHost, AStyletThatFallsSilentLeavesNoForceAfter20Ms) {
  open();
  push_for({0, 0, 2}, 80);
  ASSERT_GT(mock().applied(), 1.9);
  int ms = 0;
  for (; ms < 100 && mock().applied() > 0; ++ms) turn();
  EXPECT_LE(ms, 21);
  EXPECT_GE(ms, 19);
}

TEST_F(HdHost, ADeviceHostThatStandsLeavesNoForceAfter20Ms) {
  open();
  push_for({0, 0, 2}, 80);
  int ms = 0;
  for (; ms < 100 && mock().applied() > 0; ++ms) {
    now += kMs;
    mock().now_ns = now;
    call(mocked, mocked.tick);  // the library's thread alone
  }
  EXPECT_LE(ms, 21);
  EXPECT_GE(ms, 19);
}

TEST_F(HdHost, AForceThatTheLibraryCutsComesBack) {
  open();
  push_for({0, 0, 2}, 80);
  mock().fault = MockDevice::kBrake;
  push_for({0, 0, 2}, 5);
  EXPECT_FALSE(pose.in_range);
  EXPECT_THAT(host->driver->needs(), HasSubstr("203"));
  mock().fault = MockDevice::kNone;
  push_for({0, 0, 2}, 400);
  EXPECT_EQ(mock().applied(), 0);
  push_for({0, 0, 2}, 300);
  EXPECT_TRUE(pose.in_range);
  EXPECT_GT(mock().applied(), 1.9);
}

TEST_F(HdHost, ErrorsWithoutEndAreNoEnd) {
  open();
  mock().fault = MockDevice::kCached;
  push_for({0, 0, 2}, 80);
  EXPECT_GT(mock().applied(), 1.9);
}

TEST_F(HdHost, WhatItNeedsIsSaid) {
  mock().fault = MockDevice::kNotHomed;
  open();
  push_for({0, 0, 2}, 80);
  EXPECT_FALSE(pose.in_range);
  EXPECT_EQ(mock().applied(), 0);
  EXPECT_THAT(host->driver->needs(), HasSubstr("into its well"));
  mock().fault = MockDevice::kNone;
  push_for({0, 0, 2}, 600);
  EXPECT_TRUE(pose.in_range);
  mock().fault = MockDevice::kFrozen;
  push_for({0, 0, 2}, 5);
  EXPECT_FALSE(pose.in_range);
  EXPECT_THAT(host->driver->needs(), HasSubstr("set-up"));
}

TEST_F(HdHost, IsCalibratedByOneOfItsStyles) {
  // Auto, else the inkwell, else the encoders.
  for (const auto& [styles, style] : {std::pair{7, 2}, {3, 2}, {6, 2}, {5, 4}, {4, 4}, {1, 1}}) {
    mock().reset();
    mock().now_ns = now;
    mock().styles = styles;
    mock().fault = MockDevice::kUncalibrated;
    open();
    push_for({0, 0, 0}, 3);
    EXPECT_EQ(mock().calibrated_by, style) << styles;
    EXPECT_EQ(host->driver->needs().find("well") != std::string::npos, style == 4) << styles;
    host.reset();
  }
}

TEST_F(HdHost, PulledOutItIsGone) {
  open();
  push_for({0, 0, 2}, 80);
  mock().fault = MockDevice::kPulledOut;
  bool there = true;
  for (int ms = 0; ms < 30 && there; ++ms) there = turn();
  EXPECT_FALSE(there);
}

TEST_F(HdHost, ClosedItIsOff) {
  open();
  push_for({0, 0, 2}, 80);
  host->driver->close();
  EXPECT_EQ(mock().fx, 0);
  EXPECT_EQ(mock().fy, 0);
  EXPECT_EQ(mock().on, 0);
  EXPECT_EQ(mock().closed, 1);
  host.reset();
  EXPECT_EQ(mock().closed, 1) << "once";
  EXPECT_EQ(mock().broken, 0u);
}

TEST_F(HdHost, WhatCannotBeUsedIsSaidWithWhatToDo) {
  EXPECT_THAT(refused("/nowhere/libHD.so"), HasSubstr("not installed"));
  EXPECT_THAT(refused(STYLET_MOCK_HD_OLD), HasSubstr("has no hdUnschedule; install a newer version"));
  mock().devices = 0;
  EXPECT_THAT(refused(), HasSubstr("error 302, communication error"));
  mock().devices = 1;
  mock().open_error = 0x600;
  EXPECT_THAT(refused(), HasSubstr("licence"));
  mock().open_error = 1;
  EXPECT_EQ(refused(), "") << "one that wants a name gets one";
}

// ---- A library whose calls take their time

/// Its clock goes on by `takes` while it is read, by `enabling` while it is switched on.
class SlowDriver final : public Driver {
public:
  Device open() override { return {}; }
  Read read(hid::AdaptedState& state, std::int64_t) override {
    mock().now_ns = mock().now_ns + takes;
    state.in_range = state.enabled = state.power = true;
    return Read::kPose;
  }
  bool push(const Vector3d& force) override {
    pushed = force;
    ++pushes;
    return true;
  }
  void enable(bool on) override { mock().now_ns = mock().now_ns + (on ? enabling : 0); }
  std::string needs() const override { return {}; }
  void close() override {}

  std::int64_t takes = 0;
  std::int64_t enabling = 0;
  Vector3d pushed{0, 0, 0};
  int pushes = 0;
};

class SlowLibrary : public testing::Test {
protected:
  SlowLibrary() {
    mock().reset();
    mock().now_ns = 1000 * kMs;
    channel->orders.put(std::vector<std::uint8_t>{hid::kControlReport, 1});
    loop.turn();
  }
  void order() { channel->orders.put(std::vector<std::uint8_t>{hid::kForceReport, 0, 0, 0, 0, 0, 0x10}); }
  void push_for(int ms) {
    for (int k = 0; k < ms; ++k) {
      mock().now_ns = mock().now_ns + kMs;
      order();
      loop.turn();
    }
  }

  std::unique_ptr<Channel> channel = std::make_unique<Channel>();
  SlowDriver driver;
  HostLoop loop{driver, *channel, kTestClock};
};

TEST_F(SlowLibrary, AfterAReadThatHungThereIsNoForce) {
  push_for(80);
  ASSERT_GT(driver.pushed.norm(), 1.9);
  driver.takes = 300 * kMs;
  push_for(1);
  EXPECT_EQ(driver.pushed.norm(), 0) << "the order and the pose are as old as the read took";
}

TEST_F(SlowLibrary, OrdersThatWaitedAreNotFresh) {
  channel->orders.put(std::vector<std::uint8_t>{hid::kControlReport, 2});
  loop.turn();
  driver.enabling = 300 * kMs;
  channel->orders.put(std::vector<std::uint8_t>{hid::kControlReport, 1});
  loop.turn();  // it hangs before the pose is asked for: that is fresh
  for (int k = 0; k < 40; ++k) order();
  for (int k = 0; k < 3; ++k) {
    mock().now_ns = mock().now_ns + 5 * kMs;
    loop.turn();
    EXPECT_EQ(driver.pushed.norm(), 0);
  }
  push_for(80);
  EXPECT_GT(driver.pushed.norm(), 1.9);
}

TEST_F(SlowLibrary, AForceThatIsOverDoesNotWaitForTheNextRead) {
  push_for(80);
  ASSERT_GT(driver.pushed.norm(), 1.9);
  mock().now_ns = mock().now_ns + 20 * kMs;
  loop.obey();
  EXPECT_EQ(driver.pushed.norm(), 0);
  const int pushes = driver.pushes;
  loop.obey();
  EXPECT_EQ(driver.pushes, pushes) << "once";
}

TEST_F(SlowLibrary, AForceOutsideItsRangeIsNoneAtOnce) {
  push_for(80);
  ASSERT_GT(driver.pushed.norm(), 1.9);
  channel->orders.put(std::vector<std::uint8_t>{hid::kForceReport, 0, 0, 0, 0, 0, 0x80});
  loop.turn();
  EXPECT_EQ(driver.pushed.norm(), 0);
}

}  // namespace
}  // namespace stylet::haptic::host
