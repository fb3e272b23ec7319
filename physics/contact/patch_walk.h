// Where a point is in the tetrahedra of a patch, in their present shape.
#pragma once

#include "physics/contact/tissue_points.h"
#include "physics/messages/messages.h"

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
/// Ends as if the patch did where the patch is not finite, a tetrahedron flat, or the steps do not suffice.
/// @param tissue  the points whose forces deform the patch
/// @realtime no allocation; O(steps points)
PatchWalk walk_patch(const TissuePatch& patch, int body, int patch_tet, const Eigen::Vector3d& x,
                     const TissuePoints& tissue);
/// The same in the shape at rest, where no tetrahedron is inside out.
/// @realtime no allocation; O(steps)
PatchWalk walk_patch_at_rest(const TissuePatch& patch, int body, int patch_tet, const Eigen::Vector3d& x);
/// Whether the present forces turn a tetrahedron of the patch inside out.
/// @realtime no allocation; O(points)
bool inside_out(const TissuePatch& patch, int body, int patch_tet, const TissuePoints& tissue);

/// Slides a point along the surface of a body, from face to face, as deep below it as it was.
/// Left::patch: at an edge that the patch ends at, or where it is not finite. Left::body: at an edge beyond which the
/// surface, without needle force, is steeper than 73 degrees to the plane slid in.
/// @param from    tetrahedron and barycentric; one without a face on the surface: the slide is a straight line
/// @param across  two unit vectors across each other, the plane slid in
/// @param slide   along them, m
/// @param tissue  the points whose forces deform the patch
/// @realtime no allocation; O(faces points)
PatchWalk slide_on_surface(const TissuePatch& patch, int body, const PatchWalk& from,
                           const Eigen::Matrix<double, 3, 2>& across, const Eigen::Vector2d& slide,
                           const TissuePoints& tissue);

/// Outward unit normal, without needle force, of the face on the surface that a point of a patch is nearest to; zero
/// where its tetrahedron has none.
Eigen::Vector3d surface_normal(const TissuePatch& patch, int body, const PatchWalk& at);

/// Rest position of a material point of a patch, m.
Eigen::Vector3d rest_position(const TissuePatch& patch, int body, const PatchContact& point);

}  // namespace stylet::physics
