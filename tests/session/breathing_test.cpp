// The breath over time, and a small patient who holds it for the needle.
#include "engine/content/breathing.h"

#include "engine/readers/motion.h"
#include "engine/readers/scenario.h"
#include "engine/session/coupled_loops.h"
#include "engine/session/frame_publisher.h"
#include "engine/session/live_session.h"
#include "engine/session/recorded_stylus.h"
#include "engine/session/replay.h"
#include "engine/session/step_hash.h"
#include "tests/session/layered_scene.h"
#include "tests/session/target_watch.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

namespace stylet::session {
namespace {

content::Breathing with_holds() {
  return {.amplitude = 1, .period = 4, .holds = {{5, 9}, {10, 12}, {22, 30}}};
}

TEST(Breathing, IsStillAtEndExpirationInEveryHold) {
  const content::Breathing breathing = with_holds();
  for (const auto& [from, to] : breathing.holds) {
    const double drawn = content::breaths(breathing, from);
    EXPECT_EQ(drawn, std::round(drawn)) << "whole breaths";
    for (double t = from; t <= to; t += 0.1) {
      EXPECT_EQ(content::breaths(breathing, t), drawn);
      EXPECT_NEAR(content::inspiration(breathing, t), 0, 1e-12);
    }
  }
  // 5 s leave room for one breath, 1 s for none, 10 s for two; afterwards it goes on at the period.
  EXPECT_EQ(content::breaths(breathing, 5), 1);
  EXPECT_EQ(content::breaths(breathing, 10), 1);
  EXPECT_EQ(content::breaths(breathing, 22), 3);
  EXPECT_NEAR(content::breaths(breathing, 50) - content::breaths(breathing, 42), 2, 1e-12);
}

TEST(Breathing, IsSmoothAndNeverRunsBack) {
  const content::Breathing breathing = with_holds();
  constexpr double kStep = 1e-3;
  // The rate goes to a full 1/period, at most a third more where breaths are squeezed in, within a quarter of it.
  const double largest_rate = 1.34 / breathing.period;
  const double largest_turn = largest_rate / (breathing.period / 4) * kStep * kStep;
  for (double t = kStep; t < 50; t += kStep) {
    const double before = content::breaths(breathing, t - kStep);
    const double now = content::breaths(breathing, t);
    const double after = content::breaths(breathing, t + kStep);
    ASSERT_GE(now - before, -1e-13) << t;
    ASSERT_LE(now - before, largest_rate * kStep) << t;
    ASSERT_LE(std::abs(after - 2 * now + before), largest_turn * 1.01 + 1e-13) << t;
  }
}

TEST(Breathing, WithoutHoldsIsPeriodic) {
  const content::Breathing breathing{.amplitude = 0.8, .period = 3};
  for (double t = 0; t < 3; t += 0.1)
    EXPECT_NEAR(content::inspiration(breathing, t), content::inspiration(breathing, t + 6), 1e-12);
  EXPECT_EQ(content::inspiration(breathing, 0), 0);
  EXPECT_NEAR(content::inspiration(breathing, 1.5), 0.8, 1e-12);
}

/// The layers, the liver's support breathing 12 mm along x between them and the floor.
content::Scene breathing_scene() {
  content::Scene scene = tests::layered_scene();
  scene.contacts.push_back({.nodes_of = 1, .surface_of = 0});
  scene.bodies[1].held_motion.assign(scene.bodies[1].fixed_nodes.size(), Eigen::Vector3d(0.012, 0, 0));
  scene.breathing = {.amplitude = 1, .period = 0.6, .holds = {{0.8, 4}}};
  for (content::MotionSample& sample : scene.motion.stylus) sample.time_s += 0.8;
  return scene;
}

TEST(Breathing, MovesTheTargetByItsAmplitudeAndHoldsItStillForTheNeedle) {
  const content::Scene scene = breathing_scene();
  tests::TargetWatch watch(scene);
  // Without a needle: what is left of motion in a hold is the breath's.
  physics::StylusPose away;
  away.position = {0, 0, 1};
  CoupledLoops loops(scene, physics::Coupling::stylet, away, {&watch});
  physics::TissuePatch patch = loops.make_patch();
  for (double t = 0; t < 1.2; t += 1 / scene.rates.simulation_hz) {
    loops.simulation_step(t, loops.needle(), true, true, patch);
    loops.worker().step();
  }
  const double largest = watch.largest(), held = watch.largest_from(0.8);
  std::printf("[ breath ] target moves %.2f mm, in the hold %.4f mm\n", 1e3 * largest, 1e3 * held);
  EXPECT_NEAR(largest, 0.012, 0.2 * 0.012);
  EXPECT_LT(held, 1e-4);
}

TEST(Breathing, TakesRigidOrgansAlongInTheSameFrame) {
  content::Scene scene = breathing_scene();
  scene.breathing.rigid_motion = {0.012, 0, 0};
  FramePublisher frames(scene);
  physics::StylusPose away;
  away.position = {0, 0, 1};
  CoupledLoops loops(scene, physics::Coupling::stylet, away, {&frames});
  physics::TissuePatch patch = loops.make_patch();
  state::FrameState frame = frames.buffer().make_frame();
  const auto held = static_cast<std::size_t>(scene.bodies[1].fixed_nodes[0]);
  const Eigen::Vector3f at_rest = scene.bodies[1].mesh.nodes[held].cast<float>();
  float largest = 0;
  for (double t = 0; t < 0.4; t += 1 / scene.rates.simulation_hz) {
    loops.simulation_step(t, loops.needle(), true, true, patch);
    loops.worker().step();
    frames.buffer().sample(t, frame);
    EXPECT_LT((frame.breath - (frame.bodies[1][held] - at_rest)).norm(), 1e-7F) << t;
    largest = std::max(largest, frame.breath.x());
  }
  EXPECT_NEAR(largest, 0.012, 0.02 * 0.012);
}

/// Factorisations asked for in a time, a needle at rest in the liver where it is not away.
int factorisations(const content::Scene& scene, bool needle, double from, double to) {
  physics::StylusPose hub{{0, 0, 1}, Eigen::Quaterniond::Identity()};
  if (needle) hub = {scene.motion.stylus.front().pose.position, scene.motion.stylus.front().pose.orientation};
  CoupledLoops loops(scene, physics::Coupling::stylet, hub, {});
  physics::TissuePatch patch = loops.make_patch();
  const int ratio = static_cast<int>(std::lround(scene.rates.haptic_hz / scene.rates.simulation_hz));
  int count = 0;
  for (int k = 0; k < std::lround(to * scene.rates.haptic_hz); ++k) {
    const double time_s = k / scene.rates.haptic_hz;
    if (k % ratio == 0) {
      const physics::SimulationReport report = loops.simulation_step(time_s, loops.needle(), true, true, patch);
      loops.worker().step();
      if (time_s >= from) count += report.factorisation_requested;
    }
    if (!needle) continue;
    const content::MotionSample hand = readers::sample_motion(scene.motion.stylus, time_s);
    loops.haptic_step(
        {.time_s = time_s, .position = hand.pose.position, .orientation = hand.pose.orientation, .valid = true},
        patch);
  }
  return count;
}

TEST(Breathing, AsksForFactorsAndStillTissueForNone) {
  content::Scene scene = breathing_scene();
  scene.breathing = {.amplitude = 1, .period = 1.2};
  const int steps = static_cast<int>(1.2 * scene.rates.simulation_hz);
  const int shifted = factorisations(scene, false, 1.2, 2.4);
  for (std::size_t i = 0; i < scene.bodies[1].fixed_nodes.size(); ++i) {  // by up to 0.1 rad about z
    const Eigen::Vector3d& x = scene.bodies[1].mesh.nodes[scene.bodies[1].fixed_nodes[i]];
    scene.bodies[1].held_motion[i] = 0.1 * Eigen::Vector3d(-x.y(), x.x(), 0);
  }
  const int breathing = factorisations(scene, false, 1.2, 2.4);
  scene.breathing.amplitude = 0;
  const double rests = scene.motion.stylus.back().time_s;
  const int insertion = factorisations(scene, true, 0, rests + 0.5);
  const int still = factorisations(scene, true, rests + 0.5, rests + 2.5);
  std::printf(
      "[ factorisations ] in the %d steps of a breath that shifts the liver %d, that turns it to 0.1 rad and back "
      "%d; "
      "%d while the needle goes in, %d in 2 s of rest\n",
      steps, shifted, breathing, insertion, still);
  EXPECT_EQ(shifted, 0) << "where nothing turns the matrix stays as it is";
  EXPECT_GE(breathing, 5);
  EXPECT_LE(breathing, steps);
  EXPECT_GE(insertion, 5);
  EXPECT_EQ(still, 0);
}

TEST(Breathing, IsReplayedToTheSameBits) {
  const content::Scene scene = breathing_scene();
  haptic::RecordedDevice device = recorded_stylus(scene.motion);
  const support::TemporaryFolder folder;
  const auto path = folder / "breath.rec";
  LiveSession session(
      scene, device,
      {.duration_s = support::kSanitized ? 0.2 : 1.1, .lockstep = true, .recording = path, .build = "test"});
  (void)session.run_in_lockstep();
  recording::Recording recording = recording::read_recording(path);
  const RecordedSettings settings = recorded_settings(recording);
  StepHash hash;
  CoupledLoops loops(scene, settings.coupling, settings.start, {&hash}, settings.base);
  EXPECT_TRUE(replay(recording, loops, hash).identical());
  // Recordings that have no breath: as the scene breathes.
  for (recording::SimulationStepRecord& record : recording.simulation) record.inspiration = -1;
  StepHash scene_hash;
  CoupledLoops as_scene(scene, settings.coupling, settings.start, {&scene_hash}, settings.base);
  EXPECT_TRUE(replay(recording, as_scene, scene_hash).identical());
  content::Scene held = scene;
  held.breathing.amplitude = 0;
  StepHash other_hash;
  CoupledLoops other(held, settings.coupling, settings.start, {&other_hash});
  EXPECT_FALSE(replay(recording, other, other_hash).identical()) << "a patient who does not breathe is another";
}

TEST(Breathing, TwiceAsDeepAndFastTurnsNoTetrahedronInsideOut) {
  content::Scene scene = readers::load_scene(readers::find_scenario("liver_biopsy"));
  scene.breathing.amplitude = 2;
  scene.breathing.period = 2;
  scene.breathing.holds.clear();
  const physics::StylusPose away{Eigen::Vector3d::Ones(), Eigen::Quaterniond::Identity()};
  CoupledLoops loops(scene, physics::Coupling::stylet, away, {});
  physics::TissuePatch patch = loops.make_patch();
  int inverted = 0;
  double pressed = 0;
  for (int step = 0; step < 100; ++step) {  // a breath; a new factor every fifth step, as in lockstep
    const physics::SimulationReport report =
        loops.simulation_step(0.02 * step, physics::NeedleState(), step % 5 == 0, step % 5 == 0, patch);
    if (report.factorisation_requested) loops.worker().step();
    inverted += report.inverted_tets;
    pressed = std::max(pressed, report.organs.force_n);
  }
  std::printf("[ breath of 30 mm in 2 s ] organs press with up to %.1f N, %d inverted\n", pressed, inverted);
  EXPECT_GT(pressed, 1);
  EXPECT_EQ(inverted, 0);
}

}  // namespace
}  // namespace stylet::session
