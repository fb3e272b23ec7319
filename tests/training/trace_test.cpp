// The trace of a session: what it says of a needle in layers, and that a replay says the same.
#include "engine/training/trace.h"

#include "engine/readers/motion.h"
#include "engine/session/live_session.h"
#include "engine/session/recorded_stylus.h"
#include "engine/session/replay.h"
#include "engine/session/state_hash.h"
#include "tests/session/layered_scene.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <vector>

namespace stylet::training {
namespace {

/// The layered patient with the tumour as target and, below it, a structure that the needle must not enter.
content::Scene scene_to_train() {
  content::Scene scene = tests::layered_scene();
  scene.targets = {{.name = "tumour", .centre = {0, 0, tests::kTumourTop - tests::kTumourRadius}, .radius = 0.01}};
  content::Forbidden tumour{.name = "tumour", .tissue = 5, .body = 1};
  tumour.inside = scene.labels;
  std::ranges::transform(scene.labels.labels, tumour.inside.labels.begin(),
                         [](std::uint8_t label) { return static_cast<std::uint8_t>(label == 5 ? 1 : 0); });
  scene.forbidden = {tumour};
  std::vector<content::MotionSample>& hand = scene.motion.stylus;
  content::MotionSample pressed = readers::sample_motion(hand, 0.5);
  pressed.time_s = 0.5;
  hand.insert(hand.begin() + 1, pressed);
  for (content::MotionSample& sample : hand) sample.buttons = sample.time_s >= 0.5 ? 1 : 0;
  return scene;
}

std::uint64_t hash_of(const Trace& trace) {
  session::StateHash hash;
  const auto vector = [&](const Eigen::Vector3d& v) { hash.add({v.data(), 3}); };
  for (const TraceSample& s : trace.samples) {
    for (const double x : {s.time_s, s.inserted, s.bend, s.target_distance, s.probe_force, s.probe_area, s.in_beam}) {
      hash.add(x);
    }
    for (const auto& v : {s.tip, s.hub, s.entry, s.force, s.target_position, s.tip_in_probe, s.probe.position})
      vector(v);
    hash.add({s.tip_orientation.coeffs().data(), 4});
    hash.add({s.hub_orientation.coeffs().data(), 4});
    for (const int i : {static_cast<int>(s.tip_state), s.tip_body, s.near_tissue ? 1 : 0, s.tissue, s.target}) {
      hash.add(static_cast<std::uint64_t>(i));
    }
    for (const std::uint32_t i : {s.forbidden, s.crossed, s.buttons}) hash.add(std::uint64_t{i});
  }
  return hash.value();
}

Trace record(const content::Scene& scene, const std::filesystem::path& path, bool lockstep, double duration) {
  haptic::RecordedDevice device = session::recorded_stylus(scene.motion);
  TraceRecorder recorder(scene, duration);
  session::LiveSession session(
      scene, device,
      {.duration_s = duration, .lockstep = lockstep, .recording = path, .build = "test", .listeners = {&recorder}});
  if (lockstep) {
    session.run_in_lockstep();
  } else {
    session.start();
    session.wait();
    session.stop();
  }
  return recorder.take(recording::read_recording(path).events);
}

Trace replayed(const content::Scene& scene, const std::filesystem::path& path) {
  const recording::Recording recording = recording::read_recording(path);
  const session::RecordedSettings settings = session::recorded_settings(recording);
  session::StepHash hash;
  TraceRecorder recorder(scene, recording.haptic.back().time_s);
  session::CoupledLoops loops(scene, settings.coupling, settings.start, {&hash, &recorder}, settings.base);
  session::replay(recording, loops, hash);
  return recorder.take(recording.events);
}

class EachMode : public ::testing::TestWithParam<bool> {};

TEST_P(EachMode, IsTheSameInReplayBitForBit) {
  const content::Scene scene = scene_to_train();
  const support::TemporaryFolder folder;
  Trace live = record(scene, folder / "live.rec", GetParam(), 0.9);
  // In threads a busy machine takes fewer samples: then for longer.
  for (double duration = 1.8; !GetParam() && live.samples.size() <= 3 && duration < 60; duration *= 2)
    live = record(scene, folder / "live.rec", false, duration);
  const Trace again = replayed(scene, folder / "live.rec");
  ASSERT_GT(live.samples.size(), 3U);
  EXPECT_EQ(live.samples.size(), again.samples.size());
  EXPECT_EQ(hash_of(live), hash_of(again));
  EXPECT_EQ(live.samples.back().buttons, 1U);
  EXPECT_EQ(live.samples.front().buttons, 0U);
  EXPECT_EQ(live.events.size(), again.events.size());
  EXPECT_GE(live.events.size(), GetParam() ? 5U : 1U) << "punctures, buttons";
}

INSTANTIATE_TEST_SUITE_P(Trace, EachMode, ::testing::Bool(),
                         [](const auto& tested) { return tested.param ? "lockstep" : "threaded"; });

TEST(Trace, SaysWhatTheNeedleGoesThrough) {
  const content::Scene scene = scene_to_train();
  const support::TemporaryFolder folder;
  const Trace trace = record(scene, folder / "layers.rec", true, scene.motion.stylus.back().time_s);
  std::vector<int> met;
  double hole = 0;
  for (const TraceSample& s : trace.samples) {
    if (met.empty() || met.back() != s.tissue) met.push_back(s.tissue);
    if (s.inserted > 0.002) {
      hole = std::max(hole, s.entry.head<2>().norm());
      EXPECT_NEAR(s.inserted, (s.tip - s.entry).norm(), 5e-4) << "the needle hardly bends";
    } else if (s.inserted == 0) {
      EXPECT_EQ(s.entry, s.tip);
    }
    EXPECT_EQ(s.forbidden != 0, s.tissue == 5) << s.time_s;
    EXPECT_NEAR(s.target_distance, (s.tip - s.target_position).norm(), 1e-12);
    EXPECT_LT((s.target_position - scene.targets[0].centre).norm(), 0.02) << "carried, not lost";
  }
  for (const int tissue : {0, 1, 2, 3, 4, 5}) EXPECT_NE(std::ranges::find(met, tissue), met.end()) << tissue;
  EXPECT_LT(hole, 0.004);
  EXPECT_EQ(trace.samples.back().tissue, 5);
  EXPECT_LT(trace.samples.back().target_distance, 0.004);
  EXPECT_FALSE(trace.samples.front().near_tissue) << "5 mm above the skin";
  EXPECT_TRUE(trace.samples.back().near_tissue);
}

TEST(Trace, CountsWhatItHasNoRoomFor) {
  const content::Scene scene = scene_to_train();
  TraceRecorder recorder(scene, 0);
  session::CoupledLoops loops(scene, physics::Coupling::stylet, {.position = {0, 0, 0.4}}, {&recorder});
  physics::TissuePatch patch = loops.make_patch();
  constexpr std::size_t kSteps = 130, kRoom = 100;
  for (std::size_t i = 0; i < kSteps; ++i) {
    recorder.simulation_stepped({.step = i, .probe = {}}, {}, loops.tissue(), loops.needle());
  }
  EXPECT_EQ(recorder.trace().samples.size(), kRoom);
  EXPECT_EQ(recorder.trace().dropped, kSteps - kRoom);
}

}  // namespace
}  // namespace stylet::training
