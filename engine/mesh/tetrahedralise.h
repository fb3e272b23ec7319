// A solid becomes a simulation mesh.
#pragma once

#include "engine/mesh/graded_stuffing.h"
#include "engine/mesh/stuffing.h"
#include "engine/mesh/triangle_mesh.h"
#include "physics/tissue/tet_mesh.h"

#include <Eigen/Geometry>

#include <functional>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace stylet::mesh {

/// What is to be filled, however it is known.
struct SolidShape {
  SignedDistance distance;
  Eigen::AlignedBox3d box;  ///< contains it
  double volume = 0;        ///< m^3
};

struct TetrahedraliseSettings {
  /// Quadratic: of cells twice as long, each tetrahedron in eight (refined_on_surface()); all other numbers count
  /// what that leaves, so that both have about as many nodes.
  physics::Element element = physics::Element::linear;
  double cell = 0;                   ///< edge of the lattice cell, m; 0: found for what follows
  int target_nodes = 2300;           ///< wanted where cell is 0; 0: volume_error counts
  double volume_error = 0.03;        ///< most that is accepted where cell and target_nodes are 0, relative
  double node_tolerance = 0.06;      ///< relative; the search stops within it
  double min_dihedral_deg = 12;      ///< below it the mesh is refused
  std::optional<Grading> grading{};  ///< of the piece that holds its target
  std::string where = "surface";     ///< named in errors: file and node
  std::size_t most_nodes = 60'000;   ///< where cell and target_nodes are 0: the search ends with an error
  double most_asked = 200'000;       ///< nodes, about, that a cell may make
  /// Distances asked for in all, beyond which it ends with an error: seconds, not hours, whatever the shape.
  std::size_t most_distances = 20'000'000;
  /// Called often, with the cell at work on (m) and how much of the longest search is done; may throw to end it.
  std::function<void(double cell, double share)> progress{};
};

/// Tetrahedra of a solid in pieces.
struct FilledPieces {
  physics::TetMesh mesh;        ///< one piece after the other
  double cell = 0;              ///< m
  bool graded = false;          ///< a piece holds the target of the grading
  std::vector<double> volumes;  ///< m^3 of tetrahedra, 0 of a piece left out  [pieces]
};

/// Adds the tetrahedra of another mesh; nothing is joined.
void append(physics::TetMesh& to, const physics::TetMesh& from);

/// Isosurface stuffing (stuffing.h), piece by piece: what lies close together stays apart. Of several pieces those of
/// less than four cells, and those of which less than half can be filled, are left out; where the volume counts, it
/// is that of the others, and what is left out is as small as the error.
/// @throws ContentError  no tetrahedron at this cell size; the volume is not reached; worse than min_dihedral_deg;
///                       over most_nodes, most_asked or most_distances; what `progress` throws
FilledPieces fill_pieces(std::span<const SolidShape> pieces, const TetrahedraliseSettings& settings);

/// The same of one piece.
/// @throws ContentError  no tetrahedron at this cell size; worse than min_dihedral_deg
physics::TetMesh tetrahedralise(const SolidShape& solid, const TetrahedraliseSettings& settings);

/// The same of the solid inside `surface`, which is first cleaned and demanded to be solid (surface_mesh.h).
/// @throws ContentError  also: no solid
physics::TetMesh tetrahedralise(const TriangleMesh& surface, const TetrahedraliseSettings& settings);

}  // namespace stylet::mesh
