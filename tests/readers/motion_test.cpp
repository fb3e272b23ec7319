#include "engine/readers/motion.h"

#include "tests/gltf/glb.h"
#include "tests/support/temporary_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stylet::readers {
namespace {

using ::testing::HasSubstr;

std::string motion_error(const std::string& stylus) {
  support::TemporaryFolder folder;
  const auto path =
      folder.write("m.json", R"({"format": "stylet-motion", "version": 1, "tracks": {"stylus": )" + stylus + "}}");
  try {
    read_motion(path);
  } catch (const files::ContentError& error) {
    return error.what();
  }
  return "no error";
}

TEST(Motion, WhatIsWrittenIsReadBack) {
  content::Motion motion;
  for (int i = 0; i < 50; ++i) {
    const double t = 0.004 * i;
    const Eigen::Quaterniond q(Eigen::AngleAxisd(0.3 * t, Eigen::Vector3d(1, 2, 3).normalized()));
    motion.stylus.push_back({t, {{0.1 * t, -0.2, t * t}, q}, i > 30 ? 1u : 0u});
    motion.probe.push_back({t, {{0, 0.01 * t, 0}, Eigen::Quaterniond::Identity()}, 0});
  }
  support::TemporaryFolder folder;
  write_motion(motion, "a \"name\"", folder.path() / "m.json");
  const content::Motion back = read_motion(folder.path() / "m.json");
  ASSERT_EQ(back.stylus.size(), motion.stylus.size());
  ASSERT_EQ(back.probe.size(), motion.probe.size());
  for (std::size_t i = 0; i < motion.stylus.size(); ++i) {
    EXPECT_NEAR(back.stylus[i].time_s, motion.stylus[i].time_s, 1e-6);
    EXPECT_LT((back.stylus[i].pose.position - motion.stylus[i].pose.position).norm(), 1e-6);
    EXPECT_LT(back.stylus[i].pose.orientation.angularDistance(motion.stylus[i].pose.orientation), 4e-6);
    EXPECT_NEAR(back.stylus[i].pose.orientation.norm(), 1, 1e-12);
    EXPECT_EQ(back.stylus[i].buttons, motion.stylus[i].buttons);
  }
}

TEST(Motion, RawReportsAndTheirDeviceAreReadBack) {
  content::Motion motion;
  motion.stylus = {{0, {{0, 0, 0}, Eigen::Quaterniond::Identity()}, 0},
                   {1, {{1e-7, 0, 0}, Eigen::Quaterniond::Identity()}, 0}};
  const RawReports raw{
      .device = "A stylus",
      .report_descriptor = {0x05, 0x01},
      .reports = {{0.001, {1, 0xFF, 0}}, {0.001, {9}}, {0.002, std::vector<std::uint8_t>(16384, 7)}}};
  support::TemporaryFolder folder;
  write_motion(motion, "raw", folder.path() / "m.json", 9, raw);
  RawReports back;
  const content::Motion poses = read_motion(folder.path() / "m.json", &back);
  EXPECT_EQ(poses.stylus[1].pose.position.x(), 1e-7);
  EXPECT_EQ(back.device, raw.device);
  EXPECT_EQ(back.report_descriptor, raw.report_descriptor);
  ASSERT_EQ(back.reports.size(), 3u);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(back.reports[i].time_s, raw.reports[i].time_s, 1e-9);
    EXPECT_EQ(back.reports[i].bytes, raw.reports[i].bytes);
  }
}

TEST(Motion, HandOfNoPatientIsForSessionsOnly) {
  content::Motion motion;
  motion.stylus = {{0, {{0, 0, 0}, Eigen::Quaterniond::Identity()}, 0},
                   {1, {{0.1, 0, 0}, Eigen::Quaterniond::Identity()}, 0}};
  support::TemporaryFolder folder;
  const auto file = folder.path() / "m.json";
  for (const MotionFrame frame : {MotionFrame::kHand, MotionFrame::kTablet}) {
    write_motion(motion, "hand", file, 9, {.frame = frame});
    RawReports raw;
    EXPECT_EQ(read_motion(file, &raw).stylus.size(), 2u);
    EXPECT_EQ(raw.frame, frame);
    try {
      read_motion(file);
      ADD_FAILURE() << "a scenario took it";
    } catch (const files::ContentError& error) {
      EXPECT_NE(std::string(error.what()).find("/frame: is the hand's"), std::string::npos) << error.what();
    }
  }
}

