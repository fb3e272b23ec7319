// The real kernel and the real hidapi between a stylus' firmware and a host. Runs with libhidapi-hidraw, and over USB
// with libhidapi-libusb in its place.
#include "haptic/latency_histogram.h"
#include "tests/kernel/counting_stylus.h"
#include "tests/kernel/hidapi_file.h"
#include "tests/kernel/kernel_device.h"

#include <gtest/gtest.h>

#include <array>
#include <cstdio>

namespace stylet::kernel_test {
namespace {

using Clock = std::chrono::steady_clock;
using haptic::hid::kPoseReportBytes;
using std::chrono::milliseconds;

constexpr int kReadMs = 2000;             // a report that takes longer is lost
constexpr std::size_t kHidrawRing = 63;   // reports that hidraw keeps; the next ones are dropped
constexpr std::size_t kLibusbQueue = 30;  // reports that hidapi-libusb keeps, by dropping the oldest

class StylusOverKernel : public testing::TestWithParam<PortKind> {
protected:
  StylusOverKernel() { device_.plug(); }
  ~StylusOverKernel() override { file_.reset(); }

  /// Waits for the device and opens it.
  void open_device() {
    entry_ = wait_for(identity_.vendor, identity_.product);
    ASSERT_TRUE(entry_) << "not listed";
    file_ = open(*entry_);
    ASSERT_TRUE(file_) << entry_->path;
  }
  bool libusb() const { return !entry_->path.starts_with("/dev/"); }

  int read(int timeout_ms = kReadMs) {
    return hid_read_timeout(file_.get(), report_.data(), report_.size(), timeout_ms);
  }
  std::uint16_t number() const { return CountingStylus::number(report_); }
  bool write_force(std::uint16_t number) {
    const auto force = CountingStylus::numbered_force(number);
    return hid_write(file_.get(), force.data(), force.size()) == static_cast<int>(force.size());
  }
  void expect_an_unbroken_stream(int reports) {
    ASSERT_EQ(read(), kPoseReportBytes);
    for (std::uint16_t last = number(); reports > 0; --reports) {
      ASSERT_EQ(read(), kPoseReportBytes);
      ASSERT_EQ(number(), ++last);
    }
  }
  /// Waits until `condition`, evaluated while the firmware stands still.
  template <typename Condition>
  bool wait(const Condition& condition) {
    const auto end = Clock::now() + std::chrono::seconds(10);
    while (!device_.with_firmware(condition)) {
      if (Clock::now() > end) {
        return false;
      }
      std::this_thread::sleep_for(milliseconds(1));
    }
    return true;
  }

