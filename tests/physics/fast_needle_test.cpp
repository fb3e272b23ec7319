// A needle faster than the simulation: surfaces met on the way, and what late patches do to the force.
#include "tests/physics/needle_track_runs.h"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <numbers>
#include <utility>
#include <vector>

namespace stylet::bench {
namespace {

using support::kSanitized;

constexpr double kSkin = 3;  // N

std::shared_ptr<const physics::TissueMap> skin_and_liver() {
  physics::InsertionResistance resistance = liver();
  resistance.puncture_force = kSkin;
  return tissue(resistance);
}

/// The cube of R1 at 25 Hz, and a hand that starts from rest: its tip's way and what the needle says of it.
class Startle {
public:
  /// @param from       where the tip starts; the cube is [0, 0.1] m
  /// @param towards    unit, the way of the hand
  /// @param axis       unit, of the needle
  Startle(const Eigen::Vector3d& from, const Eigen::Vector3d& towards, const Eigen::Vector3d& axis, double speed)
      : towards_(towards), speed_(speed) {
    reference::ReferenceInsertion r1 = bench::r1();
    std::vector<physics::SimulationBody> bodies;
    bodies.push_back(r1.body());
    simulation_ = std::make_unique<physics::SimulationLoop>(
        std::move(bodies), physics::SimulationLoopSettings{.dt = 0.040, .lay_contacts = false});
    pose_.orientation = Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), axis);
    pose_.position = from - r1.needle.length * axis;
    physics::HapticLoopSettings settings;
    settings.needle = r1.needle;
    settings.coupling = physics::Coupling::stylet;
    settings.tissues = skin_and_liver();
    haptic_ = std::make_unique<physics::HapticLoop>(settings, pose_);
    patch_ = simulation_->make_patch();
  }

  void simulation_step() { simulation_->step({.needle = &haptic_->state()}, patch_); }
  /// So many milliseconds.
  void hold(int steps) { go_on(steps, 0); }
  void thrust(int steps) { go_on(steps, speed_); }
  void draw_back(int steps) { go_on(steps, -speed_); }

  const physics::NeedleState& needle() const { return haptic_->state(); }
  double peak() const { return peak_; }
  double jump() const { return jump_; }  ///< largest change of the force in a step, N
  double deepest_untouched() const { return deepest_untouched_; }
  std::uint32_t flags() const { return flags_; }

private:
  void go_on(int steps, double speed) {
    for (int i = 0; i < steps; ++i) {
      pose_.position += 1e-3 * speed * towards_;
      const physics::NeedleState& s = haptic_->step(pose_, 1e-3, patch_);
      jump_ = std::max(jump_, (s.wrench.force - before_).norm());
      before_ = s.wrench.force;
      peak_ = std::max(peak_, before_.norm());
      flags_ |= s.flags;
      const Eigen::Vector3d tip = s.positions.col(s.node_count - 1);
      const double depth = std::min(tip.minCoeff(), (0.1 - tip.array()).minCoeff());
      if (s.tip == physics::TipState::outside) deepest_untouched_ = std::max(deepest_untouched_, depth);
    }
  }

  Eigen::Vector3d towards_;
  double speed_;
  double peak_ = 0;
  double jump_ = 0;
  Eigen::Vector3d before_ = Eigen::Vector3d::Zero();
  double deepest_untouched_ = 0;
  std::uint32_t flags_ = 0;
  std::unique_ptr<physics::SimulationLoop> simulation_;
  std::unique_ptr<physics::HapticLoop> haptic_;
  physics::TissuePatch patch_;
  physics::StylusPose pose_;
};

// From rest in the air to 1 m/s, a patch made just before and the next one 100 ms later: the skin is met wherever the
// axis pointed, and breaks at its force.
TEST(FastNeedle, MeetsTheSkinAtAMetreASecondWhileThePatchIs100MsOld) {
  const Eigen::Vector3d in = Eigen::Vector3d::UnitX();
  for (const double distance : {0.002, 0.010, 0.030, 0.060}) {
    for (const double slant : {0.0, 40.0}) {
      const Eigen::Vector3d axis = Eigen::AngleAxisd(slant * std::numbers::pi / 180, Eigen::Vector3d::UnitZ()) * in;
      Startle startle(Eigen::Vector3d(0, 0.05, 0.06) - distance * axis, axis, axis, 0.999);
      startle.simulation_step();
      startle.hold(1);
      startle.thrust(99);
      std::printf("%2.0f mm before the skin, %2.0f degrees: peak %.2f N, %u punctures, %.1f mm untouched, flags %u\n",
                  1e3 * distance, slant, startle.peak(), startle.needle().puncture_count,
                  1e3 * startle.deepest_untouched(), startle.flags());
      EXPECT_LE(startle.deepest_untouched(), 1.01e-3) << "met in the step in which it is passed";
      EXPECT_EQ(startle.needle().puncture_count, 1U);
      EXPECT_NEAR(startle.needle().last_puncture.force, kSkin, 1e-6);
    }
  }
}

// The hand moves across the needle: its axis never points at what it meets.
TEST(FastNeedle, MeetsWhatItsAxisNeverPointedAt) {
  for (const double speed : {0.1, 0.5, 0.999}) {
    const Eigen::Vector3d axis = Eigen::Vector3d(0.2, 1, 0).normalized();
    Startle startle({-0.005, 0.05, 0.06}, Eigen::Vector3d::UnitX(), axis, speed);
    startle.simulation_step();
    startle.hold(1);
    startle.thrust(static_cast<int>(0.015 / speed * 1e3));
    std::printf("%.1f m/s sideways: %.2f mm untouched, tip %d\n", speed, 1e3 * startle.deepest_untouched(),
                static_cast<int>(startle.needle().tip));
    EXPECT_LE(startle.deepest_untouched(), 1e-3 * speed + 1e-5);
    EXPECT_NE(startle.needle().tip, physics::TipState::outside);
  }
}

