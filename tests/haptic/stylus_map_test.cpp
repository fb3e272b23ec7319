#include "haptic/hid/stylus_map.h"

#include "haptic/hid/force_output.h"
#include "haptic/hid/force_stylus.h"
#include "haptic/hid/usages.h"
#include "tests/haptic/hid_corpus.h"
#include "tests/support/allocation_count.h"
#include "tests/support/random.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numbers>
#include <random>

namespace stylet::haptic::hid {
namespace {

using Eigen::Vector3d;

ReportDescriptor force_stylus() {
  return parse_report_descriptor(kForceStylusDescriptor);
}

/// The device frame of HID axes: right, up, towards the trainee.
Vector3d seen(const Vector3d& report) {
  return {report.x(), -report.z(), report.y()};
}

TEST(StylusMap, ForceStylusKeepsItsPromises) {
  const ReportDescriptor descriptor = force_stylus();
  EXPECT_TRUE(descriptor.warnings.empty());
  EXPECT_EQ(descriptor.report(ReportType::kInput, kPoseReport)->bytes(), kPoseReportBytes);
  EXPECT_EQ(descriptor.report(ReportType::kOutput, kForceReport)->bytes(), kForceReportBytes);
  EXPECT_EQ(descriptor.report(ReportType::kOutput, kControlReport)->bytes(), kControlReportBytes);
  EXPECT_EQ(descriptor.report(ReportType::kFeature, kGainReport)->bytes(), kGainReportBytes);
  const StylusMap map(descriptor, {});
  EXPECT_EQ(map.kind(), DeviceKind::kStylus) << map.reason();
  EXPECT_FALSE(map.rate_only());
  EXPECT_DOUBLE_EQ(map.scan_tick_s(), 1e-4);
  EXPECT_EQ(map.scan_modulus(), 65536U);
  EXPECT_EQ(map.max_input_bytes(), kPoseReportBytes);
}

TEST(StylusMap, ReadsThePosesOfTheForceStylus) {
  const StylusMap map(force_stylus(), {});
  support::Random random(3);
  HidReading reading;
  for (int k = 0; k < 200; ++k) {
    ForceStylusPose pose{.position = random.vector(0.3),
                         .rotation_vector = random.vector(1.8),
                         .scan_time = static_cast<std::uint16_t>(977 * k),
                         .barrel = k % 2 == 1,
                         .secondary_barrel = k % 3 == 1,
                         .in_range = k % 5 != 0,
                         .actuators_enabled = k % 7 == 0,
                         .safety_switch = k % 4 == 0,
                         .actuator_power = k % 8 == 3};
    ASSERT_EQ(map.decode(pack_pose(pose), reading), Decoded::kReading);
    EXPECT_LT((reading.position - seen(pose.position)).norm(), 1e-7);
    const double angle = pose.rotation_vector.norm();
    // At rest the needle points down (-Y), its bevel to the right.
    const Eigen::AngleAxisd turn(angle, seen(pose.rotation_vector) / angle);
    EXPECT_LT((reading.orientation * Vector3d::UnitZ() - turn * -Vector3d::UnitY()).norm(), 3e-6);
    EXPECT_LT((reading.orientation * Vector3d::UnitX() - turn * Vector3d::UnitX()).norm(), 3e-6);
    EXPECT_EQ(reading.scan_time, pose.scan_time);
    EXPECT_EQ(reading.buttons, (pose.barrel ? 1U : 0U) | (pose.secondary_barrel ? 2U : 0U));
    EXPECT_EQ(reading.in_range, pose.in_range);
    EXPECT_EQ(reading.actuators_enabled, pose.actuators_enabled);
    EXPECT_EQ(reading.safety_switch, pose.safety_switch);
    EXPECT_EQ(reading.actuator_power, pose.actuator_power);
    EXPECT_EQ(reading.carries, kPosition | kOrientation | kButtons | hid::kScanTime | kPresence | kActuators);
  }
}

TEST(StylusMap, DropsWhatIsNotAWholeReport) {
  const StylusMap map(force_stylus(), {});
  const auto report = pack_pose({.position = Vector3d(0.01, 0.02, 0.03)});
  HidReading reading;
  ASSERT_EQ(map.decode(report, reading), Decoded::kReading);
  const HidReading before = reading;
  const auto expect_dropped = [&](std::vector<std::uint8_t> bytes, Decoded why) {
    EXPECT_EQ(map.decode(bytes, reading), why);
    EXPECT_EQ(reading.position, before.position);
    EXPECT_EQ(reading.carries, before.carries);
  };
  const auto other = pack_pose({.position = Vector3d(0.1, 0.1, 0.1)});
  std::vector<std::uint8_t> bytes(other.begin(), other.end());
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    expect_dropped({bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size)}, Decoded::kTruncated);
  }
  bytes.push_back(0);
  expect_dropped(bytes, Decoded::kOversized);
  bytes.pop_back();
  for (int id = 0; id < 256; ++id) {
    if (id == kPoseReport) continue;
    bytes[0] = static_cast<std::uint8_t>(id);
    expect_dropped(bytes, Decoded::kUndeclared);
  }
  bytes[0] = kPoseReport;
  for (int k = 21; k < 25; ++k) bytes[k] = 0x7F;  // Rz, far beyond pi; X to Ry are sound
  expect_dropped(bytes, Decoded::kOutOfRange);
}

