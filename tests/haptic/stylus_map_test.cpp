#include "haptic/hid/stylus_map.h"

#include "haptic/hid/force_output.h"
#include "haptic/hid/force_stylus.h"
#include "haptic/hid/usages.h"
#include "tests/haptic/hid_corpus.h"
#include "tests/support/allocation_count.h"
#include "tests/support/random.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>
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

TEST(StylusMap, TheDocumentHasTheBytesOfTheDescriptor) {
  std::ifstream file(std::filesystem::path(STYLET_SOURCE_DIR) / "haptic" / "README.md");
  std::string line;
  while (std::getline(file, line) && line != "### Report descriptor") continue;
  while (std::getline(file, line) && line != "```") continue;
  std::vector<std::uint8_t> bytes;
  while (std::getline(file, line) && line != "```") {
    for (std::size_t k = 0; k + 1 < line.size() && std::isxdigit(static_cast<unsigned char>(line[k])) != 0; k += 3) {
      bytes.push_back(static_cast<std::uint8_t>(std::stoi(line.substr(k, 2), nullptr, 16)));
    }
  }
  EXPECT_THAT(bytes, ::testing::ElementsAreArray(kForceStylusDescriptor));
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

TEST(StylusMap, DropsIncompleteReports) {
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

TEST(StylusMap, RandomReportsNeitherAllocateNorGiveInvalidPoses) {
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

TEST(ForceOutput, StopsAtTheEndAndSendsNoInvalidForce) {
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

/// A space mouse of the two-report layout: X Y Z in report 1, Rx Ry Rz in 2, flagged relative, two buttons in 3.
ReportDescriptor two_report_mouse(std::uint8_t buttons = 2) {
  const std::vector<std::uint8_t> bytes = {
      0x05, 0x01, 0x09, 0x08, 0xA1, 0x01, 0xA1, 0x00,    0x85, 0x01, 0x16, 0xA2,
      0xFE, 0x26, 0x5E, 0x01, 0x36, 0x88, 0xFA, 0x46,    0x78, 0x05, 0x55, 0x0C,
      0x65, 0x11, 0x09, 0x30, 0x09, 0x31, 0x09, 0x32,    0x75, 0x10, 0x95, 0x03,
      0x81, 0x06, 0xC0, 0xA1, 0x00, 0x85, 0x02, 0x09,    0x33, 0x09, 0x34, 0x09,
      0x35, 0x81, 0x06, 0xC0, 0x85, 0x03, 0x05, 0x09,    0x19, 0x01, 0x29, buttons,
      0x15, 0x00, 0x25, 0x01, 0x75, 0x01, 0x95, buttons, 0x81, 0x02, 0x95, static_cast<std::uint8_t>(16 - buttons),
      0x81, 0x03, 0xC0};
  return parse_report_descriptor(bytes);
}

TEST(StylusMap, SpaceMouseGivesVelocitiesAndIsNeverSummedUp) {
  const StylusMap map(two_report_mouse(), {.full_speed_m_per_s = 0.1, .full_angular_speed_rad_per_s = 2});
  ASSERT_EQ(map.kind(), DeviceKind::kSpaceMouse) << map.reason();
  EXPECT_TRUE(map.rate_only());
  HidReading reading;
  // Pushed to the right and fully down; twice the same is no more.
  for (int k = 0; k < 2; ++k) {
    ASSERT_EQ(map.decode(std::array<std::uint8_t, 7>{1, 0xAF, 0, 0, 0, 0x5E, 1}, reading), Decoded::kReading);
    EXPECT_NEAR(reading.velocity.x(), 0.1 * (0.5 - 0.05) / 0.95, 1e-12);
    EXPECT_NEAR(reading.velocity.y(), -0.1, 1e-12);
    EXPECT_EQ(reading.velocity.z(), 0);
    EXPECT_EQ(reading.carries, kVelocity);
  }
  // Turned about the vertical, the other report: the push stays. Beyond the end is the end.
  ASSERT_EQ(map.decode(std::array<std::uint8_t, 7>{2, 0, 0, 5, 0, 0, 0xFE}, reading), Decoded::kReading);
  EXPECT_EQ(reading.angular_velocity, Vector3d(0, 2, 0));
  EXPECT_NEAR(reading.velocity.y(), -0.1, 1e-12);
  EXPECT_EQ(reading.carries, kAngularVelocity);
  ASSERT_EQ(map.decode(std::array<std::uint8_t, 3>{3, 2, 0}, reading), Decoded::kReading);
  EXPECT_EQ(reading.buttons, 2U);
  // Let go.
  ASSERT_EQ(map.decode(std::array<std::uint8_t, 7>{1}, reading), Decoded::kReading);
  EXPECT_EQ(reading.velocity, Vector3d::Zero());
}

TEST(StylusMap, AButtonIsFreeThatIsNeitherTheTriggerNorTheClutch) {
  const auto free = [](std::uint8_t buttons, std::uint32_t taken) {
    const StylusMap map(two_report_mouse(buttons), {});
    EXPECT_EQ(map.buttons(), (1U << buttons) - 1);
    return map.free_button(taken);
  };
  EXPECT_EQ(free(1, kSecondaryBarrelButton), 0);
  EXPECT_EQ(free(2, kSecondaryBarrelButton), 0);
  EXPECT_EQ(free(2, 0), 2) << "where nothing clutches";
  EXPECT_EQ(free(3, kSecondaryBarrelButton), 3);
  EXPECT_EQ(free(12, kSecondaryBarrelButton), 3);
}

/// A pen of 200 x 100 mm with null states, tilt in degrees and twist.
ReportDescriptor pen() {
  const std::vector<std::uint8_t> bytes = {
      0x05, 0x0D, 0x09, 0x02, 0xA1, 0x01, 0x85, 0x04, 0x09, 0x20, 0xA1, 0x00, 0x15, 0x00, 0x25, 0x01,
      0x75, 0x01, 0x95, 0x04, 0x09, 0x42, 0x09, 0x44, 0x09, 0x45, 0x09, 0x32, 0x81, 0x02, 0x95, 0x04,
      0x81, 0x03, 0x05, 0x01, 0x75, 0x10, 0x95, 0x01, 0x65, 0x11, 0x55, 0x0F, 0x26, 0x20, 0x4E, 0x46,
      0xC8, 0x00, 0x09, 0x30, 0x81, 0x42, 0x26, 0x10, 0x27, 0x46, 0x64, 0x00, 0x09, 0x31, 0x81, 0x42,
      0x45, 0x00, 0x65, 0x00, 0x55, 0x00, 0x05, 0x0D, 0x26, 0xFF, 0x03, 0x09, 0x30, 0x81, 0x02, 0x15,
      0xC4, 0x25, 0x3C, 0x75, 0x08, 0x95, 0x02, 0x09, 0x3D, 0x09, 0x3E, 0x81, 0x02, 0x15, 0x00, 0x26,
      0x67, 0x01, 0x65, 0x14, 0x75, 0x10, 0x95, 0x01, 0x09, 0x41, 0x81, 0x02, 0xC0, 0xC0};
  return parse_report_descriptor(bytes);
}

TEST(StylusMap, PenGivesPlacePressureAndTilt) {
  const StylusMap map(pen(), {});
  ASSERT_EQ(map.kind(), DeviceKind::kPen) << map.reason();
  EXPECT_EQ(map.free_button(0), 0) << "they draw back and take hold";
  HidReading reading;
  // X 15000 of 20000, Y 2500 of 10000, pressure 1023, tilt 30 and 0 degrees, no twist; tip down, in range.
  std::array<std::uint8_t, 12> report = {4, 0x09, 0x98, 0x3A, 0xC4, 0x09, 0xFF, 0x03, 30, 0, 0, 0};
  ASSERT_EQ(map.decode(report, reading), Decoded::kReading);
  EXPECT_LT((reading.position - Vector3d(0.05, 0, -0.025)).norm(), 1e-9);
  EXPECT_NEAR(reading.pressure, 1, 1e-12);
  EXPECT_TRUE(reading.in_range);
  EXPECT_EQ(reading.buttons, static_cast<std::uint32_t>(kTip));
  const double tilt = 30 * std::numbers::pi / 180;
  // Its upper end leans to the right, so the needle points down and to the left.
  EXPECT_LT((reading.orientation * Vector3d::UnitZ() - Vector3d(-std::sin(tilt), -std::cos(tilt), 0)).norm(), 1e-12);
  EXPECT_LT((reading.orientation * Vector3d::UnitX() - Vector3d(std::cos(tilt), -std::sin(tilt), 0)).norm(), 1e-12);

  report[8] = 0;
  report[10] = 90;  // clockwise seen from above: right becomes near
  ASSERT_EQ(map.decode(report, reading), Decoded::kReading);
  EXPECT_LT((reading.orientation * Vector3d::UnitX() - Vector3d::UnitZ()).norm(), 1e-12);

  report[5] = 0xFF;  // no Y: the pose stays, and means nothing
  report[2] = 0;
  const Vector3d before = reading.position;
  ASSERT_EQ(map.decode(report, reading), Decoded::kReading);
  EXPECT_FALSE(reading.in_range);
  EXPECT_EQ(reading.position, before);
  EXPECT_EQ(reading.carries & kPosition, 0U);
}

/// A device that knows PID effects: what start() must have made before a force moves anything.
struct PidFirmware {
  struct Effect {
    int axis = -1;
    bool constant = false;
    bool started = false;
    int magnitude = 0;
    int duration_ms = 0;
  };
  std::vector<Effect> effects{};
  int controls = 0;
  int capacity = 40;

  ReportPort port() {
    return {.write = [this](auto bytes) { return write(bytes); },
            .set_feature =
                [this](auto bytes) {
                  // Create New Effect, report 17: 1 is constant force.
                  if (bytes[0] != 17 || bytes[1] != 1) return false;
                  effects.emplace_back();
                  return true;
                },
            .get_feature =
                [this](auto bytes) {
                  if (bytes[0] != 18 || bytes.size() != 5) return -1;
                  const bool full = static_cast<int>(effects.size()) > capacity;
                  bytes[1] = static_cast<std::uint8_t>(effects.size());
                  bytes[2] = full ? 2 : 1;
                  return 5;
                }};
  }
  bool write(std::span<const std::uint8_t> bytes) {
    const auto effect = [&]() -> Effect& { return effects.at(bytes[1] - 1U); };
    switch (bytes[0]) {
      case 1:  // Set Effect
        effect().constant = bytes[2] == 1 && bytes[11] == 255;
        effect().duration_ms = bytes[3] | bytes[4] << 8;
        effect().axis = (bytes[13] & 3) == 1 ? 0 : (bytes[13] & 3) == 2 ? 1 : -1;
        return true;
      case 5:
        effect().magnitude = static_cast<std::int16_t>(bytes[2] | bytes[3] << 8);
        return true;
      case 10:
        effect().started = bytes[2] == 1;
        return true;
      case 12:
        controls |= bytes[1];
        return true;
      case 13:
        return bytes[1] == 255;
      default:
        return false;
    }
  }
};

TEST(ForceOutput, PidDevicesGetOneConstantForceForEachAxis) {
  const auto all = support::hid_descriptors();
  if (all.empty()) GTEST_SKIP() << "STYLET_TEST_DATA has no hid";
  const ReportDescriptor descriptor = parse_report_descriptor(all.at("openffboard_2axis"));
  DeviceProfile profile{.full_scale_force_n = 10};
  ForceOutput output(descriptor, profile);
  ASSERT_EQ(output.way(), ForceOutput::Way::kConstantForce);
  ASSERT_EQ(output.report_count(), 2);
  PidFirmware firmware;
  ASSERT_EQ(output.start(firmware.port()), "");
  ASSERT_EQ(firmware.effects.size(), 2U);
  EXPECT_EQ(firmware.controls, 8) << "reset, and the motors not yet enabled";
  std::array<std::uint8_t, 64> out{};
  const auto send = [&](const Vector3d& force) {
    for (int k = 0; k < output.report_count(); ++k) {
      const std::size_t size = output.encode(k, force, Vector3d::Zero(), out);
      ASSERT_TRUE(firmware.write(std::span(out).first(size)));
    }
  };
  // To the right and towards the trainee; up, where there is no axis, is left out.
  send({2, 7, -1});
  for (int axis = 0; axis < 2; ++axis) {
    EXPECT_TRUE(firmware.effects[axis].constant && firmware.effects[axis].started);
    EXPECT_EQ(firmware.effects[axis].axis, axis);
    EXPECT_EQ(firmware.effects[axis].duration_ms, 18) << "gone 20 ms after a host that dies";
    EXPECT_EQ(firmware.effects[axis].magnitude, axis == 0 ? 6553 : -3277);
  }
  EXPECT_TRUE(output.lets_go());
  ASSERT_EQ(output.renewal_count(), 2);
  for (int k = 0; k < 2; ++k) {
    firmware.effects[k].started = false;
    ASSERT_TRUE(firmware.write(output.renewal(k)));
    EXPECT_TRUE(firmware.effects[k].started);
  }
  EXPECT_LT(output.renew_s(), 0.018 / 2) << "one may be late";
  send({50, 0, std::nan("")});
  EXPECT_EQ(firmware.effects[0].magnitude, 0);
  const std::size_t size = output.encode(DeviceControl::kEnableActuators, out);
  ASSERT_TRUE(firmware.write(std::span(out).first(size)));
  EXPECT_EQ(firmware.controls, 9);

  PidFirmware full{.capacity = 1};
  EXPECT_EQ(output.start(full.port()), "the device has no room for an effect (PID Block Load)");
}

TEST(StylusMap, EveryDescriptorGetsAKindOrAReason) {
  const auto all = support::hid_descriptors();
  if (all.empty()) GTEST_SKIP() << "STYLET_TEST_DATA has no hid";
  std::map<DeviceKind, int> kinds;
  std::mt19937 random(11);
  for (const auto& [name, bytes] : all) {
    const ReportDescriptor descriptor = parse_report_descriptor(bytes);
    const StylusMap map(descriptor, {});
    const ForceOutput output(descriptor, {});
    ++kinds[map.kind()];
    EXPECT_EQ(map.usable(), map.reason().empty()) << name;
    EXPECT_EQ(map.reason().find('\n'), std::string::npos) << name;
    // Random reports of the right length give finite readings.
    HidReading reading;
    for (int k = 0; k < 200; ++k) {
      const Report& report = descriptor.reports[random() % descriptor.reports.size()];
      std::vector<std::uint8_t> data(report.bytes());
      for (auto& byte : data) byte = static_cast<std::uint8_t>(random());
      if (report.id != 0) data[0] = report.id;
      map.decode(data, reading);
      ASSERT_TRUE(reading.position.allFinite() && reading.velocity.allFinite()) << name;
      ASSERT_NEAR(reading.orientation.norm(), 1, 1e-9) << name;
      ASSERT_LE(reading.position.norm(), 2) << name;
      ASSERT_LE(reading.velocity.norm(), 0.09) << name;
      ASSERT_TRUE(reading.pressure >= 0 && reading.pressure <= 1) << name;
    }
  }
  const auto kind = [&](const char* name) { return kind_of(parse_report_descriptor(all.at(name))); };
  EXPECT_EQ(kind("3dconnexion_spacemouse_pro"), DeviceKind::kSpaceMouse);
  EXPECT_EQ(kind("proto_haptic_stylus"), DeviceKind::kStylus);
  EXPECT_EQ(kind("hidtools_wacom_pth660_v145"), DeviceKind::kPen) << "Wacom's own page";
  EXPECT_EQ(kind("dell_xps_13_9315_2-in-1_056a_49bc"), DeviceKind::kPen) << "beside a touch screen and a mouse";
  EXPECT_EQ(kind("openffboard_1axis"), DeviceKind::kJoystick);
  EXPECT_EQ(kind("kensington_slimblade"), DeviceKind::kUnusable);
  EXPECT_EQ(kind("microsoft_surface_3_045e_07df"), DeviceKind::kUnusable);
  for (const auto& [k, count] : kinds) std::printf("%d %s, ", count, name_of(k));
  std::printf("of %zu\n", all.size());
}

}  // namespace
}  // namespace stylet::haptic::hid
