// A device weaker than the scenario gets all forces smaller, is told, and nothing of it touches the physics.
#include "engine/session/force_scale.h"

#include "engine/session/live_session.h"
#include "engine/session/replay.h"
#include "engine/session/session_report.h"
#include "tests/session/cube_scene.h"
#include "tests/session/held_stylus.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <string>

namespace stylet::session {
namespace {

haptic::DeviceLimits device_of(double max_force, double continuous_force) {
  return {.renders_force = true, .max_force_n = max_force, .continuous_force_n = continuous_force};
}

TEST(ForceScale, IsWhatTheDeviceGivesOverWhatIsExpectedAndNeverAboveOne) {
  EXPECT_DOUBLE_EQ(force_scale({.peak = 4}, device_of(3, 3)), 0.75);
  EXPECT_DOUBLE_EQ(force_scale({.peak = 4, .held = 2}, device_of(3, 1)), 0.5) << "the motors would get warm";
  EXPECT_EQ(force_scale({.peak = 4, .held = 2}, device_of(8, 3)), 1) << "a device that gives enough";
  EXPECT_EQ(force_scale({.peak = 4, .held = 2}, device_of(8, 0)), 1) << "holds its peak for ever";
  EXPECT_EQ(force_scale({}, device_of(0.1, 0.1)), 1) << "the scenario says nothing";
  haptic::DeviceLimits weak = device_of(1, 1);
  weak.renders_force = false;
  EXPECT_EQ(force_scale({.peak = 4}, weak), 1) << "it moves nothing";
}

struct ScaledInsertion {
  std::uint64_t hash = 0;
  recording::Recording recording;
  ForceOutput output;
  double peak = 0;          ///< of the needle's force, N
  double largest_sent = 0;  ///< to the device, N
  bool shown_clipped = false;
  float shown_scale = 0;
};

ScaledInsertion insert_with(const content::Scene& scene, const haptic::DeviceLimits& limits, double seconds = 1.6) {
  tests::HeldStylus device = tests::held_stylus(scene, limits);
  const support::TemporaryFolder folder;
  LiveSession session(scene, device,
                      {.duration_s = seconds, .lockstep = true, .recording = folder / "r", .build = "test"});
  const RunStatistics run = session.run_in_lockstep();
  ScaledInsertion outcome{.hash = session.state_hash(),
                          .recording = recording::read_recording(folder / "r"),
                          .output = session.force_output(run).value(),
                          .peak = session.force().summary().peak_force,
                          .largest_sent = device.largest};
  state::FrameState frame = session.frames().make_frame();
  session.frames().sample(session.frames().newest_s(), frame);
  outcome.shown_clipped = frame.force_clipped > 0.5F;
  outcome.shown_scale = frame.force_scale;
  return outcome;
}

TEST(ForceScale, NothingIsClippedThatWasWithoutIt) {
  content::Scene scene = tests::cube_scene(4);
  const ScaledInsertion strong = insert_with(scene, device_of(10, 10));
  ASSERT_GT(strong.peak, 0.2);
  EXPECT_EQ(strong.output.scale, 1);
  EXPECT_EQ(strong.output.clipped_times, 0U);
  const haptic::DeviceLimits weak = device_of(0.5 * strong.peak, 0.5 * strong.peak);
  const ScaledInsertion clipped = insert_with(scene, weak);
  std::printf("device of half the force: clipped %llu times, %.2f s, shown: %d\n",
              static_cast<unsigned long long>(clipped.output.clipped_times), clipped.output.clipped_s,
              static_cast<int>(clipped.shown_clipped));
  EXPECT_EQ(clipped.output.scale, 1);
  EXPECT_GE(clipped.output.clipped_times, 1U);
  EXPECT_GT(clipped.output.clipped_s, 0.1);
  EXPECT_TRUE(clipped.shown_clipped);
  // Less force on the hand lets it go deeper, so that the needle's is more than it was: a third is enough for that.
  scene.hand_force = {.peak = 1.3 * strong.peak};
  const ScaledInsertion scaled = insert_with(scene, weak);
  EXPECT_DOUBLE_EQ(scaled.output.scale, 0.5 / 1.3);
  EXPECT_FLOAT_EQ(scaled.shown_scale, static_cast<float>(scaled.output.scale));
  EXPECT_EQ(scaled.output.clipped_times, 0U);
  EXPECT_EQ(scaled.output.clipped_s, 0);
  EXPECT_FALSE(scaled.shown_clipped);
  EXPECT_GT(scaled.largest_sent, 0.7 * scaled.output.scale * scaled.peak);
  EXPECT_LE(scaled.largest_sent, scaled.output.scale * scaled.peak * (1 + 1e-9));
}

TEST(ForceScale, IsKeptInTheRecordingAndTheReplayHasTheSameBits) {
  content::Scene scene = tests::cube_scene(4);
  scene.hand_force = {.peak = 1};
  const ScaledInsertion live = insert_with(scene, device_of(0.6, 0.6), 0.9);
  const RecordedSettings settings = recorded_settings(live.recording);
  EXPECT_DOUBLE_EQ(settings.force_scale, 0.6);
  StepHash hash;
  CoupledLoops loops(scene, settings.coupling, settings.start, {&hash}, settings.base);
  EXPECT_TRUE(replay(live.recording, loops, hash).identical());
  EXPECT_EQ(hash.state(), live.hash);
  // One that says nothing of it was not scaled.
  RecordedSettings before = settings;
  before.force_scale = 1;
  EXPECT_EQ(to_json(before).find("force_scale"), std::string::npos);
}

TEST(ForceScale, IsTold) {
  SessionReport report;
  EXPECT_FALSE(to_json(report).contains("force_output")) << "a stylus without force";
  report.force_output = {.scale = 0.52, .max_force = 3.3};
  EXPECT_EQ(to_json(report)["force_output"]["scale"], 0.52);
  EXPECT_NE(main_figures(report).find("52 % of the needle's force; the device gives 3.3 N, never clipped"),
            std::string::npos)
      << main_figures(report);
  report.force_output = {.scale = 1, .max_force = 3.3, .clipped_s = 1.5, .clipped_times = 2};
  EXPECT_EQ(to_json(report)["force_output"]["clipped_times"], 2);
  EXPECT_NE(main_figures(report).find("CLIPPED 2 times, 1.5 s in all"), std::string::npos) << main_figures(report);
}

}  // namespace
}  // namespace stylet::session
