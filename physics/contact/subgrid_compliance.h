// What a needle feels of the tissue closer to it than the mesh can see.
#pragma once

#include "physics/tissue/tet_mesh.h"

#include <Eigen/Core>

namespace stylet::physics {

/// Where on the mesh the needle is tied to the tissue. A mesh yields more under a point near a node, where one node
/// takes the force, than in the middle of a tetrahedron: hence the weights.
struct SubgridSite {
  double tet_volume = 0;  ///< of the tetrahedra there, at rest, m^3; their size is h = (6 V)^(1/3): the edge of the
                          ///< cell for Kuhn tetrahedra
  ElasticMaterial material;
  double strained = 1;  ///< E over that at rest
  double capsule = 0;   ///< modulus times thickness of the membrane over the surface, N/m
  Eigen::Vector4d barycentric = Eigen::Vector4d::Constant(0.25);
};

/// Compliance to add to W on the diagonal of a contact's rows, m/N; never negative.
struct ShaftCompliance {
  double lateral = 0;  ///< each of the two rows normal to the shaft
  double axial = 0;    ///< a row along the shaft, where there is friction
};

/// A needle of radius r loads the tissue along a line, and the displacement under a line load grows with the
/// logarithm of the distance down to r; a mesh stops near its own size h. Missing (physics/README.md eq. 19):
///   c = K / length * ln(alpha h / r),  K = (3 - 4 nu) / (8 pi G (1 - nu)) lateral (Kelvin, plane strain),
///                                      K = 1 / (2 pi G) axial (antiplane shear).
/// alpha is calibrated by `stylet bench line-compliance` for linear tetrahedra, nu 0 to 0.49. Contacts should not
/// stand further apart than 2 h; up to 4 h the sum of single forces is allowed for, beyond that too little is
/// subtracted.
/// @param needle_radius  m
/// @param length         of shaft that the contact stands for, m
/// @realtime pure, no allocation
ShaftCompliance shaft_compliance(const SubgridSite& site, double needle_radius, double length);

/// How far the surface of a shaft that turns goes round per force along it, m/N: 1 / (4 pi G length), from the twist
/// u = u_r r / distance of an infinite body round a rigid cylinder. All of it: the points of a mesh do not turn.
/// @realtime pure, no allocation
double turn_compliance(const SubgridSite& site, double length);

/// The same for the force of a flat tip on the surface, before puncture, along its normal (eq. 20): Boussinesq's
/// rigid punch less what the mesh yields under a point force, m/N.
/// @param site  its point lies on a face of the surface
/// @realtime pure, no allocation
double surface_tip_compliance(const SubgridSite& site, double needle_radius);

/// Whether tissue is ever less compliant the further a tip goes into it.
bool stiffens(const SubgridSite& site);

/// That of tissue which stiffens, under a capsule: how far the tip goes into what the mesh does not see, over the
/// force (eq. 20b). surface_tip_compliance() where there is neither, or no force.
/// @param force  on the tip, N
/// @realtime pure, no allocation
double stiffened_tip_compliance(const SubgridSite& site, double needle_radius, double force);

/// The same for a flat tip at the bottom of its own channel, along the needle (eq. 21), m/N.
/// @realtime pure, no allocation
double channel_tip_compliance(const SubgridSite& site, double needle_radius);

/// That of tissue which stiffens (eq. 21b); a capsule is behind the tip there. channel_tip_compliance() where it does
/// not, or without force.
/// @param force  on the tip, N
/// @realtime pure, no allocation
double stiffened_channel_compliance(const SubgridSite& site, double needle_radius, double force);

}  // namespace stylet::physics
