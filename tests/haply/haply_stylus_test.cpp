// The same through sockets and threads: what is asserted happens, however long the machine takes.
#include "engine/readers/device_profile_file.h"
#include "haptic/haply/haply_transport.h"
#include "haptic/hid/hid_stylus.h"
#include "tests/support/haply/haply_server.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

namespace stylet::haptic::haply {
namespace {

using Eigen::Vector3d;
using support::HaplyHand;
using support::HaplyServer;
using support::HaplyService;
using ::testing::HasSubstr;
using Trouble = HaplyServer::Trouble;

class HaplyStylus : public testing::Test {
protected:
  void open() {
    const auto devices = source.list();
    ASSERT_EQ(devices.size(), 1u) << source.missing();
    stylus = std::make_unique<hid::HidStylus>(
        hid::HidStylusSettings{.device = devices[0], .source = &source, .fifo_priority = 0, .retry_s = 0.02});
  }
  bool step_until(const std::function<bool()>& done) {
    for (int k = 0; k < 60'000; ++k) {
      sample = stylus->read(0);
      stylus->write(sample.valid ? force : Vector3d::Zero(), Vector3d::Zero());
      if (done()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
  }
  double applied() {
    return server.with_service([](HaplyService& s) { return s.applied(HaplyServer::now_ns()).norm(); });
  }

  HaplyServer server;
  HaplySource source{{.host = "127.0.0.1", .port = server.port()}};
  Vector3d force{0, 1, 0};
  StylusSample sample;
  std::unique_ptr<hid::HidStylus> stylus;
};

TEST_F(HaplyStylus, IsListedWithItsState) {
  const auto devices = source.list();
  ASSERT_EQ(devices.size(), 1u);
  EXPECT_EQ(devices[0].path, "haply:049D/6F21");
  EXPECT_EQ(devices[0].product, "Haply Inverse3");
  EXPECT_EQ(devices[0].serial_number, "049D-6F21");
  EXPECT_EQ(devices[0].state, "ready");
  server.with_service([](HaplyService& s) { s.powered = false; });
  EXPECT_THAT(source.list().at(0).state, HasSubstr("power supply"));
  server.set(Trouble::kNoInventory);
  EXPECT_EQ(source.list().size(), 1u) << "asked for it says what it has";
}

TEST_F(HaplyStylus, ItsProfileHasItsLimits) {
  const auto devices = source.list();
  ASSERT_EQ(devices.size(), 1u);
  const auto profile = readers::choose_profile(readers::load_device_profiles(),
                                               {devices[0].vendor_id, devices[0].product_id, devices[0].product},
                                               hid::DeviceKind::kStylus);
  EXPECT_EQ(profile.name, "Haply Inverse3");
  ASSERT_TRUE(profile.limits);
  EXPECT_LE(profile.limits->max_force_n, kMostForce);
  const auto small = readers::choose_profile(readers::load_device_profiles(),
                                             {devices[0].vendor_id, devices[0].product_id, "Haply Minverse"},
                                             hid::DeviceKind::kStylus);
  EXPECT_EQ(small.name, "Haply Minverse");
  EXPECT_LE(profile.limits->continuous_force_n, profile.limits->max_force_n / 4 + 1e-9);
  // Its grip points away from the user where the service calls its rotation none.
  EXPECT_TRUE(profile.device_from_needle_at_rest.col(2).isApprox(Vector3d(0, 0, -1)));
  EXPECT_NEAR(profile.device_from_needle_at_rest.determinant(), 1, 1e-12);
}

TEST_F(HaplyStylus, PosesComeInAndForcesGoOut) {
  server.with_service([](HaplyService& s) {
    s.motion = [](double t) { return HaplyHand{.position = {0.01 * t, 0, 0}}; };
  });
  open();
  EXPECT_EQ(stylus->kind(), hid::DeviceKind::kStylus);
  EXPECT_TRUE(stylus->limits().renders_force);
  ASSERT_TRUE(step_until([&] { return sample.valid && sample.position.x() > 0.002; }));
  // Up is the service's Z.
  ASSERT_TRUE(step_until([&] {
    return server.with_service(
        [](HaplyService& s) { return (s.applied(HaplyServer::now_ns()) - Vector3d(0, 0, 1)).norm() < 1e-3; });
  }));
  EXPECT_EQ(stylus->counters().force.failed, 0u);
}

TEST_F(HaplyStylus, WhatItNeedsIsSaidInASession) {
  server.with_service([](HaplyService& s) { s.powered = false; });
  open();
  ASSERT_TRUE(step_until([this] { return stylus->status().needs.find("power supply") != std::string::npos; }));
  server.with_service([](HaplyService& s) { s.powered = true; });
  EXPECT_TRUE(step_until([this] { return stylus->status().needs.empty(); }));
}

TEST_F(HaplyStylus, WhatTheServiceCommandedIsToldInThePatientsFrame) {
  open();
  force = {0.2, 1, 0.4};
  ASSERT_TRUE(step_until([this] {
    const auto told = stylus->told_force();
    return told && (*told - force).norm() < 0.01;
  }));
}

TEST_F(HaplyStylus, EndsWithZeroForce) {
  server.with_service([](HaplyService& s) { s.keeps_force = true; });
  open();
  ASSERT_TRUE(step_until([&] { return applied() > 0.9; }));
  stylus.reset();
  EXPECT_EQ(applied(), 0);
  EXPECT_EQ(server.with_service([](HaplyService& s) { return s.nonsense(); }), 0u);
}

TEST_F(HaplyStylus, AConnectionThatIsGivenUpLeavesNoForce) {
  server.with_service([](HaplyService& s) { s.keeps_force = true; });
  HaplyTransport transport({.host = "127.0.0.1", .port = server.port()}, {});
  const std::array<std::uint8_t, 2> enable{hid::kControlReport, 1};
  const std::array<std::uint8_t, 7> push{hid::kForceReport, 0, 0, 0, 0, 0, 0x10};  // 1.5 N
  const auto push_until = [&](const std::function<bool()>& done) {
    for (int k = 0; k < 60'000; ++k) {
      transport.write(enable);
      transport.write(push);
      if (done()) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
    return false;
  };
  ASSERT_TRUE(push_until([&] { return applied() > 1; }));
  server.set(Trouble::kMany);
  ASSERT_TRUE(push_until([&] { return !transport.failed().empty(); }));
  EXPECT_TRUE(push_until([&] { return applied() == 0; })) << "before it is destroyed";
}

TEST_F(HaplyStylus, ASourceThatCannotListIsAskedAgain) {
  struct Failing final : hid::DeviceSource {
    explicit Failing(const HaplySource& asked) : other(asked) {}
    std::vector<hid::HidDeviceSummary> list() const override {
      if (failures > 0 && failures-- > 0) throw std::runtime_error("no descriptors");
      return other.list();
    }
    std::string missing() const override { return other.missing(); }
    std::vector<std::uint8_t> descriptor(const std::string& path) const override { return other.descriptor(path); }
    std::unique_ptr<hid::ReportTransport> open(const std::string& path) const override { return other.open(path); }
    const HaplySource& other;
    mutable std::atomic<int> failures{0};
  } failing(source);
  const auto devices = source.list();
  ASSERT_EQ(devices.size(), 1u);
  stylus = std::make_unique<hid::HidStylus>(
      hid::HidStylusSettings{.device = devices[0], .source = &failing, .fifo_priority = 0, .retry_s = 0.02});
  ASSERT_TRUE(step_until([&] { return sample.valid; }));
  failing.failures = 2;
  server.set(Trouble::kReset);
  ASSERT_TRUE(step_until([&] { return failing.failures == 0; }));
  EXPECT_TRUE(step_until([&] { return sample.valid; }));
  stylus.reset();
}

TEST_F(HaplyStylus, ALoopThatStopsLeavesNoForce) {
  open();
  ASSERT_TRUE(step_until([&] { return applied() > 0.9; }));
  for (int k = 0; k < 60'000 && applied() > 0; ++k) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  EXPECT_EQ(applied(), 0);
  EXPECT_TRUE(stylus->connected());
}

TEST_F(HaplyStylus, WhateverTheServiceDoesItIsFoundAgain) {
  open();
  for (const Trouble trouble : {Trouble::kReset, Trouble::kClose, Trouble::kGarbage, Trouble::kBinary, Trouble::kHuge,
                                Trouble::kBadUtf8, Trouble::kTwice, Trouble::kFragments, Trouble::kPings}) {
    ASSERT_TRUE(step_until([&] { return applied() > 0.9; })) << static_cast<int>(trouble);
    server.set(trouble);
    ASSERT_TRUE(step_until([&] { return server.trouble() == Trouble::kNone; }));
  }
  EXPECT_TRUE(step_until([&] { return applied() > 0.9; }));
}

TEST_F(HaplyStylus, AStallEndsTheSamplesAndTheConnection) {
  open();
  ASSERT_TRUE(step_until([&] { return applied() > 0.9; }));
  server.set(Trouble::kStall);
  ASSERT_TRUE(step_until([&] { return !sample.valid; }));
  ASSERT_TRUE(step_until([&] { return !stylus->connected(); }));
  server.set(Trouble::kNone);
  EXPECT_TRUE(step_until([&] { return applied() > 0.9; }));
}

TEST_F(HaplyStylus, AnArmThatIsPulledOutComesBack) {
  open();
  ASSERT_TRUE(step_until([&] { return applied() > 0.9; }));
  server.with_service([](HaplyService& s) { s.vanished = true; });
  ASSERT_TRUE(step_until([&] { return !stylus->connected(); }));
  EXPECT_FALSE(sample.valid);
  server.with_service([](HaplyService& s) { s.vanished = false; });
  EXPECT_TRUE(step_until([&] { return applied() > 0.9; }));
}

TEST_F(HaplyStylus, WithoutAServiceItIsSaidWhatToDo) {
  const HaplySource nowhere({.host = "127.0.0.1", .port = "1"});
  EXPECT_TRUE(nowhere.list().empty());
  EXPECT_THAT(nowhere.missing(), HasSubstr("install and start it"));
  EXPECT_THROW((void)nowhere.open("haply:049D"), hid::HidError);
  server.set(Trouble::kRefuse);
  EXPECT_TRUE(source.list().empty()) << "it serves somebody else";
  server.with_service([](HaplyService& s) { s.other_schema = true; });
  EXPECT_TRUE(source.list().empty());
  EXPECT_THAT(source.missing(), HasSubstr("update the service"));
}

}  // namespace
}  // namespace stylet::haptic::haply
