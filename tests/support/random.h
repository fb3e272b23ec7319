// Seeded vectors and rotations for tests that try many.
#pragma once

#include <Eigen/Geometry>

#include <random>

namespace stylet::support {

class Random {
public:
  explicit Random(unsigned seed) : engine_(seed) {}
  /// Each component in [-scale, scale).
  Eigen::Vector3d vector(double scale) {
    std::uniform_real_distribution<double> u(-scale, scale);
    return {u(engine_), u(engine_), u(engine_)};
  }
  /// By `angle` rad about a random axis.
  Eigen::Matrix3d rotation(double angle) {
    return Eigen::AngleAxisd(angle, vector(1).normalized()).toRotationMatrix();
  }

private:
  std::mt19937 engine_;
};

}  // namespace stylet::support
