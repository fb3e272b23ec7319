#include "tools/make_patient/contour.h"

#include "engine/content/tet_quality.h"

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModAspectRatioT.hh>
#include <OpenMesh/Tools/Decimater/ModNormalFlippingT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>

namespace stylet::patient {
namespace {

using HalfEdgeMesh = OpenMesh::TriMesh_ArrayKernelT<OpenMesh::DefaultTraitsDouble>;

// G. Taubin, "A signal processing approach to fair surface design", SIGGRAPH 1995: umbrella smoothing that keeps the
// volume, by a step forward and a longer one back.
void taubin(content::TriangleMesh& mesh, int passes) {
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

content::TriangleMesh decimate(const content::TriangleMesh& mesh, int triangles) {
  HalfEdgeMesh half_edges;
  std::vector<OpenMesh::VertexHandle> handles;
  for (const Eigen::Vector3d& x : mesh.vertices) handles.push_back(half_edges.add_vertex({x.x(), x.y(), x.z()}));
  for (const auto& t : mesh.triangles) half_edges.add_face(handles[t[0]], handles[t[1]], handles[t[2]]);

  half_edges.request_face_normals();
  half_edges.update_face_normals();
  OpenMesh::Decimater::DecimaterT<HalfEdgeMesh> decimater(half_edges);
  OpenMesh::Decimater::ModQuadricT<HalfEdgeMesh>::Handle quadric;
  OpenMesh::Decimater::ModNormalFlippingT<HalfEdgeMesh>::Handle flipping;
  OpenMesh::Decimater::ModAspectRatioT<HalfEdgeMesh>::Handle aspect;
  decimater.add(quadric);
  decimater.add(flipping);
  decimater.add(aspect);
  decimater.module(quadric).unset_max_err();
  decimater.module(flipping).set_max_normal_deviation(35);
  decimater.module(aspect).set_aspect_ratio(4);
  decimater.initialize();
  decimater.decimate_to_faces(0, static_cast<std::size_t>(triangles));
  half_edges.garbage_collection();

  content::TriangleMesh result;
  for (const auto vertex : half_edges.vertices()) {
    const auto& p = half_edges.point(vertex);
    result.vertices.emplace_back(p[0], p[1], p[2]);
  }
  for (const auto face : half_edges.faces()) {
    std::array<std::uint32_t, 3> corners{};
    int i = 0;
    for (auto corner = half_edges.cfv_iter(face); corner.is_valid(); ++corner) {
      corners[i++] = static_cast<std::uint32_t>(corner->idx());
    }
    result.triangles.push_back(corners);
  }
  return result;
}

}  // namespace

content::TriangleMesh contour(const content::SignedDistance& solid, const Eigen::AlignedBox3d& box, double cell,
                              int triangles) {
  content::TriangleMesh mesh = content::boundary_surface(content::stuff(solid, box, cell, 0)).mesh;
  taubin(mesh, 8);
  return triangles > 0 && static_cast<int>(mesh.triangles.size()) > triangles ? decimate(mesh, triangles) : mesh;
}

}  // namespace stylet::patient
