// Fewer triangles for the same surface.
#pragma once

#include "engine/files/pulse.h"
#include "engine/mesh/triangle_mesh.h"

namespace stylet::import {

/// Collapses edges where the surface is flat: no vertex leaves the planes it lay in by more than about `error`, m
/// (M. Garland, P. S. Heckbert, "Surface simplification using quadric error metrics", SIGGRAPH 1997). Closed surfaces
/// stay closed, borders stay where they are. What is no two-manifold, or would
/// change its volume by more than 0.3 %, comes back as it is. The same input gives the
/// same bits.
/// @param pulse  called often meanwhile; may throw to end it
mesh::TriangleMesh thin_out(const mesh::TriangleMesh& mesh, double error, const files::Pulse& pulse = {});

}  // namespace stylet::import
