#include "engine/import/thin_out.h"

#include "engine/content/surface_mesh.h"

#include <cmath>

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModAspectRatioT.hh>
#include <OpenMesh/Tools/Decimater/ModNormalFlippingT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>

namespace stylet::import {
namespace {

using HalfEdgeMesh = OpenMesh::TriMesh_ArrayKernelT<OpenMesh::DefaultTraitsDouble>;

constexpr double kVolume = 0.003;  // relative, most that may be lost or gained
constexpr float kMostTurn = 25;    // degrees that a triangle may turn in a collapse
constexpr float kMostAspect = 5;   // of a triangle that a collapse makes

}  // namespace

content::TriangleMesh thin_out(const content::TriangleMesh& mesh, double error) {
  const content::SurfaceReport before = content::inspect(mesh);
  if (before.non_manifold_edges > 0 || before.misoriented_edges > 0) return mesh;
  HalfEdgeMesh half_edges;
  std::vector<OpenMesh::VertexHandle> handles;
  for (const Eigen::Vector3d& x : mesh.vertices) handles.push_back(half_edges.add_vertex({x.x(), x.y(), x.z()}));
  for (const auto& t : mesh.triangles) half_edges.add_face(handles[t[0]], handles[t[1]], handles[t[2]]);
  if (half_edges.n_faces() != mesh.triangles.size()) return mesh;  // pinched

  half_edges.request_vertex_status();
  half_edges.request_edge_status();
  half_edges.request_face_status();
  half_edges.request_face_normals();
  half_edges.update_face_normals();
  for (const auto vertex : half_edges.vertices()) {
    if (half_edges.is_boundary(vertex)) half_edges.status(vertex).set_locked(true);
  }
  OpenMesh::Decimater::DecimaterT<HalfEdgeMesh> decimater(half_edges);
  OpenMesh::Decimater::ModQuadricT<HalfEdgeMesh>::Handle quadric;
  OpenMesh::Decimater::ModNormalFlippingT<HalfEdgeMesh>::Handle flipping;
  OpenMesh::Decimater::ModAspectRatioT<HalfEdgeMesh>::Handle aspect;
  decimater.add(quadric);
  decimater.add(flipping);
  decimater.add(aspect);
  // OpenMesh weighs each plane with the area of its triangle; a vertex begins with those of about six.
  const double area = 6 * before.area / before.triangles;
  decimater.module(quadric).set_max_err(area * error * error, false);
  decimater.module(flipping).set_max_normal_deviation(kMostTurn);
  decimater.module(aspect).set_aspect_ratio(kMostAspect);
  decimater.initialize();
  decimater.decimate();
  half_edges.garbage_collection();

  content::TriangleMesh result;
  for (const auto vertex : half_edges.vertices()) {
    const auto& p = half_edges.point(vertex);
    result.vertices.emplace_back(p[0], p[1], p[2]);
  }
  for (const auto face : half_edges.faces()) {
    std::array<std::uint32_t, 3> triangle{};
    std::size_t c = 0;
    for (const auto vertex : half_edges.fv_range(face)) triangle[c++] = static_cast<std::uint32_t>(vertex.idx());
    result.triangles.push_back(triangle);
  }
  const content::SurfaceReport after = content::inspect(result);
  const bool sound = after.boundary_edges == before.boundary_edges && after.non_manifold_edges == 0;
  const bool as_large = !before.closed() || std::abs(after.volume - before.volume) <= kVolume * before.volume;
  return sound && as_large ? result : mesh;
}

}  // namespace stylet::import
