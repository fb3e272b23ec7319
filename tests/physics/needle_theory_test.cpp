// Chains of beams against closed-form and published solutions.
#include "tests/physics/needle_beam_chain.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>

#include <cstdio>
#include <numbers>

namespace stylet::physics {
namespace {

using Eigen::Vector3d;
using testing::BeamChain;

TEST(BeamChain, CantileverTipMatchesTimoshenko) {
  for (double slenderness : {2.5, 10.0, 118.0}) {
    for (int count : {1, 3, 8}) {
      const double d = 1.27e-3, length = slenderness * d;
      const SectionStiffness s = tube_section(d, 0.838e-3, 200e9, 0.3);
      const BeamChain chain = BeamChain::straight(count, length, s);
      Eigen::MatrixXd k;
      Eigen::VectorXd f;
      chain.assemble(k, f);
      const Eigen::Index n = chain.dofs() - 6;
      Eigen::VectorXd load = Eigen::VectorXd::Zero(n);
      load[n - 5] = 1;  // 1 N along y: linear, whatever its size
      const double tip = k.bottomRightCorner(n, n).llt().solve(load)[n - 5];
      const double exact = std::pow(length, 3) / (3 * s.bending) + length / s.shear;
      std::printf("L/D %5.1f, %d beams: tip/exact - 1 = %.1e\n", slenderness, count, tip / exact - 1);
      EXPECT_NEAR(tip / exact, 1, 1e-10);
    }
  }
}

TEST(BeamChain, EndMomentRollsUpToACircle) {
  const SectionStiffness s{.axial = 1e4, .shear = 4e3, .bending = 1.0, .torsion = 0.7};
  for (int count : {4, 8, 20}) {
    BeamChain chain = BeamChain::straight(count, 1.0, s);
    Vector6d load = Vector6d::Zero();
    int most = 0;
    for (int step = 1; step <= 20; ++step) {
      load[5] = 2 * std::numbers::pi * s.bending * step / 20;
      most = std::max(most, chain.solve(load, 1e-12));
    }
    std::printf("%d beams: tip %.1e from the start, at most %d iterations a step\n", count, chain.tip().norm(), most);
    EXPECT_LT(chain.tip().norm(), 1e-10);
    EXPECT_LE(most, 8);
  }
}

// Lowest load at which the straight compressed beam's stiffness is singular.
double buckling_load(int count, double length, const SectionStiffness& s) {
  const auto stable = [&](double p) {
    BeamChain chain = BeamChain::straight(count, length, s);
    for (auto& node : chain.nodes) node.position *= 1 - p / s.axial;
    Eigen::MatrixXd k;
    Eigen::VectorXd f;
    chain.assemble(k, f);
    const Eigen::Index n = chain.dofs() - 6;
    return Eigen::LLT<Eigen::MatrixXd>(k.bottomRightCorner(n, n)).info() == Eigen::Success;
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
  double previous = 1;
  for (int count : {4, 8, 16}) {
    const double error = buckling_load(count, 1.0, s) / exact - 1;
    std::printf("%2d beams: load %.4f of Euler's\n", count, 1 + error);
    EXPECT_LT(error, previous / 3.5);  // second order
    previous = error;
    if (count == 8) {
      EXPECT_LT(std::abs(error), 0.004);
    }
  }
}

// Exact elastica (inextensible, no shear), cantilever under a dead tip load with P L^2 / EI = 10.
TEST(BeamChain, ElasticaConvergesWithSecondOrder) {
  const SectionStiffness s{.axial = 1e7, .shear = 1e7, .bending = 1.0, .torsion = 0.7};
  const Vector3d exact(0.445004, 0.810609, 0);
  double previous = 0;
  for (int count : {4, 8, 16}) {
    BeamChain chain = BeamChain::straight(count, 1.0, s);
    Vector6d load = Vector6d::Zero();
    for (int step = 1; step <= 10; ++step) {
      load[1] = step;
      ASSERT_LE(chain.solve(load, 1e-11), 12);
    }
    const double error = (chain.tip() - exact).norm();
    std::printf("%2d beams: tip error %.2e of the length\n", count, error);
    if (previous > 0) {
      EXPECT_LT(error, previous / 3);
    }
    previous = error;
  }
  EXPECT_LT(previous, 2e-3);
}

// Bathe and Bolourchi's 45 degree bend, R = 100, 1 x 1 section, E = 1e7, nu = 0, J = 1/6, out-of-plane load 600.
// Reference: the geometrically exact (Simo-Reissner) solution, (x, y, z) = (47.15009624, 15.68468948, 53.47547800).
TEST(BeamChain, FortyFiveDegreeBendMatchesGeometricallyExactSolution) {
  const SectionStiffness s{.axial = 1e7, .shear = 5e6 * 5 / 6, .bending = 1e7 / 12, .torsion = 5e6 / 6};
  const Vector3d exact(47.15009624, 15.68468948, 53.47547800);
  const Vector3d unloaded(100 * std::sin(std::numbers::pi / 4), 100 * (1 - std::cos(std::numbers::pi / 4)), 0);
  double previous = 0;
  for (int count : {4, 8, 16}) {
    std::vector<Vector3d> points;
    for (int i = 0; i <= count; ++i) {
      const double angle = std::numbers::pi / 4 * i / count;
      points.emplace_back(100 * std::sin(angle), 100 * (1 - std::cos(angle)), 0);
    }
    BeamChain chain = BeamChain::through(points, s);
    Vector6d load = Vector6d::Zero();
    for (int step = 1; step <= 6; ++step) {
      load[2] = 100 * step;
      ASSERT_LE(chain.solve(load, 1e-8), 15);
    }
    const double error = (chain.tip() - exact).norm() / (exact - unloaded).norm();
    std::printf("%2d beams: tip (%.4f, %.4f, %.4f), %.3f %% of the displacement off\n", count, chain.tip().x(),
                chain.tip().y(), chain.tip().z(), 100 * error);
    if (count == 8) {
      EXPECT_LT(error, 0.0012);
    }
    if (previous > 0) {
      EXPECT_LT(error, previous / 3.5);
    }
    previous = error;
  }
}

}  // namespace
}  // namespace stylet::physics
