// A breath held because the trainee asks for it: at end-expiration, for so long, and replayed to the same bits.
#include "engine/session/held_breath.h"

#include "engine/content/breathing.h"
#include "engine/session/live_session.h"
#include "engine/session/recorded_stylus.h"
#include "engine/session/replay.h"
#include "engine/session/step_hash.h"
#include "tests/session/cube_scene.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace stylet::session {
namespace {

content::Scene breathing_cube() {
  content::Scene scene = tests::cube_scene(4);
  scene.bodies[0].held_motion.assign(scene.bodies[0].fixed_nodes.size(), Eigen::Vector3d(0.004, 0, 0));
  scene.breathing = {.amplitude = 1, .period = 0.5};
  return scene;
}

TEST(HeldBreath, IsTheScenesWithoutItsHoldsUntilItIsAskedFor) {
  content::Scene scene = breathing_cube();
  const content::Breathing without = scene.breathing;
  scene.breathing.holds = {{1, 60}};  // of the recorded motion
  HeldBreath breath(scene.breathing);
  for (int i = 0; i < 500; ++i) EXPECT_EQ(breath.inspiration(0.02 * i), content::inspiration(without, 0.02 * i));
  EXPECT_EQ(breath.state(), HeldBreath::State::breathing);
}

TEST(HeldBreath, IsHeldAtTheEndOfThisBreathAndEndsByItself) {
  content::Scene scene = breathing_cube();
  scene.breathing.period = 4;
  HeldBreath breath(scene.breathing);
  const auto inspiration = [&](double t) { return breath.inspiration(t).value(); };
  double last = 0, fastest = 0, from = 0, to = 0;
  for (int i = 0; i < 2000; ++i) {
    const double t = 0.02 * i;
    if (i == 250) {  // 5 s: a quarter of a breath in
      EXPECT_GT(last, 0.1);
      breath.ask(true);
      EXPECT_EQ(breath.state(), HeldBreath::State::breathing_out);
    }
    const double now = inspiration(t);
    if (i > 0) fastest = std::max(fastest, std::abs(now - last) / 0.02);
    if (breath.state() == HeldBreath::State::held) {
      if (from == 0) from = t;
      EXPECT_NEAR(now, 0, 1e-6);
      EXPECT_NEAR(breath.left_s(), HeldBreath::kLongest - (t - from), 1e-9);
    } else if (from > 0 && to == 0) {
      to = t;
    }
    last = now;
  }
  EXPECT_NEAR(from, 8, 0.03) << "this breath is breathed out first";
  EXPECT_NEAR(to - from, HeldBreath::kLongest, 0.03);
  EXPECT_EQ(breath.state(), HeldBreath::State::breathing);
  // Quiet breathing is nowhere faster than 4 pi / period * sqrt(27) / 16, the greatest slope of sin^4.
  EXPECT_LT(fastest, 4 * M_PI / 4 * std::sqrt(27) / 16 * 1.001);
  EXPECT_GT(inspiration(to + 14), 0.99) << "three and a half breaths later it is drawn in";
}

TEST(HeldBreath, GoesOnWhenItIsLetGo) {
  content::Scene scene = breathing_cube();
  HeldBreath breath(scene.breathing);
  breath.ask(true);
  double t = 0;
  for (; t < 3; t += 0.02) breath.inspiration(t);
  EXPECT_EQ(breath.state(), HeldBreath::State::held);
  breath.ask(false);
  EXPECT_EQ(breath.state(), HeldBreath::State::breathing);
  EXPECT_NEAR(breath.inspiration(t).value(), 0, 0.001);
  EXPECT_NEAR(breath.inspiration(t + 0.25).value(), 1, 0.1) << "half a breath later";
}

TEST(HeldBreath, IsNotAskedForWhereNothingBreathes) {
  content::Scene scene = breathing_cube();
  scene.breathing.amplitude = 0;
  HeldBreath breath(scene.breathing);
  breath.ask(true);
  EXPECT_FALSE(breath.breathes());
  EXPECT_EQ(breath.state(), HeldBreath::State::breathing);
}

TEST(HeldBreath, APauseTakesNothingOfTheHold) {
  const content::Scene scene = breathing_cube();
  const support::TemporaryFolder folder;
  haptic::RecordedDevice device = recorded_stylus(scene.motion);
  HeldBreath breath(scene.breathing);
  LiveSession live(scene, device,
                   {.duration_s = std::numeric_limits<double>::infinity(),
                    .lockstep = true,
                    .recording = folder / "breath.rec",
                    .build = "test",
                    .listeners = {&breath}});
  live.start();
  breath.ask(true);
  live.advance(1.0);
  ASSERT_EQ(breath.state(), HeldBreath::State::held);
  const double left = breath.left_s();
  live.pause();
  live.advance(2 * HeldBreath::kLongest);
  EXPECT_EQ(breath.state(), HeldBreath::State::held);
  live.resume();
  live.advance(0.1);
  EXPECT_EQ(breath.state(), HeldBreath::State::held);
  EXPECT_NEAR(breath.left_s(), left - 0.1, 0.021) << "a step more or less";
  // Let go in a pause: as soon as time goes on.
  live.pause();
  breath.ask(false);
  live.advance(1.0);
  live.resume();
  live.advance(0.1);
  EXPECT_EQ(breath.state(), HeldBreath::State::breathing);
  live.stop();
}

TEST(HeldBreath, ReplaysToTheSameBitsWithNobodyAsking) {
  const content::Scene scene = breathing_cube();
  const support::TemporaryFolder folder;
  haptic::RecordedDevice device = recorded_stylus(scene.motion);
  HeldBreath breath(scene.breathing);
  LiveSession live(scene, device,
                   {.duration_s = std::numeric_limits<double>::infinity(),
                    .lockstep = true,
                    .recording = folder / "breath.rec",
                    .build = "test",
                    .listeners = {&breath}});
  live.start();
  live.advance(0.6);
  breath.ask(true);
  live.advance(1.0);
  EXPECT_EQ(breath.state(), HeldBreath::State::held);
  breath.ask(false);
  live.advance(0.3);
  live.stop();

  const recording::Recording recording = recording::read_recording(folder / "breath.rec");
  ASSERT_TRUE(recording.complete()) << recording.condition();
  double held = 0, most = 0, as_scene = 0;
  for (const recording::SimulationStepRecord& record : recording.simulation) {
    if (record.time_s > 1.05 && record.time_s < 1.58) held = std::max(held, record.inspiration);
    most = std::max(most, record.inspiration);
    as_scene =
        std::max(as_scene, std::abs(record.inspiration - content::inspiration(scene.breathing, record.time_s)));
  }
  EXPECT_LT(held, 0.001);
  EXPECT_GT(most, 0.9);
  EXPECT_GT(as_scene, 0.9) << "it is not what the scene alone would give";

  StepHash hash;
  const RecordedSettings settings = recorded_settings(recording);
  CoupledLoops loops(scene, settings.coupling, settings.start, {&hash}, settings.base);
  const ReplayResult result = replay(recording, loops, hash);
  EXPECT_TRUE(result.identical());
  EXPECT_GT(result.compared, 1u);
}

}  // namespace
}  // namespace stylet::session
