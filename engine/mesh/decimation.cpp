#include "engine/mesh/decimation.h"

#include "engine/mesh/surface_mesh.h"

#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <OpenMesh/Tools/Decimater/DecimaterT.hh>
#include <OpenMesh/Tools/Decimater/ModAspectRatioT.hh>
#include <OpenMesh/Tools/Decimater/ModEdgeLengthT.hh>
#include <OpenMesh/Tools/Decimater/ModNormalFlippingT.hh>
#include <OpenMesh/Tools/Decimater/ModQuadricT.hh>
#include <OpenMesh/Tools/Decimater/Observer.hh>

#include <cstddef>
#include <vector>

namespace stylet::mesh {
namespace {

using HalfEdgeMesh = OpenMesh::TriMesh_ArrayKernelT<OpenMesh::DefaultTraitsDouble>;

/// Told of every so many collapses.
class CollapseWatch final : public OpenMesh::Decimater::Observer {
public:
  explicit CollapseWatch(const files::Pulse& pulse) : Observer(kCollapses), pulse_(pulse) {}
  void notify(std::size_t /*step*/) override { pulse_.now(); }

private:
  static constexpr std::size_t kCollapses = 1000;
  const files::Pulse& pulse_;
};

std::vector<std::array<std::uint32_t, 3>> triangles_of(const HalfEdgeMesh& half_edges) {
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (const auto face : half_edges.faces()) {  // not those that a collapse took
    std::array<std::uint32_t, 3> corners{};
    std::size_t i = 0;
    for (const auto vertex : half_edges.fv_range(face)) corners[i++] = static_cast<std::uint32_t>(vertex.idx());
    triangles.push_back(corners);
  }
  return triangles;
}

/// Marks as deleted what the collapses take; nothing is collected. @return it can be collapsed at all
bool collapse(HalfEdgeMesh& half_edges, const TriangleMesh& mesh, const DecimationLimits& limits,
              const files::Pulse& pulse) {
  const SurfaceReport report = inspect(mesh, pulse);
  if (report.non_manifold_edges > 0 || report.misoriented_edges > 0) return false;
  // What is deleted is remembered beyond the decimater.
  half_edges.request_vertex_status();
  half_edges.request_edge_status();
  half_edges.request_halfedge_status();
  half_edges.request_face_status();
  std::vector<OpenMesh::VertexHandle> handles;
  for (const Eigen::Vector3d& x : mesh.vertices) {
    pulse();
    handles.push_back(half_edges.add_vertex({x.x(), x.y(), x.z()}));
  }
  for (const auto& t : mesh.triangles) {
    pulse();
    half_edges.add_face(handles[t[0]], handles[t[1]], handles[t[2]]);
  }
  if (half_edges.n_faces() != mesh.triangles.size()) return false;  // pinched

  half_edges.request_face_normals();
  half_edges.update_face_normals();
  OpenMesh::Decimater::DecimaterT<HalfEdgeMesh> decimater(half_edges);
  for (const auto vertex : half_edges.vertices()) {
    if (half_edges.is_boundary(vertex)) half_edges.status(vertex).set_locked(true);
  }
  OpenMesh::Decimater::ModQuadricT<HalfEdgeMesh>::Handle quadric;
  OpenMesh::Decimater::ModNormalFlippingT<HalfEdgeMesh>::Handle flipping;
  OpenMesh::Decimater::ModAspectRatioT<HalfEdgeMesh>::Handle aspect;
  decimater.add(quadric);
  decimater.add(flipping);
  decimater.add(aspect);
  if (limits.error) {
    // OpenMesh weighs each plane with the area of its triangle; a vertex begins with those of about six.
    const double area = 6 * report.area / report.triangles;
    decimater.module(quadric).set_max_err(area * *limits.error * *limits.error, false);
  } else {
    decimater.module(quadric).unset_max_err();
  }
  decimater.module(flipping).set_max_normal_deviation(static_cast<float>(limits.turn_deg));
  decimater.module(aspect).set_aspect_ratio(static_cast<float>(limits.aspect));
  OpenMesh::Decimater::ModEdgeLengthT<HalfEdgeMesh>::Handle edge;
  if (limits.edge) {
    decimater.add(edge);
    decimater.module(edge).set_edge_length(static_cast<float>(*limits.edge));
  }
  pulse.now();
  decimater.initialize();
  CollapseWatch watch(pulse);
  decimater.set_observer(&watch);
  if (limits.triangles > 0) {
    decimater.decimate_to_faces(0, limits.triangles);
  } else {
    decimater.decimate();
  }
  return true;
}

}  // namespace

TriangleMesh decimate(const TriangleMesh& mesh, const DecimationLimits& limits, const files::Pulse& pulse) {
  HalfEdgeMesh half_edges;
  if (!collapse(half_edges, mesh, limits, pulse)) return mesh;
  half_edges.garbage_collection();
  TriangleMesh result;
  for (const auto vertex : half_edges.vertices()) {
    const auto& p = half_edges.point(vertex);
    result.vertices.emplace_back(p[0], p[1], p[2]);
  }
  result.triangles = triangles_of(half_edges);
  return result;
}

std::vector<std::array<std::uint32_t, 3>> decimated_triangles(const TriangleMesh& mesh,
                                                              const DecimationLimits& limits) {
  HalfEdgeMesh half_edges;
  return collapse(half_edges, mesh, limits, {}) ? triangles_of(half_edges) : mesh.triangles;
}

}  // namespace stylet::mesh
