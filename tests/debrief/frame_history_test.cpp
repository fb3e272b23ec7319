#include "engine/debrief/frame_history.h"

#include "engine/debrief/session_replay.h"
#include "engine/debrief/still_moment.h"
#include "engine/session/frame_clock.h"
#include "engine/session/live_session.h"
#include "engine/session/recorded_stylus.h"
#include "engine/state/biopsy_shot.h"
#include "tests/session/cube_scene.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <cmath>

namespace stylet::debrief {
namespace {

state::FrameState rest() {
  state::FrameState frame;
  frame.bodies = {{{0, 0, 0}, {0.1F, 0, 0}}, {{0, 0.2F, 0}}};
  frame.needle_positions = {{0, 0, 0.1F}, {0, 0, 0}};
  frame.needle_orientations = {Eigen::Quaternionf::Identity(), Eigen::Quaternionf::Identity()};
  frame.targets.resize(1);
  return frame;
}

// Everything moves along a line, so that what lies between two frames is known.
state::FrameState frame_at(double time_s) {
  state::FrameState frame = rest();
  const auto t = static_cast<float>(time_s);
  frame.time_s = time_s;
  frame.bodies[0][1] += Eigen::Vector3f(0.02F * t, 0, -0.01F * t);
  frame.bodies[1][0] += Eigen::Vector3f(0, -0.03F * t, 0);
  frame.needle_positions[1].z() = -0.05F * t;
  frame.insertion_depth = 0.05F * t;
  frame.force.z() = 2 * t;
  return frame;
}

TEST(FrameHistory, SeeksToAnyTimeAndInterpolates) {
  FrameHistory history(rest());
  state::FrameState out = history.make_frame();
  EXPECT_FALSE(history.sample(0, out));
  for (int k = 0; k <= 10; ++k) history.add(frame_at(0.1 * k));
  for (const double time_s : {0.95, 0.0, 0.5, 0.123, 1.0}) {  // back and forth
    ASSERT_TRUE(history.sample(time_s, out));
    const state::FrameState expected = frame_at(time_s);
    EXPECT_NEAR(out.time_s, time_s, 1e-12);
    for (std::size_t b = 0; b < 2; ++b) {
      for (std::size_t i = 0; i < out.bodies[b].size(); ++i) {
        EXPECT_LT((out.bodies[b][i] - expected.bodies[b][i]).norm(), 1e-6F) << "30 mm in 16 bits are 0.5 um";
      }
    }
    EXPECT_NEAR(out.needle_positions[1].z(), expected.needle_positions[1].z(), 1e-7);
    EXPECT_NEAR(out.insertion_depth, expected.insertion_depth, 1e-7);
    EXPECT_NEAR(out.force.z(), expected.force.z(), 1e-6);
  }
  history.sample(7, out);
  EXPECT_EQ(out.time_s, 1.0) << "held after the end";
}

// The tip comes to the target at 3 s, a core is taken at 4 s, the heating ends at 6 s of 8.
TEST(StillMoment, IsTheEndOfTheHeatingElseTheCoreElseTheClosest) {
  FrameHistory history(rest());
  for (int k = 0; k <= 400; ++k) {
    state::FrameState frame = frame_at(0.02 * k);
    frame.targets[0].distance = static_cast<float>(std::abs(frame.time_s - 3));
    history.add(frame);
  }
  const recording::EventRecord core{4, 4000, "biopsy_fired"}, started{5, 5000, "ablation_started"},
      stopped{6, 6000, "ablation_stopped"};
  const auto moment = [&](std::vector<recording::EventRecord> events, double from_s = 0, double to_s = 100) {
    return still_moment(events, history, from_s, to_s);
  };
  EXPECT_NEAR(moment({}).time_s, 3, 0.011);
  EXPECT_NEAR(moment({}, 3.5, 7).time_s, 3.5, 1e-9) << "of the span";
  EXPECT_GT(moment({core}).time_s, 4 + state::ShotTimes::kShoots) << "the stylet is out";
  EXPECT_LT(moment({core}).time_s, 4 + state::ShotTimes::kCannulaFollows) << "its notch is seen";
  EXPECT_EQ(moment({core}, 0, 4.01).time_s, 4.01);
  EXPECT_NEAR(moment({core}, 0, 3.9).time_s, 3, 0.011) << "not yet";
  EXPECT_NEAR(moment({core}, 4.5, 8).time_s, 4.5, 1e-9) << "no more";
  EXPECT_EQ(moment({core, started, stopped}).time_s, 6);
  EXPECT_EQ(moment({core, started, stopped}, 0, 5.5).time_s, 5.5) << "it still heats";
  EXPECT_EQ(moment({started}).time_s, 8) << "the recording ends before the heating";
  for (const auto& events : {std::vector<recording::EventRecord>{}, {core}, {core, started, stopped}}) {
    EXPECT_EQ(moment(events).words, still_words(events));
  }
  EXPECT_EQ(still_words(std::vector{started, stopped}), "at the end of the heating");
}

TEST(FrameHistory, KeepsTheWholeSessionInItsMemory) {
  FrameHistory history(rest(), 16 * 600);
  for (int k = 0; k < 5000; ++k) history.add(frame_at(0.02 * k));
  EXPECT_LT(history.size(), 40u);
  EXPECT_EQ(history.begin_s(), 0);
  EXPECT_GT(history.end_s(), 80);
  state::FrameState out = history.make_frame();
  history.sample(37.7, out);
  EXPECT_NEAR(out.force.z(), frame_at(37.7).force.z(), 1e-4) << "coarser, and still right on a line";
}

TEST(FrameHistory, LeavesOutFramesThatAreNotLater) {
  FrameHistory history(rest());
  history.add(frame_at(1));
  history.add(frame_at(0.5));
  EXPECT_EQ(history.size(), 1u);
}

// The oracle is the frame clock of a live session, which interpolates the frames as they were published.
TEST(SessionReplay, ShowsWhatTheSessionShowed) {
  const content::Scene scene = tests::cube_scene(3);
  const support::TemporaryFolder folder;
  haptic::RecordedDevice device = session::recorded_stylus(scene.motion);
  session::LiveSession live(scene, device, {.duration_s = 0.6, .lockstep = true, .recording = folder / "rec"});
  live.run_in_lockstep();
  const recording::Recording recording = recording::read_recording(folder / "rec");

  SessionReplay replay(scene, recording);
  replay.run();
  EXPECT_TRUE(replay.result().identical());
  EXPECT_EQ(replay.state_hash(), live.state_hash());
  EXPECT_EQ(replay.force().summary().peak_force, live.force().summary().peak_force);
  EXPECT_EQ(replay.frames().size(), recording.simulation.size());
  state::FrameState now = replay.frames().make_frame();
  state::FrameState seen = replay.frames().make_frame();
  ASSERT_TRUE(replay.frames().sample(live.frames().newest_s(), seen));
  live.frames().sample(live.frames().newest_s(), now);
  EXPECT_EQ(seen.time_s, now.time_s);
  EXPECT_EQ(seen.needle_positions.back(), now.needle_positions.back());
  float error = 0, moved = 0;
  for (std::size_t i = 0; i < now.bodies[0].size(); ++i) {
    error = std::max(error, (seen.bodies[0][i] - now.bodies[0][i]).norm());
    moved = std::max(moved, (now.bodies[0][i] - replay.frames().make_frame().bodies[0][i]).norm());
  }
  EXPECT_GT(moved, 1e-4F);
  EXPECT_LT(error, moved / 10'000);
}

}  // namespace
}  // namespace stylet::debrief
