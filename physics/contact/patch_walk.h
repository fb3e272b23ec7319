// Where a point is in the tetrahedra of a patch, in their present shape.
#pragma once

#include "physics/contact/tissue_points.h"
#include "physics/loops/messages.h"

#include <Eigen/Core>

#include <cstdint>

namespace stylet::physics {

/// End of a walk.
struct PatchWalk {
  enum class Left : std::uint8_t { nothing, body, patch };  ///< what the point lies outside of
  int patch_tet = -1;  ///< tetrahedron of the patch that holds the point, or the last one before leaving
  /// In it, no entry below 0: on its face where the point left. Always finite.
  Eigen::Vector4d barycentric = Eigen::Vector4d::Constant(0.25);
  Left left = Left::nothing;
};

/// Walks from a tetrahedron of the patch towards `x`, through the face it lies farthest beyond, at most 64 steps.
/// Ends as if the patch did where the patch is not finite or a tetrahedron flat.
/// @param tissue  the points whose forces deform the patch
/// @realtime no allocation; O(steps points)
PatchWalk walk_patch(const TissuePatch& patch, int body, int patch_tet, const Eigen::Vector3d& x,
                     const TissuePoints& tissue);

/// Rest position of a material point of a patch, m.
Eigen::Vector3d rest_position(const TissuePatch& patch, int body, const PatchContact& point);

}  // namespace stylet::physics
