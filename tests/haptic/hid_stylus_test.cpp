#include "haptic/hid/hid_stylus.h"

#include "haptic/output_guard.h"
#include "tests/support/hid/mock_hid_node.h"
#include "tests/support/hid/pid_stick.h"
#include "tests/support/hid/stylus_firmware.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <memory>
#include <thread>

namespace stylet::haptic::hid {
namespace {

using Eigen::Vector3d;
using support::FirmwareEvent;
using support::MockHidBus;
using support::MockHidNode;
using support::StylusFirmware;

const Vector3d kStart(0.1, 0.2, 0.3);

/// The hand goes to the right at 10 mm/s.
ForceStylusPose to_the_right(double time_s) {
  ForceStylusPose pose;
  pose.position.x() = 0.01 * time_s;
  return pose;
}

/// A stylus on the mocked bus, driven at 1 kHz by the test's own thread.
class HidStylusTest : public testing::Test {
protected:
  void open() {
    const std::vector<HidDeviceSummary> devices = list_hid_devices();
    ASSERT_FALSE(devices.empty());
    stylus = std::make_unique<HidStylus>(
        HidStylusSettings{.device = devices[0], .workspace = {.start = kStart}, .fifo_priority = 0, .retry_s = 0.02});
  }
  /// Reads and writes until `done`, at most so many milliseconds.
  bool step_until(const std::function<bool()>& done, int ms = 60'000) {
    const auto begin = std::chrono::steady_clock::now();
    while (std::chrono::steady_clock::now() - begin < std::chrono::milliseconds(ms)) {
      const StylusSample last = sample;
      sample = stylus->read(0);
      if ((sample.position - last.position).norm() > worst_step)
        worst_step = (sample.position - last.position).norm();
      stylus->write(sample.valid ? force : Vector3d::Zero(), Vector3d::Zero());
      if (done()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
  }
  bool step_until_valid() {
    return step_until([&] { return sample.valid; });
  }
  /// A busy machine spoils some of these attempts; what is wrong would spoil them all.
  static bool succeeds_once(const std::function<bool()>& attempt) {
    for (int k = 0; k < 30; ++k) {
      if (attempt()) return true;
    }
    return false;
  }
  /// By the motors, device frame.
  Vector3d applied() const {
    const Vector3d reported = node.with_device([&] { return firmware.applied_force(); });
    return DeviceProfile{}.device_from_report * reported;
  }
  std::size_t count(FirmwareEvent::Kind kind) const {
    return node.with_device([&] { return firmware.count(kind); });
  }

  MockHidBus bus;
  StylusFirmware firmware{to_the_right};
  MockHidNode node{bus, firmware};
  Vector3d force{0, 1, 0};
  StylusSample sample{.position = kStart};
  double worst_step = 0;
  std::unique_ptr<HidStylus> stylus;
};

TEST_F(HidStylusTest, PosesComeInAndForcesGoOut) {
  open();
  EXPECT_EQ(stylus->kind(), DeviceKind::kStylus);
  EXPECT_TRUE(stylus->limits().renders_force);
  EXPECT_EQ(stylus->name(), "Mocked stylus (1209:0001)");
  const HidStylusCounters& counters = stylus->counters();
  ASSERT_TRUE(step_until([&] { return sample.position.x() - kStart.x() > 0.003 && counters.stream.reports > 250; }));
  ASSERT_TRUE(step_until_valid());
  EXPECT_LT((sample.position - kStart).tail<2>().norm(), 1e-6);
  EXPECT_TRUE(step_until([&] { return applied().isApprox(force, 1e-3); })) << applied().transpose();
  EXPECT_EQ(counters.stream.reports, counters.stream.decoded[static_cast<std::size_t>(Decoded::kReading)]);
  EXPECT_GT(counters.force.written, 10u);
  EXPECT_EQ(counters.force.failed, 0u);
  EXPECT_GT(counters.force.pose_to_force.count(), 0u);
}

TEST_F(HidStylusTest, EndsWithZeroForceAndMotorsOff) {
  open();
  ASSERT_TRUE(step_until([&] { return applied().norm() > 0.9; }));
  stylus.reset();
  node.with_device([&] {
    const std::vector<FirmwareEvent>& events = firmware.events();
    ASSERT_GE(events.size(), 2u);
    EXPECT_EQ(events.back().kind, FirmwareEvent::kDisabled);
    EXPECT_EQ(events[events.size() - 2].kind, FirmwareEvent::kForce);
    EXPECT_TRUE(events[events.size() - 2].force.isZero(0));
  });
}

TEST(HidClutch, DropsTheForceAndTakesTheHandUpElsewhere) {
  MockHidBus bus;
  std::atomic<bool> held{false};
  std::atomic<double> right{0};
  StylusFirmware firmware([&](double) {
    return ForceStylusPose{.position = {right.load(), 0, 0}, .secondary_barrel = held.load()};
  });
  MockHidNode node(bus, firmware);
  HidStylus stylus({.device = list_hid_devices().at(0), .workspace = {.start = kStart}, .fifo_priority = 0});
  DeviceLimits limits = stylus.limits();
  limits.engage_rise_s = 0.05;  // a busy machine makes gaps, and every gap begins the rise anew
  OutputGuard guard(limits);
  StylusSample sample;
  double most_after_ms[3] = {};  // of the force sent, 1 to 3 ms after it came on again
  int on_ms = -1;
  const auto step_until = [&](const std::function<bool()>& done) {
    for (int k = 0; k < 10'000; ++k) {
      sample = stylus.read(0);
      const GuardedWrench out = guard.apply({.force = {0, 0.19, 0},
                                             .position = sample.position,
                                             .orientation = sample.orientation,
                                             .valid = sample.valid,
                                             .pose_age_s = sample.age_s},
                                            1e-3);
      stylus.write(out.force, out.torque);
      on_ms = out.force.isZero(0) ? -1 : on_ms + 1;
      if (on_ms >= 0 && on_ms < 3) most_after_ms[on_ms] = out.force.norm();
      if (done()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
  };
  const auto applied = [&] { return node.with_device([&] { return firmware.applied_force().norm(); }); };
  ASSERT_TRUE(step_until([&] { return applied() > 0.18; }));
  held = true;
  ASSERT_TRUE(step_until([&] { return !sample.valid && applied() == 0; }));
  right = 0.2;
  for (int k = 0; k < 50; ++k) {
    step_until([] { return true; });
    ASSERT_FALSE(sample.valid);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  EXPECT_EQ(sample.position, kStart);
  held = false;
  ASSERT_TRUE(step_until([&] { return applied() > 0.18; }));
  EXPECT_TRUE(sample.position.isApprox(kStart)) << "the hand is 200 mm away, and the needle where it was";
  for (int k = 0; k < 3; ++k) EXPECT_LE(most_after_ms[k], 0.19 * (k + 1) * 0.02 + 1e-9) << "it rises in 50 ms";
}

TEST_F(HidStylusTest, LoopThatStopsLeavesNoForce) {
  open();
  ASSERT_TRUE(step_until([&] { return applied().norm() > 0.9; }));
  ASSERT_TRUE(node.wait([&] { return firmware.applied_force().isZero(0); }));
  EXPECT_TRUE(firmware.enabled());
}

// Its own process, so that it can be killed: pushes to the right and up until then.
TEST(HidHost, DISABLED_PushesUntilKilled) {
  const std::vector<HidDeviceSummary> devices = list_hid_devices();
  ASSERT_FALSE(devices.empty());
  HidStylus stylus({.device = devices[0], .fifo_priority = 0});
  while (true) {
    stylus.read(0);
    stylus.write({1, 1, 0}, Vector3d::Zero());
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

/// That process.
pid_t push_until_killed() {
  const pid_t host = fork();
  if (host != 0) return host;
  execl("/proc/self/exe", "host", "--gtest_also_run_disabled_tests", "--gtest_brief=1",
        "--gtest_filter=HidHost.DISABLED_PushesUntilKilled", nullptr);
  _exit(127);
}

TEST_F(HidStylusTest, KilledHostLeavesNoForceAfter20Milliseconds) {
  const pid_t host = push_until_killed();
  ASSERT_GE(host, 0);
  const bool pushed = node.wait([&] { return firmware.applied_force().norm() > 0.9; });
  ASSERT_EQ(kill(host, SIGKILL), 0);
  ASSERT_EQ(waitpid(host, nullptr, 0), host);
  ASSERT_TRUE(pushed);
  ASSERT_TRUE(node.wait([&] { return firmware.applied_force().isZero(0); }));
  node.with_device([&] {
    const std::vector<FirmwareEvent>& events = firmware.events();
    ASSERT_EQ(events.back().kind, FirmwareEvent::kTimeOut);
    const FirmwareEvent& last = events[events.size() - 2];
    EXPECT_TRUE(last.force.norm() > 0.9);  // the host said no good-bye
    EXPECT_GE(events.back().time_ns - last.time_ns, 20'000'000);
  });
}

TEST_F(HidStylusTest, ReconnectedAtAnotherPoseItContinuesWithoutAJump) {
  open();
  ASSERT_TRUE(step_until([&] { return sample.position.x() - kStart.x() > 0.002; }));
  node.unplug();
  ASSERT_TRUE(step_until([&] { return !sample.valid && !stylus->connected(); }));
  const Vector3d left = sample.position;
  ASSERT_FALSE(step_until([&] { return sample.valid; }, 50));
  EXPECT_EQ(sample.position, left);
  node.plug(5);
  ASSERT_TRUE(step_until_valid());
  ASSERT_TRUE(step_until([&] { return sample.position.x() - left.x() > 0.001; }));
  ASSERT_TRUE(step_until([&] { return applied().norm() > 0.9; }));
  EXPECT_LT(worst_step, 0.002);
  EXPECT_EQ(stylus->counters().connections, 2u);
  EXPECT_EQ(count(FirmwareEvent::kEnabled), 2u);
}

TEST_F(HidStylusTest, StallOf300MillisecondsIsAGapWithoutAJump) {
  open();
  ASSERT_TRUE(step_until([&] { return sample.position.x() - kStart.x() > 0.002; }));
  EXPECT_TRUE(succeeds_once([&] {
    const std::uint64_t gaps = stylus->counters().stream.gaps;
    node.stall(0.3);
    EXPECT_TRUE(step_until([&] { return !sample.valid; }));
    const Vector3d left = sample.position;
    EXPECT_TRUE(step_until_valid());
    EXPECT_NEAR((sample.position - left).norm(), 0, 0.001);
    return stylus->counters().stream.gaps == gaps + 1;
  }));
  EXPECT_LT(worst_step, 0.002);
}

TEST_F(HidStylusTest, GarbageIsCountedAndChangesNothing) {
  open();
  ASSERT_TRUE(step_until_valid());
  node.set_streaming(false);
  ASSERT_TRUE(step_until([&] { return !sample.valid; }));
  const std::uint64_t before = stylus->counters().stream.reports;
  node.inject(std::vector<std::uint8_t>{1, 2, 3});                 // truncated
  node.inject(std::vector<std::uint8_t>(1000, 1));                 // oversized
  node.inject(std::vector<std::uint8_t>{77, 1, 2, 3, 4});          // undeclared
  node.inject(std::vector<std::uint8_t>(kPoseReportBytes, 0x80));  // undeclared, as long as a pose
  std::vector<std::uint8_t> far(kPoseReportBytes, 0x7F);           // far out of its range
  far[0] = kPoseReport;
  node.inject(far);
  const auto decoded = [&](Decoded what) {
    return stylus->counters().stream.decoded[static_cast<std::size_t>(what)].load();
  };
  ASSERT_TRUE(step_until([&] { return stylus->counters().stream.reports == before + 5; }));
  EXPECT_FALSE(sample.valid);
  EXPECT_EQ(decoded(Decoded::kTruncated), 1u);
  EXPECT_EQ(decoded(Decoded::kOversized), 1u);
  EXPECT_EQ(decoded(Decoded::kUndeclared), 2u);
  EXPECT_EQ(decoded(Decoded::kOutOfRange), 1u);
}

TEST_F(HidStylusTest, SlowWritesLoseOldForcesAndNoPoses) {
  open();
  ASSERT_TRUE(step_until_valid());
  node.delay_writes(0.010);
  const HidStylusCounters& counters = stylus->counters();
  EXPECT_TRUE(succeeds_once([&] {
    const std::uint64_t lost = counters.stream.missing + counters.stream.discarded;
    const std::uint64_t superseded = counters.force.superseded;
    force = {0, 0.5, 0};
    EXPECT_TRUE(step_until([&] { return counters.force.superseded > superseded + 20; }));
    force = {2, 0, 0};
    EXPECT_TRUE(step_until([&] { return applied().isApprox(force, 1e-3); }));
    return sample.valid && counters.stream.missing + counters.stream.discarded == lost;
  }));
}

TEST_F(HidStylusTest, RefusedWritesAreCountedAndPosesGoOn) {
  open();
  ASSERT_TRUE(step_until_valid());
  node.fail_writes(EIO);
  ASSERT_TRUE(step_until([&] { return stylus->counters().force.failed > 5; }));
  EXPECT_TRUE(sample.valid);
  node.fail_writes(0);
  EXPECT_TRUE(step_until([&] { return applied().norm() > 0.9; }));
}

TEST(PidForce, LetsGoByItsEffectsOrByItsProfileOrIsTold) {
  const auto held = [](bool endless, double timeout_s) {
    return ForceOutput(parse_report_descriptor(support::PidStick(endless).descriptor()),
                       {.full_scale_force_n = 10, .force_timeout_s = timeout_s});
  };
  EXPECT_EQ(held(false, 0).way(), ForceOutput::Way::kConstantForce);
  EXPECT_DOUBLE_EQ(held(false, 0).held_s(), 0.018);
  EXPECT_DOUBLE_EQ(held(false, 0.010).held_s(), 0.010);
  EXPECT_TRUE(held(false, 0).lets_go());
  EXPECT_EQ(held(true, 0).way(), ForceOutput::Way::kConstantForce);
  EXPECT_EQ(held(true, 0).held_s(), 0);
  EXPECT_FALSE(held(true, 0).lets_go());
  EXPECT_TRUE(held(true, 0.020).lets_go());
  EXPECT_FALSE(held(true, 0.500).lets_go()) << "it lets go, but late";
}

/// A joystick with PID constant forces on the mocked bus.
class PidStickTest : public testing::Test {
protected:
  double pushed_right() const {
    return node.with_device([&] { return stick.applied(0); });
  }

  MockHidBus bus;
  support::PidStick stick;
  MockHidNode node{bus, stick};
};

TEST_F(PidStickTest, KilledHostLeavesNoForceAfter20Milliseconds) {
  const pid_t host = push_until_killed();
  ASSERT_GE(host, 0);
  const bool pushed = node.wait([&] { return stick.applied(0) > 0.1; });
  ASSERT_EQ(kill(host, SIGKILL), 0);
  ASSERT_EQ(waitpid(host, nullptr, 0), host);
  ASSERT_TRUE(pushed);
  ASSERT_TRUE(node.wait([&] { return stick.applied(0) == 0; })) << "it pushes for ever";
  node.with_device([&] {
    EXPECT_TRUE(stick.enabled());  // the host said no good-bye
    EXPECT_LE(stick.ran_out_ns() - stick.last_report_ns(), 20'000'000);
  });
}

TEST_F(PidStickTest, ItsForceDoesNotRunOutWhileTheHostLives) {
  HidStylus stylus({.device = list_hid_devices().at(0), .fifo_priority = 0});
  EXPECT_TRUE(stylus.lets_go());
  const auto push_for = [&](int starts) {
    const int before = node.with_device([&] { return stick.starts(); });
    for (int k = 0; k < 10'000 && node.with_device([&] { return stick.starts(); }) < before + starts; ++k) {
      stylus.read(0);
      stylus.write({1, 0, 0}, Vector3d::Zero());
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  };
  bool held = false;
  for (int attempt = 0; attempt < 30 && !held; ++attempt) {  // a busy machine spoils some
    push_for(4);
    const int run_out = node.with_device([&] { return stick.times_run_out(); });
    push_for(20);  // of two axes: 60 ms, three times as long as an effect lasts
    held = node.with_device([&] { return stick.times_run_out(); }) == run_out && pushed_right() > 0.1;
  }
  EXPECT_TRUE(held);
}

TEST_F(PidStickTest, EndsWithZeroForceAndMotorsOff) {
  {
    HidStylus stylus({.device = list_hid_devices().at(0), .fifo_priority = 0});
    for (int k = 0; k < 10'000 && pushed_right() < 0.1; ++k) {
      stylus.read(0);
      stylus.write({1, 0, 0}, Vector3d::Zero());
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    EXPECT_GT(pushed_right(), 0.1);
  }
  EXPECT_EQ(pushed_right(), 0);
  EXPECT_FALSE(node.with_device([&] { return stick.enabled(); }));
}

}  // namespace
}  // namespace stylet::haptic::hid
