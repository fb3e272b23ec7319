#include "engine/import/thin_out.h"

#include "engine/mesh/decimation.h"
#include "engine/mesh/surface_mesh.h"

#include <cmath>

namespace stylet::import {

mesh::TriangleMesh thin_out(const mesh::TriangleMesh& mesh, double error, const files::Pulse& pulse) {
  constexpr double kVolume = 0.003;  // relative, most that may be lost or gained
  mesh::TriangleMesh result = mesh::decimate(mesh, {.turn_deg = 25, .aspect = 5, .error = error}, pulse);
  const mesh::SurfaceReport before = mesh::inspect(mesh, pulse);
  const mesh::SurfaceReport after = mesh::inspect(result, pulse);
  const bool sound = after.boundary_edges == before.boundary_edges && after.non_manifold_edges == 0;
  const bool as_large = !before.closed() || std::abs(after.volume - before.volume) <= kVolume * before.volume;
  return sound && as_large ? result : mesh;
}

}  // namespace stylet::import
