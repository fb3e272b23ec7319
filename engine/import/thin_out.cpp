#include "engine/import/thin_out.h"

#include "engine/content/decimation.h"
#include "engine/content/surface_mesh.h"

#include <cmath>

namespace stylet::import {

content::TriangleMesh thin_out(const content::TriangleMesh& mesh, double error) {
  constexpr double kVolume = 0.003;  // relative, most that may be lost or gained
  content::TriangleMesh result = content::decimate(mesh, {.turn_deg = 25, .aspect = 5, .error = error});
  const content::SurfaceReport before = content::inspect(mesh);
  const content::SurfaceReport after = content::inspect(result);
  const bool sound = after.boundary_edges == before.boundary_edges && after.non_manifold_edges == 0;
  const bool as_large = !before.closed() || std::abs(after.volume - before.volume) <= kVolume * before.volume;
  return sound && as_large ? result : mesh;
}

}  // namespace stylet::import
