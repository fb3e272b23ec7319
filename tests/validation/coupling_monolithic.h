// Needle, tissue and contacts as one dense system: what the two loops must come to rest in.
#pragma once

#include "physics/messages/messages.h"
#include "physics/needle/needle.h"
#include "tests/support/dense_tissue.h"
#include "tools/reference/reference_insertion.h"

#include <Eigen/Core>

#include <vector>

namespace stylet::validation {

/// The shaft between two nodes of the needle: a straight edge (the paper), or the cubic with the nodes' own tangents
/// (coupling `stylet`).
enum class ShaftCurve { straight, cubic };

/// Newton's method on the saddle-point system
///   [A_n  0  H_n^T; 0  K  H_v^T; H_n  H_v  0],
/// for the contact points of a NeedleState. The coupling and the tissue are written anew here; of the needle only its
/// linearisation is used (flexibility from unit loads), which has its own tests against beam theory.
class Monolithic {
public:
  /// @param hub    pose of the base, prescribed
  /// @param state  whose contacts (tetrahedron, barycentric weights) tie needle and tissue; bilateral, exact
  Monolithic(const reference::ReferenceInsertion& insertion, const physics::StylusPose& hub,
             const physics::NeedleState& state, ShaftCurve curve = ShaftCurve::straight);

  /// @return length of the last Newton step, m and rad; the solution is reached where it is below 1e-12
  double solve();
  const physics::NeedleShape& shape() const { return shape_; }
  const Eigen::VectorXd& tissue() const { return tissue_; }  ///< positions [3 nodes], m
  const support::DenseTissue& dense() const { return dense_; }
  /// Sum of the forces that the support of the body carries, N.
  Eigen::Vector3d support_reaction() const;

private:
  /// The point of the shaft nearest to a tissue point: r = sum of share[i] x_i + arm[i], where arm[i] turns with node
  /// first + i.
  struct OnShaft {
    int first = 0;
    Eigen::Vector2d share = Eigen::Vector2d::Zero();
    Eigen::Matrix<double, 3, 2> arm = Eigen::Matrix<double, 3, 2>::Zero();  // m
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    Eigen::Vector3d slope = Eigen::Vector3d::Zero();  // not unit
  };
  OnShaft nearest_edge(const Eigen::Vector3d& x) const;
  OnShaft cubic_at(double beams_from_hub) const;
  OnShaft nearest_on_cubic(const Eigen::Vector3d& x) const;
  double newton();

  ShaftCurve curve_;
  double beam_length_;
  physics::StylusPose hub_;
  physics::Needle needle_;
  physics::NeedleShape shape_;
  physics::SimulationBody body_;
  support::DenseTissue dense_;
  std::vector<physics::NeedleContact> contacts_;
  Eigen::VectorXd tissue_;
};

/// How far the two loops are from the monolithic equilibrium of their contacts, relative.
struct Distance {
  double newton = 0;   ///< last step of the dense solution
  double needle = 0;   ///< node positions, over the lateral amplitude of the insertion
  double tissue = 0;   ///< node positions, over the displacement
  double force = 0;    ///< felt by the hand against carried by the body's support
  double newtons = 0;  ///< that support carries, N
};

/// @param tissue  positions of the body's nodes as the simulation loop has them [3 x nodes], m
Distance distance_from_equilibrium(const reference::ReferenceInsertion& insertion, const physics::StylusPose& hub,
                                   const physics::NeedleState& needle, const Eigen::Matrix3Xd& tissue,
                                   ShaftCurve curve = ShaftCurve::straight);

}  // namespace stylet::validation
