// The field of a radio-frequency electrode in tissue.
#pragma once

#include "engine/procedures/ablation/bioheat.h"

#include <Eigen/Core>

#include <vector>

namespace stylet::procedures::ablation {

/// A straight needle electrode: the bare part at its tip. Patient frame at rest, m.
struct Electrode {
  Eigen::Vector3d tip = Eigen::Vector3d::Zero();
  Eigen::Vector3d base = Eigen::Vector3d::Zero();  ///< where the insulation begins
  double radius = 0.75e-3;
};

/// How the power of an electrode is distributed over the cells of a grid, 1/m^3, sum times cell volume 1:
/// s ~ |E|^2 of a uniform line source between tip and base, which is exactly the field of a conducting prolate
/// spheroid with these foci in a medium of one conductivity,
///
///   |E|^2 ~ (1 + cos g) / (s^2 - L^2)^2,   s = r_1 + r_2,  g the angle between r_1 and r_2               (1)
///
/// r_1, r_2 from the ends, L their distance: 1/r^2 along the electrode, 1/r^4 far off. Nothing within its radius. The
/// little that would go beyond the grid is taken to stay in it.
std::vector<double> power_density(const CellGrid& grid, const Electrode& electrode);

}  // namespace stylet::procedures::ablation
