// Tetrahedra by Gmsh (GPL), run as a program of its own where it is installed, never linked.
#pragma once

#include "engine/mesh/triangle_mesh.h"
#include "physics/tissue/tet_mesh.h"

#include <functional>
#include <string>
#include <string_view>

namespace stylet::import {

struct GmshSettings {
  double cell = 0;               ///< edge of triangles and tetrahedra, m
  double seconds = 120;          ///< after which it is stopped
  std::string program = "gmsh";  ///< looked for in PATH
  std::string where;             ///< named in errors: file and node
};

/// Remeshes a closed surface of one piece with triangles of `cell` whose nodes lie on it, and fills it.
/// @param still_wanted  called every 50 ms while it runs; what it throws stops the program
/// @return positively oriented tetrahedra; not checked for their angles
/// @throws files::ContentError  there is no such program; it fails, takes too long or leaves what is no mesh
physics::TetMesh gmsh_tetrahedra(const mesh::TriangleMesh& surface, const GmshSettings& settings,
                                 const std::function<void()>& still_wanted);

/// Tetrahedra of an MSH 2.2 text file, whose other elements are passed over: in the unit of the file, turned to be
/// positive, without unused nodes.
/// @throws files::ContentError  another format, broken off, a node that is not there, no tetrahedron, a flat one
physics::TetMesh read_msh(std::string_view text, const std::string& where);

}  // namespace stylet::import
