// A chain of beams of any rest shape, clamped at its first node: what holds the element against theory.
#pragma once

#include "physics/needle/beam.h"

#include <Eigen/Core>

#include <span>
#include <vector>

namespace stylet::support {

/// Free-standing chain with Newton steps of its own (the needle itself has a straight shaft, a circular section and a
/// moving hub). Node frames are the global axes at rest. SI, or any consistent units.
struct BeamChain {
  /// A beam from node i to i + 1. `offset` is where it runs beside the nodes, in their frames, on rigid arms.
  struct Member {
    std::size_t node = 0;
    physics::Beam beam;
    Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  };
  std::vector<physics::BeamEnd> nodes;
  std::vector<Member> members;

  /// Unloaded through the given points; the y axes of the elements lie in the xy plane.
  static BeamChain through(std::span<const Eigen::Vector3d> points, const physics::SectionStiffness& section);
  /// Straight along x from the origin, `count` beams. Each beam is `grading` times as long as the one before.
  static BeamChain straight(int count, double length, const physics::SectionStiffness& section, double grading = 1);
  /// Adds to every beam a fibre: beams of the given section at `offset` from the nodes, as long as the rest shape has
  /// it there.
  void add_fibre(const Eigen::Vector3d& offset, const physics::SectionStiffness& section);

  int free_dofs() const { return 6 * (static_cast<int>(nodes.size()) - 1); }
  /// Internal force on the free nodes and its symmetric tangent, [6 (nodes - 1)].
  void assemble(Eigen::MatrixXd& tangent, Eigen::VectorXd& force) const;
  /// x <- x + u, R <- exp(w) R of the free nodes.
  void move(const Eigen::VectorXd& motion);
  /// Newton under a constant load on the last node; block-tridiagonal solves, dense ones where the tangent is
  /// indefinite. Returns the iterations used until a step is shorter than `tolerance`, or more than `max_iterations`
  /// if none is.
  int solve(const physics::Vector6d& tip_load, double tolerance, int max_iterations = 40);
  /// True if the tangent is positive definite: the state is a stable equilibrium of some load.
  bool is_stable() const;

  const Eigen::Vector3d& tip() const { return nodes.back().position; }
};

}  // namespace stylet::support
