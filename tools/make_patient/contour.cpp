#include "tools/make_patient/contour.h"

#include "engine/mesh/decimation.h"
#include "engine/mesh/tet_quality.h"

namespace stylet::patient {
namespace {

// G. Taubin, "A signal processing approach to fair surface design", SIGGRAPH 1995: umbrella smoothing that keeps the
// volume, by a step forward and a longer one back.
void taubin(mesh::TriangleMesh& mesh, int passes) {
  std::vector<Eigen::Vector3d> sum(mesh.vertices.size());
  std::vector<int> count(mesh.vertices.size());
  for (int pass = 0; pass < 2 * passes; ++pass) {
    std::fill(sum.begin(), sum.end(), Eigen::Vector3d::Zero());
    std::fill(count.begin(), count.end(), 0);
    for (const auto& t : mesh.triangles) {
      for (int i = 0; i < 3; ++i) {  // every edge is met from both its triangles, so the one ahead is enough
        sum[t[i]] += mesh.vertices[t[(i + 1) % 3]];
        ++count[t[i]];
      }
    }
    const double step = pass % 2 == 0 ? 0.5 : -0.53;
    for (std::size_t v = 0; v < sum.size(); ++v) mesh.vertices[v] += step * (sum[v] / count[v] - mesh.vertices[v]);
  }
}

}  // namespace

mesh::TriangleMesh contour(const mesh::SignedDistance& solid, const Eigen::AlignedBox3d& box, double cell,
                           int triangles) {
  mesh::TriangleMesh mesh = mesh::boundary_surface(mesh::stuff(solid, box, cell, 0)).mesh;
  taubin(mesh, 8);
  if (triangles <= 0 || static_cast<int>(mesh.triangles.size()) <= triangles) return mesh;
  return mesh::decimate(mesh, {.triangles = static_cast<std::size_t>(triangles)});
}

}  // namespace stylet::patient
