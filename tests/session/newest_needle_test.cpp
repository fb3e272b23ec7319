// The needle of a picture, replaced by the one of the haptic loop.
#include "engine/session/newest_needle.h"

#include <gtest/gtest.h>

#include <thread>

namespace stylet::session {
namespace {

state::FrameState rest(std::size_t nodes) {
  state::FrameState state;
  state.needle_positions.assign(nodes, Eigen::Vector3f::Zero());
  state.needle_orientations.assign(nodes, Eigen::Quaternionf::Identity());
  return state;
}

/// Every coordinate of every node is `value`.
physics::NeedleState needle(int nodes, double value) {
  physics::NeedleState needle;
  needle.node_count = nodes;
  needle.positions.setConstant(3, nodes, value);
  const Eigen::Quaterniond turn(Eigen::AngleAxisd(value, Eigen::Vector3d::UnitX()));
  needle.orientations.assign(nodes, turn);
  return needle;
}

TEST(NewestNeedle, ReplacesTheNeedleOnceThereIsOne) {
  NewestNeedle newest(rest(9));
  state::FrameState shown = rest(9);
  shown.needle_positions.front().setConstant(7);
  newest.show(shown.needle_positions, shown.needle_orientations);
  EXPECT_EQ(shown.needle_positions.front().x(), 7) << "before the first step";
  newest.haptic_stepped({}, needle(9, 0.5));
  newest.haptic_stepped({}, needle(9, 0.25));
  for (int frame = 0; frame < 2; ++frame) {  // shown again while nothing newer comes
    shown = rest(9);
    newest.show(shown.needle_positions, shown.needle_orientations);
    for (std::size_t i = 0; i < 9; ++i) {
      EXPECT_EQ(shown.needle_positions[i], Eigen::Vector3f::Constant(0.25F));
      EXPECT_FLOAT_EQ(shown.needle_orientations[i].x(), std::sin(0.125F));
    }
  }
  state::FrameState none = rest(0);  // a picture without a needle keeps none
  newest.show(none.needle_positions, none.needle_orientations);
  EXPECT_TRUE(none.needle_positions.empty());
}

TEST(NewestNeedle, IsNeverTornBetweenThreads) {
  NewestNeedle newest(rest(9));
  constexpr int kSteps = 20'000;
  std::jthread loop([&] {
    physics::NeedleState state = needle(9, 0);
    for (int step = 1; step <= kSteps; ++step) {
      state.positions.setConstant(step);
      newest.haptic_stepped({}, state);
    }
  });
  state::FrameState shown = rest(9);
  float last = 0;
  while (last < kSteps) {
    newest.show(shown.needle_positions, shown.needle_orientations);
    const float value = shown.needle_positions.front().x();
    ASSERT_GE(value, last);
    last = value;
    for (const Eigen::Vector3f& node : shown.needle_positions) ASSERT_EQ(node, Eigen::Vector3f::Constant(value));
  }
}

}  // namespace
}  // namespace stylet::session
