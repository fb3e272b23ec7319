// A stylus with force in a hand: coupled, limited, recorded, replayed.
#include "engine/session/live_session.h"
#include "engine/session/needle_base.h"
#include "engine/session/recorder.h"
#include "engine/session/replay.h"
#include "engine/session/session_report.h"
#include "engine/session/stylus_step.h"
#include "tests/session/cube_scene.h"
#include "tests/session/held_stylus.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

namespace stylet::session {
namespace {

using Eigen::Vector3d;
using tests::held_stylus;
using tests::HeldStylus;

constexpr double kMs = 1e-3;

/// Peak of the motion of a mass on a sampled, delayed spring, after `seconds`, over its start.
double growth(const physics::NeedleBase& base, const haptic::DeviceLimits& limits, double seconds) {
  constexpr double kMass = 0.045, kSubstep = 0.1e-3;
  double x = 1e-3, v = 0, last = x, peak = 0;
  std::vector<double> on_the_way(static_cast<std::size_t>(std::lround(limits.loop_delay_s / kSubstep)), 0.0);
  double force = 0;
  for (int n = 0; n < static_cast<int>(seconds / kMs); ++n) {
    force = -base.stiffness * x - base.damping * (x - last) / kMs;
    last = x;
    for (int s = 0; s < 10; ++s) {
      on_the_way.push_back(force);
      v += (on_the_way.front() - limits.physical_damping_n_s_per_m * v) / kMass * kSubstep;
      on_the_way.erase(on_the_way.begin());
      x += v * kSubstep;
    }
    if (n > 900 * seconds) peak = std::max(peak, std::abs(x));
  }
  return peak / 1e-3;
}

TEST(NeedleBase, FollowsTheDataSheetAndStaysStable) {
  haptic::DeviceLimits limits;
  EXPECT_EQ(needle_base(limits, 1000).kind, physics::BaseKind::prescribed);
  limits.renders_force = true;
  for (const double delay : {0.0, 0.0015, 0.003}) {
    limits.loop_delay_s = delay;
    physics::NeedleBase base = needle_base(limits, 1000);
    const double stable = stable_stiffness(limits.physical_damping_n_s_per_m + base.damping, kMs, delay);
    EXPECT_LE(base.stiffness, limits.max_stiffness_n_per_m);
    EXPECT_LE(base.stiffness, 0.5 * stable);
    const double held = growth(base, limits, 1);
    base.stiffness = 2 * stable;
    const double beyond = growth(base, limits, 1);
    std::printf("delay %.1f ms: %4.0f N/m and %.1f N s/m decay to %.1e in 1 s; %4.0f N/m grow to %.1e\n", 1e3 * delay,
                needle_base(limits, 1000).stiffness, base.damping, held, base.stiffness, beyond);
    EXPECT_LT(held, 1e-2);
    EXPECT_GT(beyond, 1);
  }
}

class SentForces final : public StepListener {
public:
  void force_sent(double, std::uint64_t, const haptic::GuardedWrench& out) override {
    flags |= out.flags;
    ++count;
  }
  std::uint32_t flags = 0;
  std::uint64_t count = 0;
};

TEST(StylusWithForce, SettlesInTissueWithTheForceOfTheBaseSpring) {
  content::Scene scene = tests::cube_scene(5);
  HeldStylus device = held_stylus(scene);
  const physics::NeedleBase base = needle_base(device.limits(), scene.rates.haptic_hz);
  SentForces sent;
  CoupledLoops loops(scene, physics::Coupling::stylet, {device.read(0).position, device.read(0).orientation}, {&sent},
                     base);
  double least_work = 0, late_change = 0;
  Vector3d late = Vector3d::Zero();
  StylusStep hand(loops, device);
  physics::TissuePatch patch = loops.make_patch();
  const int steps = support::kSanitized ? 2400 : 4000;
  for (int k = 0; k < steps; ++k) {
    if (k % 20 == 0) loops.simulation_step(k * kMs, loops.needle(), false, false, patch);
    const physics::NeedleState& needle = hand.step(k * kMs, kMs, patch);
    least_work = std::min(least_work, needle.hand_work);
    if (k >= steps - 200) {
      if (k > steps - 200) late_change = std::max(late_change, (device.sent - late).norm());
      late = device.sent;
    }
  }
  const physics::NeedleState& needle = loops.needle();
  const Vector3d spring = base.stiffness * (needle.positions.col(0) - device.seen());
  Vector3d reaction = Vector3d::Zero();
  for (int i = 0; i < needle.force_count; ++i) reaction -= needle.forces[i].force;
  std::printf(
      "base %.0f N/m, %.1f N s/m; at rest |F| %.4f N, from the spring's by %.1e N, from the reaction by %.1e N, "
      "from what was sent by %.1e N; last 0.2 s: change %.1e N a sample, hand %.1e m/s; least work %.1e J\n",
      base.stiffness, base.damping, needle.wrench.force.norm(), (needle.wrench.force - spring).norm(),
      (needle.wrench.force - reaction).norm(), (needle.wrench.force - device.sent).norm(), late_change,
      device.speed(), least_work);
  EXPECT_GT(needle.wrench.force.norm(), 0.1) << "the needle must be in the tissue";
  EXPECT_LT((needle.wrench.force - spring).norm(), 1e-3);
  EXPECT_LT((needle.wrench.force - reaction).norm(), 1e-6);
  EXPECT_LT((needle.wrench.force - device.sent).norm(), 1e-9);
  EXPECT_LT(late_change, 1e-4);
  EXPECT_LT(device.speed(), 1e-3);
  EXPECT_GT(least_work, -1e-6);
  EXPECT_LE(device.largest, device.limits().max_force_n);
  EXPECT_EQ(sent.count, static_cast<std::uint64_t>(steps));
}

TEST(StylusWithForce, RecordsHowTheNeedleWasHeldAndReplaysToTheSameBits) {
  const content::Scene scene = tests::cube_scene(5);
  const support::TemporaryFolder folder;
  HeldStylus device = held_stylus(scene);
  std::uint64_t hash = 0;
  {
    LiveSession session(scene, device,
                        {.coupling = physics::Coupling::stylet,
                         .duration_s = 0.9,
                         .lockstep = true,
                         .recording = folder / "held",
                         .build = "test"});
    session.run_in_lockstep();
    hash = session.state_hash();
  }
  const recording::Recording recording = recording::read_recording(folder / "held");
  const RecordedSettings settings = recorded_settings(recording);
  const physics::NeedleBase base = needle_base(device.limits(), scene.rates.haptic_hz);
  EXPECT_EQ(settings.base.kind, physics::BaseKind::spring_damper);
  EXPECT_EQ(settings.base.stiffness, base.stiffness);
  EXPECT_EQ(settings.base.damping, base.damping);
  EXPECT_EQ(settings.base.rotational_stiffness, base.rotational_stiffness);

  StepHash step_hash;
  CoupledLoops loops(scene, settings.coupling, settings.start, {&step_hash}, settings.base);
  EXPECT_TRUE(replay(recording, loops, step_hash).identical());
  EXPECT_EQ(step_hash.state(), hash);
  StepHash prescribed_hash;
  CoupledLoops prescribed(scene, settings.coupling, settings.start, {&prescribed_hash});
  EXPECT_FALSE(replay(recording, prescribed, prescribed_hash).identical()) << "the base must matter";

  const auto is_safety = [](const recording::EventRecord& e) {
    return e.name == Recorder::kSafetyEvent && e.text(Recorder::kSafetyLimit) == "rising";
  };
  EXPECT_EQ(std::count_if(recording.events.begin(), recording.events.end(), is_safety), 1);
}

TEST(SafetyEvents, EachLimitLeavesOneWhenItBeginsToAct) {
  const content::Scene scene = tests::cube_scene(3);
  const support::TemporaryFolder folder;
  {
    recording::RecordingWriter writer(folder / "events", recording::RecordingHeader{});
    const StepHash hash;
    Recorder recorder(writer, hash, scene);
    for (int k = 0; k < 3000; ++k) {  // each for 100 ms, one after the other, twice
      std::uint32_t flags = 0;
      for (int bit = 0; bit < haptic::kOutputFlagCount; ++bit) {
        if (k % 1500 >= 50 * bit && k % 1500 < 50 * bit + 100) flags |= 1u << bit;
      }
      recorder.force_sent(k * kMs, static_cast<std::uint64_t>(k) + 1, {.flags = flags});
    }
    writer.finish();
  }
  const recording::Recording recording = recording::read_recording(folder / "events");
  ASSERT_EQ(recording.events.size(), 2u * haptic::kOutputFlagCount);
  for (std::size_t e = 0; e < recording.events.size(); ++e) {
    const auto bit = static_cast<int>(e % haptic::kOutputFlagCount);
    const recording::EventRecord& event = recording.events[e];
    EXPECT_EQ(event.name, "safety");
    EXPECT_EQ(event.text(Recorder::kSafetyLimit), haptic::output_flag_name(bit));
    EXPECT_EQ(event.step, 1500 * (e / haptic::kOutputFlagCount) + 50u * static_cast<unsigned>(bit) + 1);
  }
}

TEST(NeedleBentEvent, IsToldAtFirstAndWhenItIsADegreeMore) {
  const content::Scene scene = tests::cube_scene(3);
  const support::TemporaryFolder folder;
  constexpr double kDegree = 0.017453292519943295;
  {
    recording::RecordingWriter writer(folder / "events", recording::RecordingHeader{});
    const StepHash hash;
    Recorder recorder(writer, hash, scene);
    physics::NeedleState needle;
    std::uint64_t step = 0;
    for (const double degrees : {0.0, 0.9, 1.1, 1.2, 2.0, 2.2, 1.0, 5.0}) {
      needle.damage.bend = degrees * kDegree;
      recorder.haptic_stepped({.step = ++step, .time_s = kMs * static_cast<double>(step)}, needle);
    }
    writer.finish();
  }
  const recording::Recording recording = recording::read_recording(folder / "events");
  std::vector<double> told;
  for (const recording::EventRecord& event : recording.events) {
    ASSERT_EQ(event.name, "needle_bent");
    told.push_back(event.number(Recorder::kBentBy).value_or(-1));
  }
  ASSERT_EQ(told.size(), 3U);
  EXPECT_NEAR(told[0], 1.1, 1e-9);
  EXPECT_NEAR(told[1], 2.2, 1e-9);
  EXPECT_NEAR(told[2], 5.0, 1e-9);
  EXPECT_NEAR(needle_bent_deg(recording.events), 5, 1e-9);
  const SessionReport report{.needle_bent_deg = 5};
  EXPECT_EQ(to_json(report)["needle_bent_deg"], 5);
}

/// Needle 20 mm in tissue with force on the hand, a millisecond at a time.
struct InTissue {
  InTissue() : scene_(tests::cube_scene(4)), device_(held_stylus(scene_)) {
    loops_.emplace(scene_, physics::Coupling::stylet,
                   physics::StylusPose{device_.read(0).position, device_.read(0).orientation},
                   std::vector<StepListener*>{&sent_}, needle_base(device_.limits(), scene_.rates.haptic_hz));
    hand_.emplace(*loops_, device_);
    patch_ = loops_->make_patch();
    for (int k = 0; k < 700; ++k) step();
    sent_.flags = 0;
  }
  /// A millisecond.
  const physics::NeedleState& step(bool simulate = true) {
    const double time_s = step_ * kMs;
    if (simulate && step_ % 20 == 0) loops_->simulation_step(time_s, loops_->needle(), false, false, patch_);
    ++step_;
    return hand_->step(time_s, kMs, patch_);
  }

