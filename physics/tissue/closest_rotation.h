// The rotation closest to a deformation gradient, of one or of four at once.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <array>

namespace stylet::physics {

/// Rotation R closest to F: maximises tr(R^T F) over SO(3)   (physics/README.md eq. 1)
/// Newton from a warm start, quadratic; a signed SVD where F is inverted, degenerate or far from the start. For an
/// inverted F the smallest stretch counts as negative, so the forces turn the element back.
Eigen::Quaterniond closest_rotation(const Eigen::Matrix3d& f, const Eigen::Quaterniond& warm_start);

// Four side by side: these run for every element at every step.
inline constexpr int kLanes = 4;
using Lanes = Eigen::Array4d;
using LaneMatrix = std::array<std::array<Lanes, 3>, 3>;  ///< [row][column]

Lanes determinant(const LaneMatrix& f);

/// closest_rotation() in lanes, without its SVD: false if any lane is not near a maximum or did not converge, q is
/// then of no use.
/// @param[in,out] q  x, y, z, w
bool closest_rotations(const LaneMatrix& f, std::array<Lanes, 4>& q);

}  // namespace stylet::physics
