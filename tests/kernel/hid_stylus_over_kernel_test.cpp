// What a session uses of the stylus, HidStylus, on the real kernel: over uhid and USB with libhidapi-hidraw, over USB
// with libhidapi-libusb in another executable.
#include "haptic/hid/hid_stylus.h"
#include "tests/kernel/kernel_device.h"
#include "tests/support/hid/stylus_firmware.h"

#include <gtest/gtest.h>
#include <hidapi.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <memory>
#include <thread>
#include <vector>

namespace stylet::kernel_test {
namespace {

using Eigen::Vector3d;
using namespace haptic::hid;
using support::FirmwareEvent;

/// The hand goes to the right at 10 mm/s.
ForceStylusPose hand(double time_s) {
  ForceStylusPose pose;
  pose.position.x() = 0.01 * time_s;
  return pose;
}

/// A stylus in use: the test's thread is the haptic loop.
class HidStylusOverKernel : public testing::TestWithParam<PortKind> {
protected:
  void SetUp() override {
    device_.plug();
    std::vector<HidDeviceSummary> devices;
    const auto listed = [&] {
      hid_exit();  // without udevd libusb hears of nothing that is plugged in later
      devices = list_hid_devices();
      return !devices.empty();
    };
    ASSERT_TRUE(step_until(listed, 20'000));
    libusb_ = !devices[0].path.starts_with("/dev/");
    stylus_ =
        std::make_unique<HidStylus>(HidStylusSettings{.device = devices[0], .fifo_priority = 0, .retry_s = 0.02});
    ASSERT_TRUE(step_until_valid());
  }
  /// Steps of 1 ms until `done`, at most so many.
  bool step_until(const std::function<bool()>& done, int steps = 10'000) {
    for (; steps > 0; --steps) {
      if (stylus_) step();
      if (done()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
  }
  void step() {
    const haptic::StylusSample last = sample_;
    sample_ = stylus_->read(0);
    if (last.valid) worst_step_ = std::max(worst_step_, (sample_.position - last.position).norm());
    stylus_->write(sample_.valid ? kForce : Vector3d::Zero(), Vector3d::Zero());
  }
  bool step_until_valid() {
    return step_until([this] { return sample_.valid; });
  }
  /// By the motors, device frame.
  Vector3d applied() const {
    return DeviceProfile{}.device_from_report * device_.with_firmware([this] { return firmware_.applied_force(); });
  }
  bool step_until_force() {
    return step_until([this] { return applied().isApprox(kForce, 1e-3); });
  }

  static inline const Vector3d kForce{0, 1, 0};
  static constexpr std::int64_t kTicks = 10;  ///< of 0.1 ms a period
  std::vector<std::int64_t> made_at_;         ///< ticks, each report's
  support::StylusFirmware firmware_{[this](double time_s) {
    made_at_.push_back(static_cast<std::int64_t>(time_s * 1e4));
    return hand(time_s);
  }};
  KernelDevice device_{GetParam(), firmware_, {}};
  haptic::StylusSample sample_{};
  double worst_step_ = 0;
  bool libusb_ = false;
  std::unique_ptr<HidStylus> stylus_;
};

TEST_P(HidStylusOverKernel, EveryPoseComesInAndForcesGoOut) {
  EXPECT_TRUE(stylus_->limits().renders_force);
  ASSERT_TRUE(step_until_force());
  const HidStylusCounters& counters = stylus_->counters();
  const auto made = [this] { return device_.with_firmware([this] { return firmware_.reports(); }); };
  const auto made_at = [this] { return device_.with_firmware([this] { return made_at_; }); };
  ASSERT_TRUE(step_until([&] { return counters.stream.reports > 20; }));  // it knows the period
  const std::size_t stamps_before = made_at().size();
  const std::uint64_t made_before = made();
  const std::uint64_t read_before = counters.stream.reports;
  const std::uint64_t missing_before = counters.stream.missing;
  const std::uint64_t gaps_before = counters.stream.gaps;
  const auto begin = std::chrono::steady_clock::now();
  ASSERT_TRUE(step_until([&] { return counters.stream.reports >= read_before + 2000; }));
  constexpr std::size_t kOnTheWay = 2;  // at either end
  EXPECT_NEAR(static_cast<double>(made() - made_before), static_cast<double>(counters.stream.reports - read_before),
              kOnTheWay);
  EXPECT_EQ(counters.stream.decoded[static_cast<std::size_t>(Decoded::kReading)], counters.stream.reports);
  // Missing is what the device, which waits for the emulated processor, left out by its own clock: a step of more
  // than one and a half periods, whose length as the stylus smooths it lies between these.
  constexpr double kShortest = 0.85 * kTicks, kLongest = 1.25 * kTicks;
  const std::vector<std::int64_t> stamps = made_at();
  std::int64_t at_least = 0;
  std::int64_t at_most = 0;
  for (std::size_t i = stamps_before - kOnTheWay; i < stamps.size(); ++i) {
    const auto step = static_cast<double>(stamps[i] - stamps[i - 1]);
    const bool read = i >= stamps_before + kOnTheWay && i + kOnTheWay < stamps.size();
    if (read && step > 1.5 * kLongest) at_least += std::llround(step / kLongest) - 1;
    if (step > 1.5 * kShortest) at_most += std::llround(step / kShortest) - 1;
  }
  const auto missing = static_cast<std::int64_t>(counters.stream.missing - missing_before);
  EXPECT_GE(missing, at_least);
  EXPECT_LE(missing, at_most);
  const double span_ms = std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  const double not_made = std::max(0.0, span_ms - static_cast<double>(made() - made_before));
  if (not_made < 5) {
    EXPECT_EQ(counters.stream.gaps, gaps_before);
  }
  EXPECT_EQ(counters.stream.discarded, 0U);
  EXPECT_EQ(counters.force.failed, 0U);
  EXPECT_EQ(device_.with_firmware([this] { return firmware_.count(FirmwareEvent::kRefused); }), 0U);
  EXPECT_TRUE(applied().isApprox(kForce, 1e-3)) << applied().transpose();
  const haptic::LatencyHistogram& latency = counters.force.pose_to_force;
  EXPECT_GT(latency.count(), 1000U);
  std::printf("  %d poses in, %d forces out; from pose to force %.0f us median, %.0f us p99\n",
              static_cast<int>(counters.stream.reports), static_cast<int>(counters.force.written),
              1e6 * latency.quantile(0.5), 1e6 * latency.quantile(0.99));
}

TEST_P(HidStylusOverKernel, AStallOf300msIsAGapWithoutAJump) {
  ASSERT_TRUE(step_until_force());
  device_.set_streaming(false);
  ASSERT_TRUE(step_until([this] { return !sample_.valid; }));
  ASSERT_FALSE(step_until([this] { return sample_.valid; }, 300));
  EXPECT_TRUE(applied().isZero(0));
  device_.set_streaming(true);
  ASSERT_TRUE(step_until_valid());
  ASSERT_TRUE(step_until_force());
  EXPECT_LT(worst_step_, 0.002);
  EXPECT_EQ(stylus_->counters().stream.gaps, 1U);
}

TEST_P(HidStylusOverKernel, UnpluggedAndPluggedInAgainItGoesOnWithoutAJump) {
  ASSERT_TRUE(step_until_force());
  device_.unplug();
  ASSERT_TRUE(step_until([this] { return !sample_.valid && !stylus_->connected(); }));
  const Vector3d left = sample_.position;
  ASSERT_FALSE(step_until([this] { return sample_.valid; }, 50));
  EXPECT_EQ(sample_.position, left);
  if (libusb_) GTEST_SKIP() << "it was seen to go; without udevd libusb does not hear of its return";
  device_.plug();
  ASSERT_TRUE(step_until_valid());
  ASSERT_TRUE(step_until_force());
  EXPECT_LT(worst_step_, 0.002);
  EXPECT_EQ(stylus_->counters().connections, 2U);
}

TEST_P(HidStylusOverKernel, ALoopThatStopsAndAHostThatEndsLeaveNoForce) {
  ASSERT_TRUE(step_until_force());
  const auto stopped = [this] { return applied().isZero(0); };
  for (int ms = 0; ms < 1000 && !stopped(); ++ms) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_TRUE(stopped()) << "nobody steps, and the force is " << applied().transpose();
  ASSERT_TRUE(step_until_force());
  stylus_.reset();
  const auto disabled = [this] { return device_.with_firmware([this] { return !firmware_.enabled(); }); };
  EXPECT_TRUE(step_until(disabled, 1000));
  EXPECT_TRUE(applied().isZero(0));
}

INSTANTIATE_TEST_SUITE_P(Over, HidStylusOverKernel, testing::Values(PortKind::kUhid, PortKind::kUsb),
                         [](const auto& port) { return port.param == PortKind::kUhid ? "Uhid" : "Usb"; });

}  // namespace
}  // namespace stylet::kernel_test
