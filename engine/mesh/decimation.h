// Fewer triangles for the same surface.
#pragma once

#include "engine/files/pulse.h"
#include "engine/mesh/triangle_mesh.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

namespace stylet::mesh {

/// When a collapse of an edge is refused, and where to stop. With neither `triangles` nor `error` nothing stops it
/// but the shapes.
struct DecimationLimits {
  double turn_deg = 35;           ///< most that a triangle may turn
  double aspect = 4;              ///< most of a triangle that a collapse makes, longest edge over height
  std::size_t triangles = 0;      ///< wanted; 0: as few as the other limits allow
  std::optional<double> error{};  ///< about how far the surface may move, m
  std::optional<double> edge{};   ///< longest edge that is collapsed, m
};

/// By collapses of least quadric error (Garland and Heckbert 1997). Open edges stay. What half-edges cannot hold
/// (three triangles at an edge, two fans at a vertex) comes back as it is. Deterministic.
/// @param pulse  called often meanwhile; may throw to end it
TriangleMesh decimate(const TriangleMesh& mesh, const DecimationLimits& limits, const files::Pulse& pulse = {});
/// The same on the vertices as they are: the triangles that are left, of vertices of `mesh`. A collapse moves none,
/// so what a vertex carries (a normal, what deforms it) stays right.
std::vector<std::array<std::uint32_t, 3>> decimated_triangles(const TriangleMesh& mesh,
                                                              const DecimationLimits& limits);

}  // namespace stylet::mesh