TEST(StylusMap, RandomReportsNeitherAllocateNorGiveNonsense) {
  const StylusMap map(force_stylus(), {});
  std::mt19937 random(5);
  std::array<std::uint8_t, 64> bytes{};
  HidReading reading;
  const tests::AllocationCount allocations;
  int readings = 0;
  for (int k = 0; k < 20000; ++k) {
    for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
    bytes[0] = kPoseReport;
    // Sound ones too: bytes of a small value.
    for (int axis = 0; axis < 6 && k % 2 == 0; ++axis) bytes[4 + 4 * axis] = bytes[3 + 4 * axis] = 0;
    if (map.decode(std::span(bytes).first(random() % 8 == 0 ? random() % 64 : kPoseReportBytes), reading) ==
        Decoded::kReading) {
      ++readings;
    }
    ASSERT_TRUE(reading.position.allFinite() && reading.orientation.coeffs().allFinite());
    ASSERT_LE(reading.position.lpNorm<Eigen::Infinity>(), 1.0);
    ASSERT_NEAR(reading.orientation.norm(), 1, 1e-12);
  }
  EXPECT_EQ(allocations.value(), 0);
  EXPECT_GT(readings, 5000);
}

TEST(ForceOutput, ForcesArriveAsTheyWereSent) {
  ForceOutput output(force_stylus(), {});
  ASSERT_EQ(output.way(), ForceOutput::Way::kForceSample);
  ASSERT_EQ(output.report_count(), 1);
  EXPECT_TRUE(output.limits().renders_force);
  EXPECT_NEAR(output.limits().max_force_n, 3.3, 1e-12);
  support::Random random(7);
  std::array<std::uint8_t, 64> out{};
  const tests::AllocationCount allocations;
  for (int k = 0; k < 1000; ++k) {
    const Vector3d force = random.vector(3.2);
    const std::size_t size = output.encode(0, force, Vector3d::Zero(), out);
    ASSERT_EQ(size, kForceReportBytes);
    const auto received = unpack_force(std::span(out).first(size));
    ASSERT_TRUE(received);
    ASSERT_LT((seen(*received) - force).lpNorm<Eigen::Infinity>(), 0.51 * 3.3 / 32767);
  }
  EXPECT_EQ(allocations.value(), 0);
}

TEST(ForceOutput, StopsAtTheEndAndSendsNoNonsense) {
  const ForceOutput output(force_stylus(), {});
  std::array<std::uint8_t, 7> out{};
  const auto sent = [&](const Vector3d& force) {
    EXPECT_EQ(output.encode(0, force, Vector3d::Zero(), out), out.size());
    return seen(unpack_force(out).value());
  };
  EXPECT_LT((sent({100, -100, 1e300}) - Vector3d(3.3, -3.3, 3.3)).norm(), 1e-9);
  const double nan = std::nan("");
  EXPECT_EQ(sent({1, nan, 1}), Vector3d::Zero());
  EXPECT_EQ(sent({1, 1, std::numeric_limits<double>::infinity()}), Vector3d::Zero());
  EXPECT_EQ(output.encode(1, Vector3d::Zero(), Vector3d::Zero(), out), 0U);
  EXPECT_EQ(output.encode(0, Vector3d::Zero(), Vector3d::Zero(), std::span(out).first(6)), 0U);
}

TEST(ForceOutput, ControlsTheMotors) {
  ForceOutput output(force_stylus(), {});
  std::array<std::uint8_t, 8> out{};
  const std::pair<DeviceControl, ForceStylusControl> pairs[] = {
      {DeviceControl::kEnableActuators, ForceStylusControl::kEnableActuators},
      {DeviceControl::kDisableActuators, ForceStylusControl::kDisableActuators},
      {DeviceControl::kStopAll, ForceStylusControl::kStopAll},
      {DeviceControl::kReset, ForceStylusControl::kReset}};
  for (const auto& [asked, expected] : pairs) {
    ASSERT_EQ(output.encode(asked, out), kControlReportBytes);
    EXPECT_EQ(out[0], kControlReport);
    EXPECT_EQ(out[1], static_cast<std::uint8_t>(expected));
  }
  std::vector<std::vector<std::uint8_t>> features;
  const std::string failure = output.start({.write = [](auto) { return false; },
                                            .set_feature =
                                                [&](std::span<const std::uint8_t> bytes) {
                                                  features.emplace_back(bytes.begin(), bytes.end());
                                                  return true;
                                                },
                                            .get_feature = [](auto) { return -1; }});
  EXPECT_EQ(failure, "");
  EXPECT_THAT(features, ::testing::ElementsAre(std::vector<std::uint8_t>{kGainReport, 255}));
}

}  // namespace
}  // namespace stylet::haptic::hid
