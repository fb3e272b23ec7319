// The commands as somebody with an Inverse3 runs them.
#include "engine/readers/motion.h"
#include "engine/recording/recording.h"
#include "tests/stylet/command.h"
#include "tests/support/haply/haply_server.h"
#include "tests/support/temporary_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Geometry>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

namespace stylet {
namespace {

using Eigen::Vector3d;
using support::HaplyHand;
using support::HaplyServer;
using support::HaplyService;
using ::testing::HasSubstr;

class HaplyCommand : public testing::Test {
protected:
  HaplyCommand() {
    setenv("STYLET_HAPLY", ("127.0.0.1:" + server.port()).c_str(), 1);
    setenv("XDG_CONFIG_HOME", folder.path().c_str(), 1);
  }
  ~HaplyCommand() override {
    unsetenv("STYLET_HAPLY");
    unsetenv("XDG_CONFIG_HOME");
  }

  support::TemporaryFolder folder;
  HaplyServer server;
};

TEST_F(HaplyCommand, DevicesSayWhatItIsAndWhatItNeeds) {
  server.with_service([](HaplyService& s) { s.powered = false; });
  const std::string said = run("devices").output;
  EXPECT_THAT(said, HasSubstr("haply:049D/6F21  16c0:0483  Haply Inverse3 (Haply)"));
  EXPECT_THAT(said, HasSubstr("stylus with force; profile \"Haply Inverse3\""));
  EXPECT_THAT(said, HasSubstr("workspace  300 x 300 x 300 mm"));
  EXPECT_THAT(said, HasSubstr("limits     10 N, 2.5 N for ever"));
  EXPECT_THAT(said, HasSubstr("state      its motors have no power: plug in its power supply"));
}

TEST_F(HaplyCommand, ARecordingHoldsTheHand) {
  server.with_service([](HaplyService& s) {
    s.motion = [](double t) { return HaplyHand{.position = {0, 0, -0.02 * std::min(t, 1.0)}}; };
  });
  const fs::path file = folder.path() / "hand.json";
  const Outcome said = run(fmt::format("devices --record '{}' --seconds 1.5 haply:049D", file.string()));
  ASSERT_EQ(said.exit_code, 0) << said.output;
  readers::RawReports raw;
  const content::Motion motion = readers::read_motion(file, &raw);
  ASSERT_GT(motion.stylus.size(), 20u);
  EXPECT_LT(motion.stylus.back().pose.position.y(), motion.stylus.front().pose.position.y() - 0.005)
      << "down is down";
  EXPECT_GT(raw.reports.size(), 20u);
  EXPECT_EQ(server.with_service([](HaplyService& s) { return s.forces(); }), 0u) << "its motors stay off";
  EXPECT_EQ(
      run(fmt::format(
              "train tutorial --view headless --expert none --no-film --device 'recorded:{}' --seconds 1 --out '{}'",
              file.string(), (folder.path() / "again").string()))
          .exit_code,
      0);
}

TEST_F(HaplyCommand, CalibrationGuidesTheHandAndIsRead) {
  // Each place takes 0.8 s, as fast as the hand is asked: places are apart, and the last one lasts.
  server.with_service([](HaplyService& s) {
    s.motion = [](double t) {
      static const std::array<Vector3d, 5> kPlaces{Vector3d(0, 0, 0.04), Vector3d(-0.05, -0.04, 0),
                                                   Vector3d(0.05, -0.04, 0), Vector3d(0.05, 0.04, 0),
                                                   Vector3d(-0.05, 0.04, 0)};
      const auto at = std::min(kPlaces.size() - 1, static_cast<std::size_t>(t / 0.8));
      const double way = std::min(1.0, (t - 0.8 * static_cast<double>(at)) / 0.2);
      return HaplyHand{.position =
                           kPlaces[at == 0 ? 0 : at - 1] + way * (kPlaces[at] - kPlaces[at == 0 ? 0 : at - 1])};
    };
  });
  Outcome said;
  for (int k = 0; k < 3; ++k) {  // a busy machine misses a place
    server.with_service([](HaplyService& s) { s.begin_again(); });
    said = run("devices --calibrate --hold 0.25 haply");
    if (said.exit_code == 0) break;
  }
  ASSERT_EQ(said.exit_code, 0) << said.output;
  const fs::path file = folder.path() / "stylet/devices/16c0-0483-049D-6F21.json";
  const auto calibration = nlohmann::json::parse(read_text(file));
  EXPECT_NEAR(calibration["rest_mm"][1].get<double>(), 40, 1) << "up is up";
  EXPECT_THAT(run("devices").output, HasSubstr("calibrated " + file.string()));
}

TEST_F(HaplyCommand, TrainIsLedByItAndFeelsTheNeedle) {
  server.with_service([](HaplyService& s) {
    s.motion = [](double t) { return HaplyHand{.position = {0, 0, -0.02 * std::min(t, 3.0)}}; };
  });
  const fs::path out = folder.path() / "session";
  const Outcome said = run(fmt::format(
      "train tutorial --view headless --expert none --no-film --device haply --seconds 3 --out '{}'", out.string()));
  ASSERT_EQ(said.exit_code, 0) << said.output;
  EXPECT_THAT(said.output, HasSubstr("Haply Inverse3"));
  EXPECT_THAT(said.output, HasSubstr("its force may stay on if this computer stops"));
  EXPECT_GT(server.with_service([](HaplyService& s) { return s.messages(); }), 100u);
  EXPECT_EQ(server.with_service([](HaplyService& s) { return s.nonsense(); }), 0u);
  EXPECT_EQ(server.with_service([](HaplyService& s) { return s.applied(HaplyServer::now_ns()).norm(); }), 0);
}

TEST_F(HaplyCommand, InTheOtherHandItLeadsTheProbe) {
  server.with_service([](HaplyService&
                             s) {  // to and fro, half a second at rest at each end: whenever a session begins
    s.motion = [](double t) {
      return HaplyHand{.position = {0.008 * std::clamp(1.5 - std::abs(2 * std::fmod(t, 2.0) - 2), 0.0, 1.0), 0, 0}};
    };
  });
  const auto probe_range = [&](const std::string& more, const std::string& name) {
    const fs::path out = folder.path() / name;
    const Outcome said = run(fmt::format(
        "train tutorial --view headless --expert none --no-film --device recorded --seconds 3 {} --out '{}'", more,
        out.string()));
    EXPECT_EQ(said.exit_code, 0) << said.output;
    const auto session = nlohmann::json::parse(read_text(out / "session.json"));
    EXPECT_TRUE(session["replay"]["identical"]) << name;
    const recording::Recording recorded = recording::read_recording(out / "session.rec");
    Eigen::AlignedBox3d range;
    for (const auto& step : recorded.simulation) range.extend(step.probe.position);
    return range.diagonal().norm();
  };
  EXPECT_LT(probe_range("", "alone"), 1e-9);
  EXPECT_NEAR(probe_range("--probe-device haply", "led"), 0.008, 0.001);
  const Eigen::Vector3d strongest = server.with_service([](HaplyService& s) { return s.strongest(); });
  EXPECT_LT(strongest.head<2>().norm(), 0.05) << "along the probe only: " << strongest.transpose();
  const Outcome said = run("train tutorial --view headless --lockstep --device recorded --probe-device haply");
  EXPECT_EQ(said.exit_code, 2);
  EXPECT_THAT(said.output, HasSubstr("leave one of --lockstep and --probe-device out"));
}

TEST_F(HaplyCommand, InTheOtherHandTheSkinPushesTheProbeUp) {
  server.with_service([](HaplyService& s) {  // lifted and pressed again and again, at rest above and below
    s.motion = [](double t) {
      return HaplyHand{
          .position = {0, 0, 0.01 - 0.025 * std::clamp(2 - std::abs(2 * std::fmod(t, 3.0) - 3), 0.0, 1.0)}};
    };
  });
  const fs::path out = folder.path() / "felt";
  const Outcome said =
      run(fmt::format("train tutorial --view headless --expert none --no-film --device recorded --seconds 7 "
                      "--probe-device haply --out '{}'",
                      out.string()));
  ASSERT_EQ(said.exit_code, 0) << said.output;
  EXPECT_THAT(said.output, HasSubstr("you feel the skin"));
  EXPECT_THAT(said.output, HasSubstr("its force may stay on"));
  const Eigen::Vector3d strongest = server.with_service([](HaplyService& s) { return s.strongest(); });
  EXPECT_GT(strongest.z(), 0.3);
  EXPECT_LT(strongest.head<2>().norm(), 0.3 * strongest.z());
  EXPECT_EQ(server.with_service([](HaplyService& s) { return s.applied(HaplyServer::now_ns()).norm(); }), 0);
  const recording::Recording recorded = recording::read_recording(out / "session.rec");
  ASSERT_FALSE(recorded.simulation.empty());
}

TEST_F(HaplyCommand, WhatTheOtherHandsDeviceNeedsIsSaid) {
  server.with_service([](HaplyService& s) { s.powered = false; });
  const Outcome said =
      run(fmt::format("train tutorial --view headless --expert none --no-film --device recorded --seconds 2 "
                      "--probe-device haply --out '{}'",
                      (folder.path() / "needs").string()));
  ASSERT_EQ(said.exit_code, 0) << said.output;
  EXPECT_THAT(said.output, HasSubstr("its motors have no power: plug in its power supply"));
}

TEST_F(HaplyCommand, OneArmDoesNotLeadBoth) {
  server.with_service([](HaplyService& s) { s.second_grip = true; });
  const Outcome said =
      run(fmt::format("train tutorial --view headless --expert none --no-film --device haply --probe-device haply "
                      "--seconds 1 --out '{}'",
                      (folder.path() / "both").string()));
  EXPECT_NE(said.exit_code, 0);
  EXPECT_THAT(said.output, HasSubstr("haply:049D/7A00: leads the needle"));
}

TEST_F(HaplyCommand, ItsForceMayStayOnIsSaid) {
  EXPECT_THAT(run("devices").output, HasSubstr("its force may stay on if this computer stops"));
}

TEST_F(HaplyCommand, ItIsFeltWithoutAPatient) {
  server.with_service([](HaplyService& s) {
    s.motion = [](double t) { return HaplyHand{.position = {0, 0, -0.02 * (1 - std::cos(4 * t))}}; };
    s.gives = 0.4;
  });
  const Outcome said = run("devices --feel --each 2 haply");
  EXPECT_THAT(said.output, HasSubstr("its force may stay on if this computer stops"));
  ASSERT_EQ(said.exit_code, 0) << said.output;
  for (const char* words : {"1 of 4: a spring", "2 of 4: a wall", "3 of 4: friction", "4 of 4: a skin"}) {
    EXPECT_THAT(said.output, HasSubstr(words));
  }
  EXPECT_THAT(said.output, HasSubstr("the device says that it gave up to"));
  EXPECT_THAT(said.output, HasSubstr(": its own settings or warm motors hold it back"));
  EXPECT_GT(server.with_service([](HaplyService& s) { return s.largest(); }), 1);
  EXPECT_EQ(server.with_service([](HaplyService& s) { return s.applied(HaplyServer::now_ns()).norm(); }), 0);
}

TEST_F(HaplyCommand, WithoutAServiceItIsSaidWhatToDo) {
  setenv("STYLET_HAPLY", "127.0.0.1:1", 1);
  const Outcome said = run("train tutorial --view headless --expert none --no-film --device haply --seconds 1");
  EXPECT_EQ(said.exit_code, 2) << said.output;
  EXPECT_THAT(said.output, HasSubstr("--device haply: 127.0.0.1:1: the Haply Inverse Service does not answer"));
  EXPECT_EQ(said.lines(), 1) << said.output;
}

}  // namespace
}  // namespace stylet
