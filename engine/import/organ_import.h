// From the parts of an organ to what the simulation needs: one closed surface, tetrahedra, and an account of both.
#pragma once

#include "engine/import/organ_source.h"
#include "engine/mesh/graded_stuffing.h"
#include "engine/mesh/tet_quality.h"
#include "engine/mesh/triangle_mesh.h"
#include "physics/tissue/tet_mesh.h"

#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace stylet::import {

enum class Mesher {
  stuffing,  ///< our own (stuffing.h)
  gmsh,      ///< the program Gmsh (gmsh.h): boundary nodes on the surface, angles as they come
};

struct ImportSettings {
  physics::Element element = physics::Element::linear;  ///< quadratic: runs of eight tetrahedra (refinement.h)
  double cell = 0;                                      ///< of the lattice, m; 0: for what follows
  int target_nodes = 0;                                 ///< 0: for the volume error
  double volume_error = 0.03;                           ///< relative
  std::optional<mesh::Grading> grading{};               ///< of tetrahedra around a point
  Mesher mesher = Mesher::stuffing;
  std::string gmsh = "gmsh";    ///< program, for Mesher::gmsh
  double surface_cells = 70;    ///< along the diagonal, of a new surface where the given one is none
  std::optional<double> gap{};  ///< widest opening that is closed, m; absent: the smallest that encloses something
  bool solid = true;  ///< demanded: no double wall. Without it a closed surface is enough: what is only seen
};

/// How the inside of an organ was found.
enum class SolidFrom {
  closed_surface,  ///< closed and consistently oriented: exact
  enclosure,       ///< what cannot be reached from outside (enclosed_solid.h)
  labels,          ///< voxels
};

/// One connected part of the solid, m^3.
struct PieceReport {
  double volume = 0;
  double tetrahedra = 0;  ///< 0: left out, smaller than a few cells or thinner than one
};

/// A tissue in the labels of an organ (organ_labels.h).
struct LabelReport {
  int label = 0;
  std::string tissue;
  double volume = 0;           ///< of its voxels, m^3
  std::size_t tetrahedra = 0;  ///< whose centroid lies in it
};

/// What was found, repaired and guessed. Lengths in m, volumes in m^3.
struct ImportReport {
  int parts = 0;
  std::size_t triangles_read = 0;
  std::size_t triangles = 0;  ///< after welding and cleaning
  std::size_t dropped = 0;    ///< degenerate or duplicate
  std::size_t turned = 0;     ///< to agree with their neighbours, and outward
  int boundary_edges = 0;     ///< of the welded surface
  int non_manifold_edges = 0;
  int components = 0;
  double welded_volume = 0;  ///< enclosed by the welded surface; 0 where it is not closed
  SolidFrom from = SolidFrom::closed_surface;
  double gap = 0;     ///< closed; 0: none
  double volume = 0;  ///< of the solid
  double cell = 0;    ///< of the lattice
  std::vector<PieceReport> pieces;
  std::size_t nodes = 0, tetrahedra = 0;
  physics::Element element = physics::Element::linear;
  mesh::TetQuality quality;
  std::vector<int> dihedral_histogram;  ///< tetrahedra by their smallest dihedral angle, 5 degrees a bin from 0
  std::vector<LabelReport> labels;      ///< by label; none: nothing is known to lie inside
  std::vector<std::string> notes;       ///< what an author should know, one line each

  /// Of the pieces that tetrahedra fill.
  double filled_volume() const {
    double filled = 0;
    for (const PieceReport& piece : pieces) filled += piece.tetrahedra > 0 ? piece.volume : 0;
    return filled;
  }
  double volume_error() const { return filled_volume() > 0 ? quality.volume / filled_volume() - 1 : 0; }
};

struct ImportedOrgan {
  std::string id;
  mesh::TriangleMesh surface;  ///< closed, outward, patient frame
  physics::TetMesh mesh;
  ImportReport report;
};

/// Called often with what is being done and, where that is known, which part of it is done, 0 to 1. May throw to end
/// it.
using ImportProgress = std::function<void(const std::string& task, double share)>;

/// The closed surface alone: `mesh` stays empty.
/// @throws files::ContentError  no inside, and why
ImportedOrgan import_surface(const OrganParts& organ, const ImportSettings& settings, const ImportProgress& progress);

/// @throws files::ContentError  no inside, and why; a mesh that cannot be made good
ImportedOrgan import_organ(const OrganParts& organ, const ImportSettings& settings, const ImportProgress& progress);

}  // namespace stylet::import
