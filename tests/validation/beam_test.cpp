// Chains of beams against closed-form and exactly integrated solutions.
#include "tests/support/beam_chain.h"
#include "tests/validation/residual.h"
#include "tools/reference/dense_algebra.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>
#include <vector>

namespace stylet::physics {
namespace {

using Eigen::Vector3d;
using support::BeamChain;
using validation::report_residual;

// The element's phi makes it exact at its nodes, whatever their spacing: stocky, slender, graded 1.5 : 1.
TEST(BeamChain, CantileverTipMatchesTimoshenko) {
  double worst = 0;
  for (const double slenderness : {2.5, 10.0, 118.0}) {
    for (const int count : {1, 3, 8}) {
      for (const double grading : {1.0, 1.5, 0.7}) {
        const double d = 1.27e-3, length = slenderness * d;
        const SectionStiffness s = tube_section(d, 0.838e-3, 200e9, 0.3);
        const BeamChain chain = BeamChain::straight(count, length, s, grading);
        Eigen::MatrixXd k;
        Eigen::VectorXd f;
        chain.assemble(k, f);
        Eigen::VectorXd load = Eigen::VectorXd::Zero(k.rows());
        load[k.rows() - 5] = 1;  // 1 N along y: linear, whatever its size
        const double tip = reference::solve(k, load)(k.rows() - 5, 0);
        const double exact = std::pow(length, 3) / (3 * s.bending) + length / s.shear;
        worst = std::max(worst, std::abs(tip / exact - 1));
      }
    }
  }
  report_residual("cantilever tip over PL^3/3EI + PL/kGA, less 1", worst, 1e-10);
}

TEST(BeamChain, EndMomentRollsUpToACircle) {
  const SectionStiffness s{.axial = 1e4, .shear = 4e3, .bending = 1.0, .torsion = 0.7};
  for (const int count : {4, 8, 20}) {
    BeamChain chain = BeamChain::straight(count, 1.0, s);
    Vector6d load = Vector6d::Zero();
    int most = 0;
    for (int step = 1; step <= 20; ++step) {
      load[5] = 2 * std::numbers::pi * s.bending * step / 20;
      most = std::max(most, chain.solve(load, 1e-12));
    }
    report_residual("roll-up with " + std::to_string(count) + " beams, tip from the start", chain.tip().norm(),
                    1e-10);
    EXPECT_LE(most, 8) << "Newton iterations a step";
  }
}

/// Lowest load at which the straight compressed beam's stiffness is singular.
double buckling_load(int count, double length, const SectionStiffness& s) {
  const auto stable = [&](double p) {
    BeamChain chain = BeamChain::straight(count, length, s);
    for (auto& node : chain.nodes) node.position *= 1 - p / s.axial;
    return chain.is_stable();
  };
  double low = 0, high = 40 * s.bending / (length * length);
  EXPECT_TRUE(stable(low));
  EXPECT_FALSE(stable(high));
  for (int i = 0; i < 50; ++i) (stable(0.5 * (low + high)) ? low : high) = 0.5 * (low + high);
  return low;
}

TEST(BeamChain, BucklesAtTheEulerLoad) {
  const SectionStiffness s{.axial = 1e8, .shear = 4e7, .bending = 1.0, .torsion = 0.7};
  const double exact = std::pow(std::numbers::pi, 2) / 4;
  double previous = 0;
  for (const int count : {4, 8, 16}) {
    const double error = std::abs(buckling_load(count, 1.0, s) / exact - 1);
    if (previous > 0) std::printf("  observed order %.2f\n", std::log2(previous / error));
    report_residual("Euler load with " + std::to_string(count) + " beams, relative", error,
                    previous > 0 ? std::min(previous / 3.5, 4e-3) : 2e-2);  // second order, and 0.4 % with 8
    previous = error;
  }
}

// Exact elastica (inextensible, no shear): cantilever under a dead tip load, P L^2 / EI = 1, 2, 5, 10.
TEST(BeamChain, ElasticaConvergesWithSecondOrder) {
  const SectionStiffness s{.axial = 1e7, .shear = 1e7, .bending = 1.0, .torsion = 0.7};
  const struct {
    double load;
    Vector3d tip;
  } rows[] = {{1, {.943567, .301721, 0}},
              {2, {.839358, .493457, 0}},
              {5, {.612372, .713792, 0}},
              {10, {.445004, .810609, 0}}};
  for (const auto& row : rows) {
    double previous = 0;
    for (const int count : {8, 16, 32}) {
      BeamChain chain = BeamChain::straight(count, 1.0, s);
      Vector6d load = Vector6d::Zero();
      for (int step = 1; step <= 10; ++step) {
        load[1] = row.load * step / 10;
        ASSERT_LE(chain.solve(load, 1e-11), 12);
      }
      const double error = (chain.tip() - row.tip).norm();
      if (previous > 0) {
        report_residual("elastica, PL^2/EI = " + std::to_string(static_cast<int>(row.load)) + ", " +
                            std::to_string(count) + " beams, 2 less observed order",
                        2 - std::log2(previous / error), 0.2);
      }
      previous = error;
    }
    report_residual("elastica, PL^2/EI = " + std::to_string(static_cast<int>(row.load)) + ", 32 beams, tip error / L",
                    previous, 1.5e-4);
  }
}

constexpr double kRadius = 100;

/// Bathe and Bolourchi's bend: an eighth of a circle in the xy plane, 1 x 1 section, E = 1e7, nu = 0, J = 1/6.
BeamChain eighth_of_a_circle(int count) {
  const SectionStiffness s{.axial = 1e7, .shear = 5e6 * 5 / 6, .bending = 1e7 / 12, .torsion = 5e6 / 6};
  std::vector<Vector3d> points;
  for (int i = 0; i <= count; ++i) {
    const double angle = std::numbers::pi / 4 * i / count;
    points.emplace_back(kRadius * std::sin(angle), kRadius * (1 - std::cos(angle)), 0);
  }
  return BeamChain::through(points, s);
}

// Loads of 300 and 600 out of the plane. Reference: the geometrically exact (Simo-Reissner) beam, integrated by
// shooting to 1e-11.
TEST(BeamChain, FortyFiveDegreeBendMatchesGeometricallyExactSolution) {
  const struct {
    double load;
    Vector3d tip;
  } rows[] = {{300, {58.77889733, 22.24467943, 40.19239233}}, {600, {47.15009624, 15.68468948, 53.47547800}}};
  for (const auto& row : rows) {
    double previous = 0;
    for (const int count : {4, 8, 16, 32}) {
      BeamChain chain = eighth_of_a_circle(count);
      const double displacement = (row.tip - chain.tip()).norm();
      Vector6d load = Vector6d::Zero();
      for (int step = 1; step <= 6; ++step) {
        load[2] = row.load * step / 6;
        ASSERT_LE(chain.solve(load, 1e-8), 15);
      }
      const double error = (chain.tip() - row.tip).norm() / displacement;
      if (previous > 0) {
        const double order = std::log2(previous / error);
        std::printf("  observed order %.2f\n", order);
        EXPECT_NEAR(order, 2, 0.15);
      }
      report_residual("bend under " + std::to_string(static_cast<int>(row.load)) + " with " + std::to_string(count) +
                          " beams, tip error / displacement",
                      error, count == 4 ? 5e-3 : 1.2e-3);
      previous = error;
    }
  }
}

// The whole loaded bend seen from elsewhere: clamp, rest shape and load turned by 160 degrees and moved far away.
TEST(BeamChain, IsObjectiveUnderLargeRigidRotation) {
  const Eigen::Matrix3d q = Eigen::AngleAxisd(2.8, Vector3d(0.4, -1, 0.7).normalized()).toRotationMatrix();
  const Vector3d shift(300, -200, 500);
  BeamChain here = eighth_of_a_circle(8), there = here;
  for (auto& node : there.nodes) node = {q * node.position + shift, q * node.orientation};
  Vector6d load = Vector6d::Zero(), turned = load;
  for (int step = 1; step <= 6; ++step) {
    load[2] = 100.0 * step;
    turned.head<3>() = q * load.head<3>();
    ASSERT_LE(here.solve(load, 1e-9), 15);
    ASSERT_LE(there.solve(turned, 1e-9), 15);
  }
  double worst = 0;
  for (std::size_t i = 0; i < here.nodes.size(); ++i) {
    worst = std::max(worst, (there.nodes[i].position - q * here.nodes[i].position - shift).norm() / kRadius);
    worst = std::max(worst, (there.nodes[i].orientation - q * here.nodes[i].orientation).norm());
  }
  // Not the rounding itself but what the condition of the stiffness (about 1e6) makes of it.
  report_residual("loaded bend after a rigid motion of 2.8 rad, poses of all nodes", worst, 1e-11);
}

}  // namespace
}  // namespace stylet::physics
