// Rotation vectors: exponential, logarithm and their differentials.
#include "physics/needle/rotation_vector.h"
#include "physics/messages/messages.h"
#include "tests/support/random.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>

#include <algorithm>
#include <cstdio>

namespace stylet::physics {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using support::Random;

TEST(RotationVector, LogarithmInvertsExponential) {
  Random random(1);
  double worst = 0;
  for (double scale : {1e-9, 1e-5, 1e-2, 1.0, 1.8}) {
    for (int i = 0; i < 100; ++i) {
      const Vector3d w = random.vector(scale);
      worst = std::max(worst, (logarithm(exponential(w)) - w).norm() / w.norm());
      worst = std::max(
          worst, (exponential(w).toRotationMatrix() - Eigen::AngleAxisd(w.norm(), w.normalized()).toRotationMatrix())
                         .norm() /
                     10);
    }
  }
  std::printf("worst relative error %.2e\n", worst);
  EXPECT_LT(worst, 1e-14);
}

TEST(RotationVector, DifferentialsMatchDifferences) {
  Random random(2);
  double worst = 0;
  for (double scale : {1e-3, 0.28, 0.3, 0.8, 1.5}) {  // both sides of the switch from series to closed form
    for (int i = 0; i < 50; ++i) {
      const Vector3d w = random.vector(scale);
      const Vector3d m = random.vector(1);
      Matrix3d change, moment_change;
      const double h = 1e-3;
      for (int k = 0; k < 3; ++k) {
        const auto at = [&](double s) { return logarithm(exponential(s * Vector3d::Unit(k)) * exponential(w)); };
        change.col(k) = (8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h);
        const auto mt = [&](double s) -> Vector3d {
          return inverse_tangent(w + s * Vector3d::Unit(k)).transpose() * m;
        };
        moment_change.col(k) = (8 * (mt(h) - mt(-h)) - (mt(2 * h) - mt(-2 * h))) / (12 * h);
      }
      worst = std::max({worst, (inverse_tangent(w) - change).norm(),
                        (inverse_tangent_transpose_derivative(w, m) - moment_change).norm()});
    }
  }
  std::printf("worst error %.2e\n", worst);
  EXPECT_LT(worst, 1e-10);
}

TEST(RotationBetween, TakesOneDirectionToTheOtherByTheSmallestAngle) {
  Random random(3);
  for (int i = 0; i < 200; ++i) {
    const Vector3d from = random.vector(2);
    const Vector3d to = i % 4 == 0   ? Vector3d(-3 * from)
                        : i % 4 == 1 ? Vector3d(-from + random.vector(1e-9))
                                     : random.vector(2);
    const Eigen::Quaterniond rotation = rotation_between(from, to);
    EXPECT_NEAR(rotation.norm(), 1, 1e-14);
    EXPECT_LT((rotation * from.normalized() - to.normalized()).norm(), 1e-7);
    const double angle = std::atan2(from.cross(to).norm(), from.dot(to));
    EXPECT_NEAR(2 * std::acos(std::abs(rotation.w())), angle, 1e-6);
  }
}

}  // namespace
}  // namespace stylet::physics
