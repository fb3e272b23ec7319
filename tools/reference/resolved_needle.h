// A rigid needle in a box of tissue, resolved down to the needle's radius: what sub-grid compliance is calibrated
// against. Tri-quadratic hexahedra on rings around the needle; shares no code with physics/tissue and does not lock.
#pragma once

#include "physics/tissue/tet_mesh.h"

#include <vector>

namespace stylet::reference {

/// Where the cube is held. The far field of a coarse mesh is wrong by itself where the cube may sway; with its walls
/// held what is left is the near field, which is what sub-grid compliance is about.
enum class Support {
  floor,  ///< the face z = 0, as in R1
  walls,  ///< the four faces along the needle
};

/// Cube [0, edge]^3; the needle's axis is y = z = edge / 2, along x. SI.
struct ResolvedCube {
  double edge = 0.1;
  physics::ElasticMaterial material{.young_modulus = 10e3, .poisson_ratio = 0.45};
  double needle_radius = 0.635e-3;
  Support support = Support::floor;
};

/// Numbers of quadratic elements. 12, 16, 8 is converged to 0.3 % for the needle through the cube.
struct Resolution {
  int rings = 12;    ///< from the needle to the wall, of geometric thickness; a punch has a third as many inside it
  int sectors = 16;  ///< around the needle, a multiple of 8: the cube's edges lie between elements
  int layers = 8;    ///< along the needle
};

/// What the needle does to the tissue.
enum class NeedleMotion {
  lateral,      ///< through the whole cube, moved along y; tissue slides freely along it, as under lateral rows
  axial,        ///< through the whole cube, moved along x; bonded
  indentation,  ///< a flat smooth punch on the face x = 0, moved along x
  tip,          ///< flat end of a smooth needle that fills its channel down to the cube's centre, moved along x
};

/// Force per displacement of the rigid needle, N/m.
/// @throws std::runtime_error if the stiffness cannot be factorised (out of memory)
double resolved_stiffness(const ResolvedCube& cube, NeedleMotion motion, const Resolution& resolution);

}  // namespace stylet::reference
