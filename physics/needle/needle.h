// The flexible needle: a chain of corotational Timoshenko beams from hub to tip, solved as a block-tridiagonal
// system.
#pragma once

#include "physics/messages/messages.h"
#include "physics/needle/beam.h"
#include "physics/needle/block_tridiagonal.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <array>
#include <vector>

namespace stylet::physics {

/// What the needle is made of. SI.
struct NeedleProperties {
  double length = 0.150;             ///< hub to tip, m
  double outer_diameter = 1.27e-3;   ///< m (18G)
  double inner_diameter = 0.838e-3;  ///< m; 0: solid
  double young_modulus = 200e9;      ///< Pa
  double poisson_ratio = 0.3;        ///< -
  int beams = 8;                     ///< 1..kMaxBeams
  double yield_strength = 0;         ///< Pa; beyond it the needle stays bent; 0: it never does
};

/// How the needle's first node is held at the hub.
enum class BaseKind {
  prescribed,     ///< its pose is the stylus pose (paper)
  spring_damper,  ///< isotropic spring-damper between stylus and first node, in the first block of A_n
};

/// Holding of the first node. Stiffness and damping matter for spring_damper only; prescribed is their stiff limit.
struct NeedleBase {
  BaseKind kind = BaseKind::prescribed;
  double stiffness = 2000;           ///< N/m
  double damping = 0;                ///< N s/m
  double rotational_stiffness = 20;  ///< N m/rad
  double rotational_damping = 0;     ///< N m s/rad
};

/// Node poses of the needle, hub first, tip last. Node frame -> patient frame; +Z along the shaft, +X bevel normal.
struct NeedleShape {
  int node_count = 0;
  Eigen::Matrix<double, 3, kMaxNeedleNodes> positions = Eigen::Matrix<double, 3, kMaxNeedleNodes>::Zero();
  std::array<Eigen::Quaterniond, kMaxNeedleNodes> orientations{};

  auto nodes() const { return positions.leftCols(node_count); }  ///< [3 x node_count]
  const Eigen::Quaterniond& orientation(int node) const { return orientations[node]; }
};

/// Orientation whose +Z is along `direction`, turned from the identity the shortest way. Any length; not along -Z.
Eigen::Quaterniond orientation_along(const Eigen::Vector3d& direction);

/// Straight, stress-free needle with its hub at `hub`.
/// Throws std::invalid_argument (one line) if a property is out of range.
NeedleShape straight_needle(const NeedleProperties& needle, const StylusPose& hub);

/// Mechanics of the needle, quasi-static: one Newton step a call (physics/README.md eq. 9-12).
/// All memory is taken in the constructor.
class Needle {
public:
  /// Throws std::invalid_argument (one line) if a property is out of range.
  Needle(const NeedleProperties& properties, const NeedleBase& base);

  int node_count() const { return static_cast<int>(beams_.size()) + 1; }
  double rest_length() const { return rest_length_; }
  double beam_length() const { return rest_length_ / static_cast<double>(beams_.size()); }
  /// True if the first node moves (spring-damper base): then loads on it count.
  bool base_is_free() const { return base_.kind == BaseKind::spring_damper; }

  /// Internal force, tangent and factorisation of A_n at `shape`, with the base held at `hub`. The shape must have
  /// followed the hub (follow_hub), so that the damper of a spring-damper base starts from rest in the hub's frame.
  /// Where A_n is indefinite (a buckled state) its geometric part is left out: a modified Newton step, same solution.
  /// @param dt  duration of the step, s: for the damper
  /// What is beyond the strength of the steel stays bent from here on (physics/README.md eq. 37).
  /// @return false if A_n is not positive definite even so (non-finite shape)
  /// @realtime no allocation; O(beams)
  bool linearise(const NeedleShape& shape, const StylusPose& hub, double dt);
  /// The two halves of linearise(), to be called one after the other: internal force and tangent with the base, and
  /// the factorisation of what was assembled.
  void assemble(const NeedleShape& shape, const StylusPose& hub, double dt);
  bool factorise(const NeedleShape& shape, const StylusPose& hub, double dt);

  /// x = A_n^-1 (b + f): the Newton step under nodal loads f; f = 0 is the free motion.
  /// @param load          forces and moments on the nodes [6 node_count], N and N m
  /// @param[out] motion   translations and spins of the nodes [6 node_count], m and rad
  void solve(Eigen::Ref<const Eigen::VectorXd> load, Eigen::Ref<Eigen::VectorXd> motion) const;

  /// Force and moment that the hand must apply to the first node for the motion x under the loads f, linearised as
  /// the solve was: its force is exactly minus the sum of the loads (physics/README.md eq. 12).
  Vector6d base_reaction(Eigen::Ref<const Eigen::VectorXd> load, Eigen::Ref<const Eigen::VectorXd> motion) const;

  /// Factor of A_n of the last linearise().
  const BlockTridiagonal& factor() const { return system_; }
  /// Elastic energy at `shape`, J.
  double energy(const NeedleShape& shape) const;
  /// How far the needle is bent for good, sum over its beams, rad; and the work that has gone into its steel, J.
  double bend() const;
  double bend_work() const;

private:
  void assemble_beams(const NeedleShape& shape, Tangent tangent);
  void hold_base(const NeedleShape& shape, const StylusPose& hub, double dt);

  std::vector<Beam> beams_;
  NeedleBase base_;
  double rest_length_ = 0;
  BlockTridiagonal system_;
  Eigen::VectorXd residual_;                    // b: minus the internal force, plus the base's [6 nodes]
  Matrix6d first_diagonal_ = Matrix6d::Zero();  // rows of the first node without the base: for the reaction
  Matrix6d first_coupling_ = Matrix6d::Zero();
  Vector6d first_force_ = Vector6d::Zero();
};

/// positions += u, R <- exp(w) R for every node.
/// @param motion [6 node_count] translations and spins
void move(NeedleShape& shape, Eigen::Ref<const Eigen::VectorXd> motion);

/// Moves the whole needle rigidly as the hub goes from `from` to `to` (exact for a needle in the air).
void follow_hub(NeedleShape& shape, const StylusPose& from, const StylusPose& to);

}  // namespace stylet::physics
