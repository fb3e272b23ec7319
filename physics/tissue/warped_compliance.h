// W_bar carried along by tissue that has turned since its factorisation (Courtecuisse et al. 2010).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <span>

namespace stylet::physics {

/// W_bar <- R W_bar R^T, R the block diagonal of the nodes' rotations since the factorisation: node a pushed along
/// R_b f moves by R_a (what f did to it then). Exact where all of the body, with its supports, turns as one.
/// p_free and W_bar are of one linear operator (physics/README.md eq. 6-8), so a loop that warps one has to make the
/// other with R A_f^-1 R^T too, R then over all nodes; else its step (6) is not the one the haptic loop showed.
/// @param rotations  [nodes] of BodyPatch::rotations
/// @param w_bar      [3 nodes x 3 nodes] symmetric before, exactly symmetric after, m/N
/// @realtime         no allocation; O(nodes^2)
void warp_compliance(std::span<const Eigen::Quaterniond> rotations, Eigen::Ref<Eigen::MatrixXd> w_bar);

}  // namespace stylet::physics
