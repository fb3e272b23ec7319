// A chain of beams of any rest shape with dense Newton steps: the plain way, to hold the element against theory.
#pragma once

#include "physics/needle/beam.h"
#include "physics/needle/rotation_vector.h"

#include <Eigen/Cholesky>
#include <Eigen/Dense>

#include <vector>

namespace stylet::physics::testing {

struct BeamChain {
  std::vector<Beam> beams;
  std::vector<BeamEnd> nodes;

  /// Straight along x from the origin, node axes along the global ones.
  static BeamChain straight(int count, double length, const SectionStiffness& section) {
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i <= count; ++i) points.emplace_back(length * i / count, 0, 0);
    return through(points, section);
  }

  /// Unloaded through the given points; the y axes of the elements lie in the xy plane.
  static BeamChain through(const std::vector<Eigen::Vector3d>& points, const SectionStiffness& section) {
    BeamChain chain;
    for (const auto& p : points) chain.nodes.push_back({p, Eigen::Matrix3d::Identity()});
    for (std::size_t i = 0; i + 1 < points.size(); ++i) {
      const Eigen::Vector3d chord = points[i + 1] - points[i];
      const Eigen::Vector3d x = chord.normalized();
      const Eigen::Vector3d y = Eigen::Vector3d::UnitZ().cross(x).normalized();
      Eigen::Matrix3d frame;
      frame << x, y, x.cross(y);
      chain.beams.push_back({chord.norm(), frame, section});
    }
    return chain;
  }

  int dofs() const { return 6 * static_cast<int>(nodes.size()); }

  void assemble(Eigen::MatrixXd& k, Eigen::VectorXd& f) const {
    k.setZero(dofs(), dofs());
    f.setZero(dofs());
    for (int i = 0; i < static_cast<int>(beams.size()); ++i) {
      const BeamResponse r = beam_response(beams[i], nodes[i], nodes[i + 1]);
      k.block<12, 12>(6 * i, 6 * i) += r.tangent;
      f.segment<12>(6 * i) += r.force;
    }
  }

  void move(const Eigen::VectorXd& x) {
    for (std::size_t i = 0; i < nodes.size(); ++i) {
      const auto k = static_cast<Eigen::Index>(6 * i);
      nodes[i].position += x.segment<3>(k);
      nodes[i].orientation = exponential(x.segment<3>(k + 3)).toRotationMatrix() * nodes[i].orientation;
    }
  }

  /// Newton with the first node clamped under a constant load on the last; returns the iterations used.
  int solve(const Vector6d& tip_load, double tolerance, int max_iterations = 40) {
    Eigen::MatrixXd k;
    Eigen::VectorXd f;
    for (int iteration = 1; iteration <= max_iterations; ++iteration) {
      assemble(k, f);
      Eigen::VectorXd residual = -f;
      residual.tail<6>() += tip_load;
      const Eigen::Index n = dofs() - 6;
      Eigen::VectorXd x = Eigen::VectorXd::Zero(dofs());
      x.tail(n) = k.bottomRightCorner(n, n).partialPivLu().solve(residual.tail(n));
      move(x);
      if (x.norm() < tolerance) return iteration;
    }
    return max_iterations + 1;
  }

  Eigen::Vector3d tip() const { return nodes.back().position; }
};

}  // namespace stylet::physics::testing
