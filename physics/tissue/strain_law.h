// How the shape part of an element's stress grows with strain and fades with time (physics/README.md eq. 45 to 47).
//
// Four points at once: those of a quadratic element, or four linear tetrahedra.
#pragma once

#include "physics/tissue/closest_rotation.h"
#include "physics/tissue/strain_memory.h"

#include <Eigen/Core>

#include <array>
#include <span>

namespace stylet::physics {

/// The law of four points.
struct StrainLaw {
  bool linear = true;                                                                   ///< at all points, no layers
  Eigen::Array4d stiffening = Eigen::Array4d::Zero();                                   ///< b of eq. 45, -
  std::array<Eigen::Array4d, 2> share{Eigen::Array4d::Zero(), Eigen::Array4d::Zero()};  ///< g_i of eq. 45, -
  std::array<Eigen::Array4d, 2> rate{Eigen::Array4d::Zero(), Eigen::Array4d::Zero()};   ///< 1/tau_i, 1/s
};

/// Layers at four points: sheets in plane stress, beside the law of what is across them   (eq. 51).
struct LayerLaw {
  bool layered = false;                            ///< at some point
  Eigen::Array4d sheets = Eigen::Array4d::Zero();  ///< s: what they are stiffer along, over mu
  std::array<Eigen::Array4d, 3> normal{Eigen::Array4d::Zero(), Eigen::Array4d::Zero(),
                                       Eigen::Array4d::Zero()};  ///< unit, at rest; zero: there are none
  double spread = 0;                                             ///< c, -
};

/// S = sym(R^T F), -.
LaneMatrix stretch_of(const LaneMatrix& r, const LaneMatrix& f);
/// E = S - g I, -.
LaneMatrix strain_of(const LaneMatrix& stretch, const Lanes& size);

/// dU/dF over 2 mu in the frame that turns with the point: U's derivative is 2 mu R times this.
/// @param strain  E
/// @param size    g, edge without stress over that at rest
/// @param memory  null: nothing has relaxed
/// @param layers  null: none
LaneMatrix stress_of(const StrainLaw& law, const LaneMatrix& strain, const Lanes& size, const StrainMemory* memory,
                     const LayerLaw* layers = nullptr);

/// U over mu: what stands for |E|^2 of the linear law.
Lanes energy_of(const StrainLaw& law, const LaneMatrix& strain, const StrainMemory* memory,
                const LayerLaw* layers = nullptr);

/// L E = P E P + c tr(P E P) P, P = I - n n^T: what sheets in plane stress make of a strain   (eq. 51).
LaneMatrix along_layers(const LayerLaw& layers, const LaneMatrix& strain);

/// How the law of a point has stiffened it (eq. 47).
struct PointStiffness {
  double ratio = 1;  ///< secant: times mu
  /// Along the strain: sqrt(2 b g_inf exp(b |E|^2)) R E.
  Eigen::Matrix3d along = Eigen::Matrix3d::Zero();
};
/// @param r                [row][column] rotations of the points
/// @param[out] of_points   [4]
void find_stiffness(const StrainLaw& law, const LaneMatrix& r, const LaneMatrix& strain,
                    std::span<PointStiffness> of_points);

/// One step of what relaxes, at a strain that stays: alpha += (1 - exp(-h/tau)) (E - alpha)   (eq. 46).
/// @param dt  h, s
void relax(const StrainLaw& law, const LaneMatrix& strain, double dt, StrainMemory& memory);

}  // namespace stylet::physics
