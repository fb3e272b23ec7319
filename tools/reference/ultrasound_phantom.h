// A virtual test object for ultrasound, as real scanners are checked on: wires, grey-scale targets, stepped
// cylinders, zones of attenuation, a rib, a fluid cylinder. Small scenes, one a question, and all of it for looking
// at.
//
// Patient frame = probe frame: the face at the origin, x to the right of the image, z into the block; nothing changes
// along y. Sound travels at 1540 m/s.
#pragma once

#include "engine/content/scene.h"
#include "engine/state/frame_state.h"

#include <Eigen/Core>

#include <cstdint>
#include <functional>
#include <vector>

namespace stylet::reference {

/// A block of labels.
struct PhantomBlock {
  Eigen::Vector3f low{-0.125F, -0.008F, -0.012F};  ///< the top is above the ends of a convex face
  Eigen::Vector3f high{0.125F, 0.008F, 0.17F};
  float spacing = 0.0005F;
  bool prism = true;  ///< nothing changes along y: `shape` is asked at the y of `low` alone
};

/// @param shape  label at a point, m
/// @return  with probe defaults (convex), nothing deformable
content::Scene block_scene(std::vector<content::Tissue> tissues, const PhantomBlock& block,
                           const std::function<std::uint8_t(const Eigen::Vector3f&)>& shape);

/// Makes the whole block of `scene` a deformable body of (cells)^3 hexahedra cut into six tetrahedra each.
void make_deformable(content::Scene& scene, int cells);

/// `scene` at rest: bodies undeformed, probe at its pose, no needle.
state::FrameState at_rest(const content::Scene& scene);

/// Straight needle in `state`: from the hub to the tip, `beams` beams.
void place_needle(state::FrameState& state, const Eigen::Vector3f& hub, const Eigen::Vector3f& tip, int beams = 8);

/// A cylinder along y.
struct Cylinder {
  double x = 0;
  double z = 0;
  double radius = 0;

  bool holds(double at_x, double at_z, double margin = 0) const;
};
/// A cylinder of the background's attenuation and impedance, whose backscatter differs.
struct GreyTarget {
  Cylinder where;
  double contrast_db = 0;  ///< over the background
};
inline constexpr double kAnechoicDb = -90;

inline constexpr double kBackgroundAttenuation = 0.5;  ///< dB/cm/MHz
inline constexpr double kDenseAttenuation = 0.7;
inline constexpr double kFluidAttenuation = 0.06;

/// At 70 mm: anechoic and 8 mm wide; -6, -3, +3, +6 dB and 12 mm wide.
const std::vector<GreyTarget>& grey_targets();
/// Anechoic, at 40 mm: the area of each 1.5 times that of the one before; and a large one at 120 mm.
const std::vector<Cylinder>& stepped_cylinders();
inline constexpr Cylinder kRib{-0.030, 0.030, 0.006};
inline constexpr Cylinder kFluidCylinder{0.030, 0.060, 0.012};
/// Places (x, z) of the wires: a column every 10 mm, a row at 90 mm every 20 mm.
std::vector<Eigen::Vector2d> wire_places();

/// The background alone, deformable.
content::Scene uniform_phantom();
/// The background left, the dense zone right of the middle.
content::Scene zone_phantom();
/// Wires in the background. The gain is low enough that no wire is shown white.
content::Scene wire_phantom();
content::Scene target_phantom();
/// The rib and the fluid cylinder.
content::Scene obstacle_phantom();
/// Everything.
content::Scene whole_phantom();

}  // namespace stylet::reference