  const DeviceIdentity identity_;
  CountingStylus firmware_;
  KernelDevice device_{GetParam(), firmware_, identity_};
  std::optional<HidapiEntry> entry_;
  HidapiFile file_{nullptr, hid_close};
  std::array<std::uint8_t, 256> report_{};
};

TEST_P(StylusOverKernel, IsListedByName) {
  const auto wide = [](const std::string& text) { return std::wstring(text.begin(), text.end()); };
  const auto entry = wait_for(identity_.vendor, identity_.product);
  ASSERT_TRUE(entry);
  EXPECT_EQ(entry->product, wide(identity_.name));
  EXPECT_EQ(entry->serial, wide(identity_.serial));
  if (GetParam() == PortKind::kUsb) {  // uhid has no manufacturer and no interfaces
    EXPECT_EQ(entry->manufacturer, wide(identity_.manufacturer));
    EXPECT_EQ(entry->interface_number, 0);
  }
}

TEST_P(StylusOverKernel, NothingIsLostMergedOrReorderedEitherWay) {
  open_device();
  constexpr std::uint16_t kReports = 2000;
  ASSERT_EQ(read(), kPoseReportBytes);
  std::uint16_t expected = number();  // the first since it was opened
  haptic::LatencyHistogram between_reads;
  haptic::LatencyHistogram writing;
  auto last = Clock::now();
  for (std::uint16_t i = 0; i < kReports; ++i) {
    const auto before = Clock::now();
    ASSERT_TRUE(write_force(i)) << i;
    writing.add((Clock::now() - before).count());
    ASSERT_EQ(read(), kPoseReportBytes) << "report " << i;
    ++expected;
    ASSERT_EQ(number(), expected) << "report " << i;
    ASSERT_EQ(CountingStylus::scan_time(report_),
              static_cast<std::uint16_t>(expected * haptic::hid::kScanTicksPerReport));
    between_reads.add((Clock::now() - last).count());
    last = Clock::now();
  }
  EXPECT_TRUE(wait([this] { return firmware_.forces.size() >= kReports; }));
  device_.with_firmware([&] {
    ASSERT_EQ(firmware_.forces.size(), kReports);
    EXPECT_EQ(firmware_.strange, 0U);
    for (std::uint16_t i = 0; i < kReports; ++i) {
      ASSERT_EQ(firmware_.forces[i], i);
    }
  });
  const auto us = [](double s) { return 1e6 * s; };
  std::printf(
      "  %d poses in and %d forces out; from read to read %.0f us median, %.0f us p99; hid_write %.0f, %.0f us\n",
      kReports, kReports, us(between_reads.quantile(0.5)), us(between_reads.quantile(0.99)),
      us(writing.quantile(0.5)), us(writing.quantile(0.99)));
}

TEST_P(StylusOverKernel, FeatureReportsGoBothWays) {
  open_device();
  std::array<std::uint8_t, haptic::hid::kGainReportBytes> gain{haptic::hid::kGainReport, 0};
  ASSERT_EQ(hid_get_feature_report(file_.get(), gain.data(), gain.size()), gain.size());
  EXPECT_EQ(gain[1], 255);
  gain[1] = 77;
  ASSERT_EQ(hid_send_feature_report(file_.get(), gain.data(), gain.size()), gain.size());
  EXPECT_EQ(device_.with_firmware([this] { return firmware_.gain; }), 77);
  gain[1] = 0;
  ASSERT_EQ(hid_get_feature_report(file_.get(), gain.data(), gain.size()), gain.size());
  EXPECT_EQ(gain[1], 77);
  std::array<std::uint8_t, 2> undeclared{9, 0};
  EXPECT_EQ(hid_get_feature_report(file_.get(), undeclared.data(), undeclared.size()), -1);
}

TEST_P(StylusOverKernel, AHostThatStalls300msSeesAGapAndThenFreshReports) {
  open_device();
  ASSERT_GT(read(), 0);
  const std::uint16_t before = number();
  // 300 ms of reports, however long they take.
  ASSERT_TRUE(wait([this, before] { return static_cast<std::uint16_t>(firmware_.sent - before) > 300; }));
  std::vector<std::uint16_t> queued;
  while (read(0) > 0) {
    queued.push_back(number());
  }
  if (libusb()) {
    ASSERT_GE(queued.size(), kLibusbQueue);
    EXPECT_GT(static_cast<std::uint16_t>(queued.front() - before), 100);
  } else {
    ASSERT_GE(queued.size(), kHidrawRing);
    for (std::size_t i = 0; i < kHidrawRing; ++i) {
      EXPECT_EQ(queued[i], static_cast<std::uint16_t>(before + 1 + i));
    }
  }
  ASSERT_GT(read(), 0);
  EXPECT_GE(static_cast<std::uint16_t>(number() - before), 300);
  expect_an_unbroken_stream(100);
}

TEST_P(StylusOverKernel, ADeviceThatStalls300msGoesOnWhereItWas) {
  open_device();
  ASSERT_GT(read(), 0);
  device_.set_streaming(false);
  std::uint16_t last = number();
  while (read(50) > 0) {
    EXPECT_EQ(number(), ++last);
  }
  EXPECT_EQ(read(250), 0);
  device_.set_streaming(true);
  ASSERT_GT(read(), 0);
  EXPECT_EQ(number(), ++last);
  expect_an_unbroken_stream(100);
}

TEST_P(StylusOverKernel, UnpluggedItFailsAtOnceAndPluggedInAgainItIsFound) {
  open_device();
  ASSERT_GT(read(), 0);
  device_.unplug();
  int size = 0;
  while ((size = read()) > 0) {
  }
  EXPECT_EQ(size, -1);
  EXPECT_FALSE(write_force(0));
  file_.reset();
  EXPECT_FALSE(wait_for(identity_.vendor, identity_.product, false)) << "still listed";
  device_.plug();
  open_device();
  expect_an_unbroken_stream(100);
  EXPECT_TRUE(write_force(1));
}

INSTANTIATE_TEST_SUITE_P(Over, StylusOverKernel, testing::Values(PortKind::kUhid, PortKind::kUsb),
                         [](const auto& port) { return port.param == PortKind::kUhid ? "Uhid" : "Usb"; });

}  // namespace
}  // namespace stylet::kernel_test
