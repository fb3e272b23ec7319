// The trunk of the patient: skin surface, layers of the abdominal wall, ribs, diaphragm.
//
// A point of the trunk is named by the angle around its axis (0 the patient's left, 90 anterior, 180 right), its
// height and its depth below the skin.
#pragma once

#include "engine/mesh/triangle_mesh.h"
#include "tools/make_patient/implicit.h"

#include <optional>

namespace stylet::patient::torso {

// Depths below the skin where one layer ends and the next begins, m.
inline constexpr double kSkinEnd = 2.0_mm;
inline constexpr double kFatEnd = 14.0_mm;
inline constexpr double kWallEnd = 24.0_mm;  ///< abdominal muscle ends; where there are ribs, they begin here
inline constexpr double kIntercostalEnd = 32.5_mm;

/// Lateral height of the ribs 7 to 11 in their planes, and the slope of those planes: ribs descend to the front.
inline constexpr int kFirstRib = 7;
inline constexpr int kLastRib = 11;
double rib_height(int rib);
/// Height at depth z of the plane between two neighbouring ribs; needle and image plane lie in it.
double intercostal_height(int upper_rib, double z);
Vector3 intercostal_plane_normal();

Vector3 point(double angle, double y, double depth);
/// Outward.
Vector3 normal(double angle, double y);
/// The skin point at `angle` in the plane between two ribs.
Vector3 intercostal_skin_point(int upper_rib, double angle);

/// First-order distance to the ellipse that lies `depth` below the skin all round; negative inside.
double inner_distance(const Vector3& x, double depth);

/// A layer of the abdominal wall: its section over the liver, rim included. Neighbouring layers share their surfaces
/// exactly.
/// @param depth_to  absent: the inner face; above the costal margin the intercostal muscle counts to the wall
mesh::TriangleMesh wall_layer(double depth_from, std::optional<double> depth_to = {});
/// The muscle between and around the ribs, above the costal margin, all round.
mesh::TriangleMesh intercostal_muscle();
mesh::TriangleMesh rib(int rib);
/// From the front ends of the ribs 7 to 10 along the costal margin to the sternum.
mesh::TriangleMesh costal_cartilage();

/// The space under the diaphragm: negative inside.
double subphrenic(const Vector3& x);
/// A dome between 1.3 and 4.8 mm outside the subphrenic space.
mesh::TriangleMesh diaphragm();

}  // namespace stylet::patient::torso
