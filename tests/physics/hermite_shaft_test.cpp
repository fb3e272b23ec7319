// The smooth shaft: cubic between nodes, its rows and directions.
#include "physics/contact/hermite_shaft.h"
#include "physics/needle/rotation_vector.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>

namespace stylet::physics {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kBeam = 0.01875;

/// A needle bent to an arc of the given curvature in a plane turned by `roll` about the axis.
NeedleShape arc(double curvature, double roll = 0.3) {
  NeedleShape shape = straight_needle({}, {});
  const Vector3d normal(std::cos(roll), std::sin(roll), 0);
  for (int i = 0; i < shape.node_count; ++i) {
    const double angle = curvature * kBeam * i;
    shape.positions.col(i) = Vector3d(0, 0, std::sin(angle)) / curvature + (1 - std::cos(angle)) / curvature * normal;
    shape.orientations[i] = exponential(angle * Vector3d::UnitZ().cross(normal));
  }
  return shape;
}

TEST(HermiteShaft, FollowsAnArcBetweenTheNodes) {
  const double curvature = 5;  // 1/m: a needle bent by tissue
  const NeedleShape shape = arc(curvature);
  const HermiteShaft shaft(shape, kBeam);
  const Vector3d normal(std::cos(0.3), std::sin(0.3), 0);
  double worst = 0;
  for (int beam = 0; beam < shaft.beams(); ++beam) {
    for (double f = 0; f <= 1; f += 0.125) {
      const double angle = curvature * kBeam * (beam + f);
      const Vector3d exact = Vector3d(0, 0, std::sin(angle)) / curvature + (1 - std::cos(angle)) / curvature * normal;
      worst = std::max(worst, (shaft.at(beam, f).position - exact).norm());
    }
  }
  const double sagitta = curvature * kBeam * kBeam / 8;
  std::printf("off the arc by at most %.2e m; a straight edge is off by %.2e m\n", worst, sagitta);
  EXPECT_LT(worst, sagitta / 100);
}

TEST(HermiteShaft, TangentsAndDirectionsHaveNoKinkAtANode) {
  const NeedleShape shape = arc(5);
  const HermiteShaft shaft(shape, kBeam);
  for (int node = 1; node < shaft.beams(); ++node) {
    const ShaftPoint before = shaft.at(node - 1, 1);
    const ShaftPoint after = shaft.at(node, 0);
    EXPECT_LT((before.position - after.position).norm(), 1e-15);
    EXPECT_LT((before.tangent - after.tangent).norm(), 1e-14);
    EXPECT_LT((shaft.lateral_directions(before) - shaft.lateral_directions(after)).norm(), 1e-14);
    const auto frame = shaft.lateral_directions(shaft.at(node, 0.4));
    EXPECT_LT((frame.transpose() * frame - Eigen::Matrix2d::Identity()).norm(), 1e-14);
    EXPECT_LT((frame.transpose() * shaft.at(node, 0.4).tangent).norm(), 1e-14);
  }
}

TEST(HermiteShaft, RowsAreTheDerivativeOfThePosition) {
  std::mt19937 engine(7);
  std::uniform_real_distribution<double> u(-1, 1);
  const NeedleShape shape = arc(4);
  const HermiteShaft shaft(shape, kBeam);
  double worst = 0;
  for (int trial = 0; trial < 50; ++trial) {
    const int beam = trial % shaft.beams();
    const double fraction = 0.5 + 0.5 * u(engine);
    Eigen::VectorXd motion(6 * shape.node_count);
    for (auto& m : motion) m = u(engine);
    const ShaftPoint here = shaft.at(beam, fraction);
    Vector3d predicted = Vector3d::Zero();
    for (int side = 0; side < 2; ++side) {
      predicted += here.weights[side] * motion.segment<3>(6 * (beam + side)) +
                   motion.segment<3>(6 * (beam + side) + 3).cross(here.arms[side]);
    }
    const double h = 1e-5;
    NeedleShape forward = shape, backward = shape;
    move(forward, h * motion);
    move(backward, -h * motion);
    const Vector3d moved = (HermiteShaft(forward, kBeam).at(beam, fraction).position -
                            HermiteShaft(backward, kBeam).at(beam, fraction).position) /
                           (2 * h);
    worst = std::max(worst, (moved - predicted).norm() / predicted.norm());
  }
  std::printf("relative difference %.1e\n", worst);
  EXPECT_LT(worst, 1e-8);
}

TEST(HermiteShaft, ProjectionFindsThePointFromAnyGuess) {
  const NeedleShape shape = arc(6);
  const HermiteShaft shaft(shape, kBeam);
  for (double s = 0.001; s < shaft.length(); s += 0.0047) {
    const int beam = static_cast<int>(s / kBeam);
    const ShaftPoint at = shaft.at(beam, s / kBeam - beam);
    const Vector3d off = at.position + 3e-3 * shaft.lateral_directions(at).col(1);
    for (const double guess : {0.0, s - 1e-4, s + 0.02, shaft.length()}) {
      double arc_length = -1;
      const ShaftPoint found = shaft.project(off, guess, arc_length);
      EXPECT_NEAR(arc_length, s, 1e-9) << "from " << guess;
      EXPECT_NEAR(found.distance, 3e-3, 1e-9);
      EXPECT_FALSE(found.ahead_of_tip || found.behind_hub);
    }
  }
  double arc_length = 0;
  const ShaftPoint beyond = shaft.project(shaft.tip() + 2e-3 * shaft.tip_tangent(), 0.1, arc_length);
  EXPECT_TRUE(beyond.ahead_of_tip);
  EXPECT_NEAR(arc_length, shaft.length() + 2e-3, 1e-12);
}

// The edges of the paper under the rows of this coupling, to compare with.
TEST(HermiteShaft, WithStraightEdgesIsThePapersShaft) {
  const double curvature = 5;
  const NeedleShape shape = arc(curvature);
  const HermiteShaft shaft(shape, kBeam, true);
  for (int beam = 0; beam < shaft.beams(); ++beam) {
    const Vector3d edge = shape.positions.col(beam + 1) - shape.positions.col(beam);
    const ShaftPoint at = shaft.at(beam, 0.3);
    EXPECT_LT((at.position - shape.positions.col(beam) - 0.3 * edge).norm(), 1e-15);
    EXPECT_LT(at.tangent.cross(edge).norm(), 1e-15);
    EXPECT_EQ(at.arms[0].norm() + at.arms[1].norm(), 0);  // loads the nodes with forces alone
    const auto across = shaft.lateral_directions(at);
    EXPECT_LT((across.transpose() * edge).norm(), 1e-15);
    double arc_length = 0;
    shaft.project(at.position + 1e-3 * across.col(0), 0.1, arc_length);
    EXPECT_NEAR(arc_length, (beam + 0.3) * kBeam, 1e-12);
  }
  for (int node = 1; node < shaft.beams(); ++node) {  // a kink at every node, by the angle between two chords
    const double angle = std::acos(shaft.at(node - 1, 1).tangent.dot(shaft.at(node, 0).tangent));
    EXPECT_NEAR(angle, curvature * kBeam, 1e-6);
  }
  const Vector3d along = shaft.at_tip().tangent;
  double arc_length = 0;
  EXPECT_TRUE(shaft.project(shaft.tip() + 2e-3 * along, 0, arc_length).ahead_of_tip);
  EXPECT_NEAR(arc_length, shaft.length() + 2e-3, 1e-12);
}

}  // namespace
}  // namespace stylet::physics