// A needle that has lost its track, for want of patches, and is drawn back into a body: its tip comes in backwards.
// It broke in and was out again every third step, 3 N each time. Pushed on from there it cuts, and breaks nothing.
TEST(FastNeedle, ATipThatComesInBackwardsBreaksNothing) {
  const Eigen::Vector3d out = -Eigen::Vector3d::UnitX();
  for (const double slant : {0.0, 30.0}) {
    const Eigen::Vector3d axis = Eigen::AngleAxisd(slant * std::numbers::pi / 180, Eigen::Vector3d::UnitZ()) * out;
    Startle startle({-0.005, 0.05, 0.06}, out, axis, 0.2);
    startle.simulation_step();
    startle.hold(1);
    startle.draw_back(200);
    EXPECT_LT(startle.peak(), 1e-9);
    EXPECT_NE(startle.flags() & physics::kNeedleSurfaceLate, 0U) << "that the track is not known is said";
    startle.simulation_step();
    startle.thrust(100);
    EXPECT_EQ(startle.needle().tip, physics::TipState::inside);
    EXPECT_GT(startle.needle().wrench.force.norm(), 0.5);
    for (int i = 0; i < 8; ++i) {
      startle.simulation_step();
      startle.thrust(40);
    }
    std::printf("%2.0f degrees: peak %.2f N, at most %.3f N in a step, %u punctures, tip %d\n", slant, startle.peak(),
                startle.jump(), startle.needle().puncture_count, static_cast<int>(startle.needle().tip));
    EXPECT_EQ(startle.needle().puncture_count, 0U);
    EXPECT_LT(startle.peak(), kSkin);
    EXPECT_EQ(startle.needle().tip, physics::TipState::outside);
  }
}

/// Largest change of the axial force in a millisecond, less what a run without latency has at most.
double largest_change(const reference::ReferenceInsertion& insertion, int latency_steps) {
  reference::ReferenceExperiment experiment(insertion, {.coupling = physics::Coupling::stylet,
                                                        .tissues = tissue(liver()),
                                                        .latency_steps = latency_steps,
                                                        .worker_period = 5});
  while (experiment.time_s() < insertion.duration - 1e-9) experiment.advance();
  return reference::jump(experiment.forces(), 0);
}

TEST(NeedleTrack, ANewPatchTakesOverOverItsPeriod) {
  // All of the tissue 4 mm further, as a breath has it: the hand does not feel that at once, but all of it after
  // some periods, and of the way there e^-2k after k of them.
  reference::ReferenceExperiment experiment(r1(),
                                            {.coupling = physics::Coupling::stylet, .tissues = tissue(liver())});
  while (experiment.time_s() < 1.0) experiment.advance();
  physics::HapticLoop haptic = experiment.haptic();
  physics::TissuePatch patch = experiment.patch_in_use();
  const physics::StylusPose hub = experiment.insertion().base(experiment.time_s());
  constexpr int kPeriod = 20;
  const auto step = [&](int steps) {
    for (int i = 0; i < steps; ++i) haptic.step(hub, 1e-3, patch);
    return haptic.state().wrench.force;
  };
  for (int k = 0; k < 4; ++k) {  // at rest, and of known period
    ++patch.epoch;
    step(kPeriod);
  }
  const Eigen::Vector3d at_rest = step(0);
  ++patch.epoch;
  patch.bodies[0].free_positions.colwise() += Eigen::Vector3d(0, 4e-3, 0);
  std::vector<Eigen::Vector3d> forces{at_rest};
  for (int i = 0; i < 10 * kPeriod; ++i) forces.push_back(step(1));
  const Eigen::Vector3d whole = forces.back() - at_rest;
  std::printf("4 mm change the force by %.3f N, by %.4f N in the first ms\n", whole.norm(),
              (forces[1] - at_rest).norm());
  ASSERT_GT(whole.norm(), 0.03);
  for (const int steps : {1, kPeriod / 2, kPeriod, 2 * kPeriod}) {
    const double gone_in = (forces[static_cast<std::size_t>(steps)] - at_rest).dot(whole) / whole.squaredNorm();
    EXPECT_NEAR(gone_in, 1 - std::exp(-2.0 * steps / kPeriod), 0.05) << "after " << steps << " ms";
  }
}

TEST(NeedleTrack, ALatePatchDropsNoContact) {
  reference::ReferenceInsertion insertion = r1();
  insertion.nodes_per_edge = kSanitized ? 7 : 20;  // elements of 5 mm: a patch ends soon
  insertion.lateral_amplitude = 0;
  insertion.axial_speed = {{0, 0.1}, {0.8, 0.1}};
  insertion.duration = 0.8;
  insertion.tip_start.x() = -0.005;
  const double prompt = largest_change(insertion, 0);
  for (const int steps : {1, 2, 3}) {
    const double late = largest_change(insertion, steps);
    std::printf("%d ms late: at most %.3f N in 1 ms; without latency %.3f N\n", 20 * steps, late, prompt);
    EXPECT_LT(late, prompt + 0.05);
    // A patch that changes all it has to at once makes 0.22 N of it without latency, 0.3 N late (README eq. 17b,
    // 26c).
    EXPECT_LT(std::max(late, prompt), 0.1);
  }
}

}  // namespace
}  // namespace stylet::bench