  content::Scene scene_;
  HeldStylus device_;
  SentForces sent_;
  std::optional<CoupledLoops> loops_;
  std::optional<StylusStep> hand_;
  physics::TissuePatch patch_;
  int step_ = 0;
};

class Faulty : public ::testing::Test, protected InTissue {};

TEST_F(Faulty, UnpluggedStylusLeavesTheNeedleAndItsForceComesBackInARise) {
  ASSERT_GT(device_.sent.norm(), 0.2);
  const Vector3d hub = loops_->needle().positions.col(0);
  device_.plugged = false;
  for (int k = 0; k < 50; ++k) {
    step();
    ASSERT_EQ(device_.sent, Vector3d::Zero()) << k;
  }
  EXPECT_LT((loops_->needle().positions.col(0) - hub).norm(), 1e-3);
  device_.plugged = true;
  double last = 0;
  for (int k = 0; k < 400; ++k) {
    step();
    ASSERT_LT(device_.sent.norm() - last, 0.02) << k;  // of a rise over 0.5 s to at most 3.3 N
    last = device_.sent.norm();
  }
}

TEST_F(Faulty, PauseFadesTheForceAndItComesBackInARise) {
  ASSERT_GT(device_.sent.norm(), 0.2);
  const physics::NeedleState before = loops_->needle();
  const double allowed = device_.sent.norm() * kMs / StylusStep::kPauseFade * (1 + 1e-9);
  double last = device_.sent.norm();
  for (int k = 0; k < 200; ++k) {
    hand_->hold(step_++ * kMs, kMs);
    ASSERT_LE(last - device_.sent.norm(), allowed) << k;
    last = device_.sent.norm();
    if (k * kMs >= StylusStep::kPauseFade) {
      ASSERT_EQ(device_.sent, Vector3d::Zero()) << k;
    }
  }
  EXPECT_EQ(loops_->needle().step, before.step) << "the loops stand";
  EXPECT_EQ(loops_->needle().positions, before.positions);
  for (int k = 0; k < 1700; ++k) {  // it may wait for a second, and rises in half of one
    step();
    ASSERT_LT(device_.sent.norm() - last, 0.02) << k;  // as after an unplugged stylus
    last = device_.sent.norm();
  }
  EXPECT_GT(last, 0.05) << "it is felt again";
}

TEST_F(Faulty, SilentSimulationFadesTheForce) {
  ASSERT_GT(device_.sent.norm(), 0.2);
  int faded = -1, gone = -1;
  const double begin_s = patch_.time_s;
  for (int k = 0; k < 600 && gone < 0; ++k) {
    step(false);
    const int age_ms = static_cast<int>(std::lround(((step_ - 1) * kMs - begin_s) / kMs));
    if (faded < 0 && (sent_.flags & haptic::kOutputStalePatch) != 0) faded = age_ms;
    if (device_.sent.isZero(0)) gone = age_ms;
  }
  std::printf("patch %d ms old: fades; %d ms old: zero\n", faded, gone);
  EXPECT_NEAR(faded, 201, 1);
  EXPECT_NEAR(gone, 500, 1);
}

TEST_F(Faulty, PhysicsThatRefusesItsInputFadesTheForceAsAStalePose) {
  ASSERT_GT(device_.sent.norm(), 0.2);
  patch_.epoch += 1;
  patch_.bodies[0].free_positions.setConstant(std::numeric_limits<double>::quiet_NaN());
  int gone = -1;
  for (int k = 0; k < 40 && gone < 0; ++k) {
    step(false);
    if (device_.sent.isZero(0)) gone = k + 1;
  }
  std::printf("patch of NaN: zero after %d ms\n", gone);
  EXPECT_LE(gone, 20);
  EXPECT_GT(gone, 5);
}

TEST_F(Faulty, OldPoseFadesTheForce) {
  ASSERT_GT(device_.sent.norm(), 0.2);
  for (int k = 1; k <= 25; ++k) {
    device_.age_s = k * kMs;
    step();
    ASSERT_EQ(device_.sent.isZero(0), k >= 20) << k;
  }
}

// Two hands alike, one of which is clicked: what differs is the click and what the hand makes of it.
TEST(ClickInTheHand, IsFeltAlongTheNeedleWithinTheLimitsOfTheDeviceAndGivesLittle) {
  InTissue still, clicked;
  const Vector3d axis = clicked.device_.read(0).orientation * Vector3d::UnitZ();
  const haptic::DeviceLimits limits = clicked.device_.limits();
  ASSERT_EQ(still.device_.sent, clicked.device_.sent);
  clicked.hand_->click();
  double back = 0, forth = 0, work = 0, most = 0, across = 0;
  Vector3d last = clicked.device_.sent, held = Vector3d::Zero(), at = clicked.device_.seen();
  for (int k = 0; k < 200; ++k) {
    still.step();
    clicked.step();
    const Vector3d extra = clicked.device_.sent - still.device_.sent;
    if (k < 15) {
      back = std::min(back, extra.dot(axis));
      forth = std::max(forth, extra.dot(axis));
      across = std::max(across, (extra - extra.dot(axis) * axis).norm());
    }
    work += held.dot(clicked.device_.seen() - at);
    most = std::max(most, work);
    ASSERT_LE((clicked.device_.sent - last).norm(), limits.max_force_rate_n_per_s * kMs * (1 + 1e-9)) << k;
    last = clicked.device_.sent;
    held = extra;
    at = clicked.device_.seen();
  }
  std::printf("click %.2f to %.2f N, %.3f N across; at most %.2f mJ to the hand; flags %#x\n", back, forth, across,
              1e3 * most, clicked.sent_.flags);
  EXPECT_LT(back, -1);
  EXPECT_GT(forth, 0.5);
  EXPECT_LT(across, 0.3);
  EXPECT_LE(clicked.device_.largest, limits.max_force_n);
  EXPECT_LT(most, 1e-3);
  EXPECT_EQ(clicked.sent_.flags & haptic::kOutputClipped, 0U);
  EXPECT_LT((clicked.device_.sent - still.device_.sent).norm(), 0.02) << "0.2 s later it is over";
}

TEST(ClickInTheHand, LeavesNoForceInAFaultInTheMiddleOfItAndDoesNotGoOnAfterwards) {
  for (const char* fault : {"unplugged", "not finite", "stale", "paused"}) {
    for (const int into : {1, 4, 9}) {
      InTissue hand;
      hand.hand_->click();
      for (int k = 0; k < into; ++k) hand.step();
      const std::string what = fault;
      const bool at_once = what == "unplugged" || what == "not finite";
      for (int k = 0; k < 80; ++k) {
        if (what == "unplugged") hand.device_.plugged = false;
        if (what == "not finite") hand.device_.turned = std::numeric_limits<double>::quiet_NaN();
        if (what == "stale") hand.device_.age_s = 0.02 + k * kMs;
        what == "paused" ? hand.hand_->hold(hand.step_++ * kMs, kMs) : (void)hand.step();
        if (at_once || what == "stale" || k * kMs >= StylusStep::kPauseFade) {
          ASSERT_EQ(hand.device_.sent, Vector3d::Zero()) << what << ", " << into << " ms in, " << k << " ms after";
        }
      }
      hand.device_.plugged = true;
      hand.device_.turned = 0;
      hand.device_.age_s = 0;
      double last = 0;
      for (int k = 0; k < 30; ++k) {
        hand.step();
        ASSERT_LT(hand.device_.sent.norm() - last, 0.02) << what << ", " << into << ": a rise, no rest of a click";
        last = hand.device_.sent.norm();
      }
    }
  }
}

TEST(ClickInTheHand, AskedForInAPauseIsLeftOut) {
  InTissue still, clicked;
  clicked.hand_->hold(clicked.step_ * kMs, 0);
  still.hand_->hold(still.step_ * kMs, 0);
  clicked.hand_->click();
  clicked.hand_->hold(clicked.step_ * kMs, 0);
  still.hand_->hold(still.step_ * kMs, 0);
  for (int k = 0; k < 50; ++k) {
    still.step();
    clicked.step();
    ASSERT_EQ(clicked.device_.sent, still.device_.sent) << k;
  }
}

TEST(ClickInTheHand, ADeviceWithoutForceIsSentNone) {
  const content::Scene scene = tests::cube_scene(3);
  class Logged final : public haptic::Device {
  public:
    std::string name() const override { return "pen"; }
    haptic::DeviceLimits limits() const override { return {}; }
    haptic::StylusSample read(double now_s) override {
      return {.time_s = now_s, .position = {0, 0, 0.3}, .valid = true};
    }
    void write(const Vector3d& force, const Vector3d&) override { sent = force; }
    Vector3d sent = Vector3d::Zero();
  } pen;
  CoupledLoops loops(scene, physics::Coupling::stylet, {pen.read(0).position, pen.read(0).orientation}, {});
  StylusStep hand(loops, pen);
  const physics::TissuePatch patch = loops.make_patch();
  hand.click();
  for (int k = 0; k < 30; ++k) {
    hand.step(k * kMs, kMs, patch);
    ASSERT_LT(pen.sent.norm(), 1e-12) << k;
  }
}

}  // namespace
}  // namespace stylet::session