TEST(Motion, BadReportsAreRefusedAtTheirPlace) {
  const auto error = [](const std::string& reports) {
    return motion_error("[[0,0,0,0,1,0,0,0], [1,0,0,0,1,0,0,0]], \"reports\": " + reports);
  };
  EXPECT_THAT(error("[[0, \"01\"], [-1, \"01\"]]"), HasSubstr("/tracks/reports/1: time -1 s comes before 0 s"));
  EXPECT_THAT(error("[[0, \"1\"]]"), HasSubstr("/tracks/reports/0: report is not 1 to 16384 bytes"));
  EXPECT_THAT(error("[[0, \"0x\"]]"), HasSubstr("/tracks/reports/0: report is not 1 to 16384 bytes"));
  EXPECT_THAT(error("[[0, \"\"]]"), HasSubstr("/tracks/reports/0: report is not 1 to 16384 bytes"));
  EXPECT_THAT(error("[[0]]"), HasSubstr("/tracks/reports/0: is not [t, "));
  EXPECT_EQ(error("[[0, \"01fF\"], [0, \"02\"]]"), "no error");
}

TEST(Motion, SamplingIsExactAtSamplesLinearBetweenAndHeldOutside) {
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(1, Eigen::Vector3d::UnitX()));
  const std::vector<content::MotionSample> track{{1, {{0, 0, 0}, Eigen::Quaterniond::Identity()}, 3},
                                                 {2, {{1, 0, 2}, turn}, 4}};
  EXPECT_EQ(sample_motion(track, 0).pose.position, track[0].pose.position);
  EXPECT_EQ(sample_motion(track, 9).pose.position, track[1].pose.position);
  EXPECT_EQ(sample_motion(track, 9).buttons, 4u);
  const content::MotionSample quarter = sample_motion(track, 1.25);
  EXPECT_LT((quarter.pose.position - Eigen::Vector3d(0.25, 0, 0.5)).norm(), 1e-15);
  EXPECT_NEAR(Eigen::AngleAxisd(quarter.pose.orientation).angle(), 0.25, 1e-12);
  EXPECT_EQ(quarter.buttons, 3u);
}

TEST(Motion, BadSamplesAreRefusedAtTheirPlace) {
  EXPECT_THAT(motion_error("[[0,0,0,0,1,0,0,0], [0,0,0,0,1,0,0,0]]"),
              HasSubstr("m.json:/tracks/stylus/1: time 0 s does not come after 0 s"));
  EXPECT_THAT(motion_error("[[0,0,0,0,1,0,0,0], [1,0,0,0,1,0.1,0,0]]"),
              HasSubstr("m.json:/tracks/stylus/1: quaternion has norm 1.005"));
  EXPECT_THAT(motion_error("[[0,0,0,0,1,0,0,0], [1,0,0,0,1,0,0]]"), HasSubstr("/tracks/stylus/1: is not [t, px"));
  EXPECT_THAT(motion_error("[[0,0,0,0,1,0,0,0], [1,\"a\",0,0,1,0,0,0]]"),
              HasSubstr("/tracks/stylus/1: holds something"));
  EXPECT_THAT(motion_error("[[-1,0,0,0,1,0,0,0], [1,0,0,0,1,0,0,0]]"), HasSubstr("/tracks/stylus/0: time is -1 s"));
  EXPECT_THAT(motion_error("[[0,0,0,0,1,0,0,0], [1,0,1e6,0,1,0,0,0]]"),
              HasSubstr("/tracks/stylus/1: position is farther"));
  EXPECT_THAT(motion_error("[[0,0,0,0,1,0,0,0], [1,0,0,0,1,0,0,0,0.5]]"), HasSubstr("/tracks/stylus/1: buttons"));
  EXPECT_THAT(motion_error("[[0,0,0,0,1,0,0,0]]"), HasSubstr("/tracks/stylus: has fewer than 2 samples"));
  EXPECT_THAT(motion_error("{}"), HasSubstr("/tracks/stylus: is an object, expected an array"));
  EXPECT_EQ(motion_error("[[0,0,0,0,1,0,0,0], [1,0,0,0,1.0005,0,0,0]]"), "no error")
      << "within 1e-3 of a unit quaternion";
}

}  // namespace
}  // namespace stylet::readers
