// Triangle surfaces made fit for use: welded, oriented, checked to be solid, with normals.
//
// OpenMesh repairs silently (it duplicates vertices until every face fits), so the index soup is cleaned here first
// and the half-edge mesh built from it must have the same counts.
#pragma once

#include "engine/files/pulse.h"
#include "engine/mesh/triangle_mesh.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <string_view>
#include <vector>

namespace stylet::mesh {

/// What a surface is, before any judgement. Edges are undirected.
struct SurfaceReport {
  int vertices = 0;
  int triangles = 0;
  int components = 0;          ///< connected through shared vertices
  int boundary_edges = 0;      ///< edges of one triangle
  int non_manifold_edges = 0;  ///< edges of three or more triangles
  int misoriented_edges = 0;   ///< edges run through twice in the same direction
  double area = 0;             ///< m^2
  double volume = 0;           ///< m^3, positive where triangles are counter-clockwise from outside
  Eigen::AlignedBox3d bounds;

  bool closed() const { return triangles > 0 && boundary_edges == 0 && non_manifold_edges == 0; }
  bool oriented() const { return misoriented_edges == 0 && volume > 0; }
  /// Euler characteristic V - E + F of a closed surface (2 a sphere, 0 a torus; sums over components).
  int euler_characteristic() const { return vertices - triangles / 2; }
};

/// @param pulse  of this and the others: called often meanwhile; may throw to end it
SurfaceReport inspect(const TriangleMesh& mesh, const files::Pulse& pulse = {});

/// Vertices with equal coordinates become one (exactly: positions of patches of one organ are bit-equal where they
/// meet); degenerate and duplicate triangles and unused vertices are dropped; triangles of each edge-connected
/// component are turned to agree with each other, outward where that is defined. The order of what stays is kept.
/// @param where        named in the error: file and node
/// @param[out] turned  triangles that faced the other way
/// @throws ContentError  non-finite coordinate, index out of range, nothing left
TriangleMesh clean_surface(const TriangleMesh& soup, std::string_view where, std::size_t* turned = nullptr,
                           const files::Pulse& pulse = {});

/// clean_surface(), then demands a solid: closed, two-manifold (also as OpenMesh sees it), not a thin double wall.
/// @throws ContentError  also: open (n boundary edges), n non-manifold edges, watertight but not solid
TriangleMesh solid_surface(const TriangleMesh& soup, std::string_view where, const files::Pulse& pulse = {});

/// Unit normals by area-weighted average of the triangles at a vertex, outward where the surface is.  [vertices]
std::vector<Eigen::Vector3f> smooth_normals(const TriangleMesh& mesh);

}  // namespace stylet::mesh
