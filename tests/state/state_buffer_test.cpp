#include "engine/state/state_buffer.h"
#include "tests/support/allocation_count.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>

namespace stylet::state {
namespace {

FrameState prototype(std::size_t nodes = 20, std::size_t needle_nodes = 5) {
  FrameState state;
  state.bodies.resize(2);
  for (auto& body : state.bodies) body.resize(nodes, Eigen::Vector3f::Zero());
  state.needle_positions.resize(needle_nodes, Eigen::Vector3f::Zero());
  state.needle_orientations.resize(needle_nodes, Eigen::Quaternionf::Identity());
  state.targets.resize(2);
  return state;
}

/// A known motion: accelerating nodes, a needle turning about x, ramps for the scalars.
FrameState motion_at(double t, std::uint64_t step) {
  FrameState state = prototype();
  state.time_s = t;
  state.simulation_step = step;
  state.haptic_step = 20 * step;
  for (std::size_t b = 0; b < state.bodies.size(); ++b) {
    for (std::size_t i = 0; i < state.bodies[b].size(); ++i) {
      const double phase = static_cast<double>(b) + 0.3 * static_cast<double>(i);
      state.bodies[b][i] =
          Eigen::Vector3d(0.01 * std::sin(5 * t + phase), 0.02 * std::cos(3 * t + phase), 0.1 * t).cast<float>();
    }
  }
  for (std::size_t i = 0; i < state.needle_positions.size(); ++i) {
    state.needle_positions[i] = Eigen::Vector3d(0, 0, 0.05 * t * t + 0.01 * static_cast<double>(i)).cast<float>();
    state.needle_orientations[i] =
        Eigen::Quaternionf(Eigen::AngleAxisf(static_cast<float>(0.8 * t), Eigen::Vector3f::UnitX()));
  }
  state.probe_position = Eigen::Vector3d(t, -t, 2 * t).cast<float>();
  state.probe_orientation =
      Eigen::Quaternionf(Eigen::AngleAxisf(static_cast<float>(-0.3 * t), Eigen::Vector3f::UnitZ()));
  state.breath = Eigen::Vector3d(0, -0.01 * t, 0).cast<float>();
  state.force = Eigen::Vector3d(0.5 * t, 0, -t).cast<float>();
  state.force_scale = static_cast<float>(0.2 + 0.3 * t);
  state.force_clipped = static_cast<float>(0.4 * t);
  state.insertion_depth = static_cast<float>(0.03 * t);
  for (TargetState& target : state.targets) {
    target.centre = Eigen::Vector3d(t, 0, 2 * t).cast<float>();
    target.distance = static_cast<float>(0.08 - 0.03 * t);
  }
  state.probe_force = static_cast<float>(3 + t);
  state.probe_area = static_cast<float>(1e-3 * t);
  state.probe_lifted = static_cast<float>(0.1 * t);
  return state;
}

void expect_equal(const FrameState& a, const FrameState& b) {
  EXPECT_EQ(a.time_s, b.time_s);
  EXPECT_EQ(a.simulation_step, b.simulation_step);
  EXPECT_EQ(a.haptic_step, b.haptic_step);
  EXPECT_EQ(a.bodies, b.bodies);
  EXPECT_EQ(a.needle_positions, b.needle_positions);
  for (std::size_t i = 0; i < a.needle_orientations.size(); ++i) {
    EXPECT_EQ(a.needle_orientations[i].coeffs(), b.needle_orientations[i].coeffs());
  }
  EXPECT_EQ(a.probe_position, b.probe_position);
  EXPECT_EQ(a.probe_orientation.coeffs(), b.probe_orientation.coeffs());
  EXPECT_EQ(a.breath, b.breath);
  EXPECT_EQ(a.force, b.force);
  EXPECT_EQ(a.force_scale, b.force_scale);
  EXPECT_EQ(a.force_clipped, b.force_clipped);
  EXPECT_EQ(a.insertion_depth, b.insertion_depth);
  ASSERT_EQ(a.targets.size(), b.targets.size());
  for (std::size_t t = 0; t < a.targets.size(); ++t) {
    EXPECT_EQ(a.targets[t].centre, b.targets[t].centre);
    EXPECT_EQ(a.targets[t].distance, b.targets[t].distance);
  }
  EXPECT_EQ(a.probe_force, b.probe_force);
  EXPECT_EQ(a.probe_area, b.probe_area);
  EXPECT_EQ(a.probe_lifted, b.probe_lifted);
}

TEST(StateBuffer, EmptyGivesNoneAndLeavesTheFrameAlone) {
  StateBuffer buffer(prototype());
  FrameState frame = motion_at(3, 7);
  const FrameStamps stamps = buffer.sample(1, frame);
  EXPECT_EQ(stamps.provenance, Provenance::none);
  expect_equal(frame, motion_at(3, 7));
  EXPECT_EQ(buffer.newest_s(), -std::numeric_limits<double>::infinity());
}

TEST(StateBuffer, PublishedTimeGivesExactlyThePublishedState) {
  StateBuffer buffer(prototype(), 8);
  for (std::uint64_t k = 1; k <= 20; ++k) ASSERT_TRUE(buffer.publish(motion_at(0.02 * static_cast<double>(k), k)));
  FrameState frame = buffer.make_frame();
  for (std::uint64_t k = 15; k <= 20; ++k) {  // the six offered ones of eight
    const double t = 0.02 * static_cast<double>(k);
    const FrameStamps stamps = buffer.sample(t, frame);
    EXPECT_EQ(stamps.provenance, Provenance::exact);
    EXPECT_EQ(stamps.earlier_s, t);
    EXPECT_EQ(stamps.later_step, k);
    expect_equal(frame, motion_at(t, k));
  }
  EXPECT_EQ(buffer.newest_s(), 0.4);
}

TEST(StateBuffer, OutsideIsHeldAtTheNearest) {
  StateBuffer buffer(prototype(), 8);
  for (std::uint64_t k = 1; k <= 20; ++k) buffer.publish(motion_at(0.02 * static_cast<double>(k), k));
  FrameState frame = buffer.make_frame();
  EXPECT_EQ(buffer.sample(0.5, frame).provenance, Provenance::held);
  expect_equal(frame, motion_at(0.02 * 20, 20));
  const FrameStamps before = buffer.sample(0.01, frame);
  EXPECT_EQ(before.provenance, Provenance::held);
  EXPECT_EQ(before.earlier_step, 15u);
  expect_equal(frame, motion_at(0.02 * 15, 15));
  EXPECT_EQ(buffer.sample(std::nan(""), frame).earlier_step, 20u);
}

TEST(StateBuffer, BetweenTwoStatesNamesBothAndKeepsTheTimeAskedFor) {
  StateBuffer buffer(prototype());
  for (std::uint64_t k = 1; k <= 5; ++k) buffer.publish(motion_at(static_cast<double>(k), k));
  FrameState frame = buffer.make_frame();
  const FrameStamps stamps = buffer.sample(3.25, frame);
  EXPECT_EQ(stamps.provenance, Provenance::interpolated);
  EXPECT_EQ(stamps.earlier_s, 3.0);
  EXPECT_EQ(stamps.later_s, 4.0);
  EXPECT_EQ(stamps.earlier_step, 3u);
  EXPECT_EQ(stamps.later_step, 4u);
  EXPECT_EQ(frame.time_s, 3.25);
  EXPECT_EQ(frame.haptic_step, 60u);
  // What moves evenly is met exactly (to float rounding).
  EXPECT_NEAR(frame.insertion_depth, 0.03 * 3.25, 1e-7);
  EXPECT_NEAR(frame.force.z(), -3.25, 1e-6);
  EXPECT_NEAR(frame.probe_position.z(), 6.5, 2e-6);
  // An even turn too: slerp, not a blend of components.
  for (const Eigen::Quaternionf& q : frame.needle_orientations) {
    EXPECT_NEAR(Eigen::AngleAxisf(q).angle(), 0.8 * 3.25, 1e-6);
    EXPECT_NEAR(q.norm(), 1, 1e-6);
  }
}

TEST(StateBuffer, InterpolationErrorIsWithinTheBound) {
  // |error| <= a h^2 / 8 for acceleration at most a. Here each coordinate of the bodies is a sine or cosine, so
  // a = sqrt((0.01 * 25)^2 + (0.02 * 9)^2) at most, plus float rounding.
  const double a = std::hypot(0.01 * 25, 0.02 * 9);
  for (const double h : {0.01, 0.02, 0.04}) {
    StateBuffer buffer(prototype(), 200);
    for (std::uint64_t k = 0; k < 100; ++k) buffer.publish(motion_at(h * static_cast<double>(k), k));
    FrameState frame = buffer.make_frame();
    double worst = 0;
    for (double t = 0; t < h * 98; t += 0.37 * h) {
      buffer.sample(t, frame);
      const FrameState truth = motion_at(t, 0);
      for (std::size_t b = 0; b < truth.bodies.size(); ++b) {
        for (std::size_t i = 0; i < truth.bodies[b].size(); ++i) {
          worst = std::max(worst, double{(frame.bodies[b][i] - truth.bodies[b][i]).norm()});
        }
      }
    }
    EXPECT_LE(worst, a * h * h / 8 + 3e-8) << h;
    EXPECT_GE(worst, 0.5 * a * h * h / 8) << h;  // the bound is not just far away
  }
}

TEST(StateBuffer, RefusesTimesThatDoNotAdvance) {
  StateBuffer buffer(prototype());
  EXPECT_TRUE(buffer.publish(motion_at(1, 1)));
  EXPECT_FALSE(buffer.publish(motion_at(1, 2)));
  EXPECT_FALSE(buffer.publish(motion_at(0.5, 3)));
  FrameState bad = motion_at(2, 4);
  bad.time_s = std::nan("");
  EXPECT_FALSE(buffer.publish(bad));
  FrameState frame = buffer.make_frame();
  buffer.sample(9, frame);
  EXPECT_EQ(frame.simulation_step, 1u);
}

TEST(StateBuffer, NeverAllocatesAfterConstruction) {
  StateBuffer buffer(prototype());
  FrameState frame = buffer.make_frame();
  FrameState state = motion_at(0, 0);
  const tests::AllocationCount allocations;
  for (int k = 1; k <= 50; ++k) {
    state.time_s = 0.02 * k;
    buffer.publish(state);
    buffer.sample(0.02 * k - 0.013, frame);
    buffer.sample(0.02 * k, frame);
    buffer.sample(1e9, frame);
  }
  EXPECT_EQ(allocations.value(), 0);
  const FrameState copy = state;
  EXPECT_GT(allocations.value(), 0);  // the counter counts
}

TEST(StateBufferDeathTest, OtherSizesAreABug) {
  StateBuffer buffer(prototype(20));
  FrameState other = prototype(21);
  EXPECT_DEATH(buffer.publish(other), "state buffer: a published state has 2 bodies");
  EXPECT_DEATH(buffer.sample(0, other), "the frame to fill");
}

}  // namespace
}  // namespace stylet::state
