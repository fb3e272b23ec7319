// Corotational linear elasticity on tetrahedra: rotations, internal forces, energy.
#pragma once

#include "physics/tissue/closest_rotation.h"
#include "physics/tissue/element_scratch.h"
#include "physics/tissue/strain_law.h"
#include "physics/tissue/strain_memory.h"
#include "physics/tissue/tissue_model.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <span>
#include <vector>

namespace stylet::physics {

/// Deformation gradient F of a tetrahedron, -.
Eigen::Matrix3d deformation_gradient(const TissueModel& model, const Eigen::Matrix3Xd& positions, int tet);

/// Brings the rotations to `positions`; returns the number of inverted tetrahedra (det F <= 0).
/// @param positions           [3 x nodes], m
/// @param[in,out] rotations   [points] rest -> deformed, warm start
int update_rotations(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                     std::span<Eigen::Quaterniond> rotations);

/// F_int(p) = dU/dp = sum R K0 (R^T x - X)   (eq. 3), and of the barrier (eq. 40). Equilibrium is F_int(p) = external
/// force. Returns the number of tetrahedra in the barrier or beyond it.
/// @param rotations    [points] of these very positions (update_rotations)
/// @param rest_size    [tets] edge without stress over that at rest (eq. 34); empty: 1
/// @param with_barrier false: at given rotations linear in the positions
/// @param memory       [memory_count()] what has relaxed (eq. 46); empty: nothing has
/// @param[out] forces  [3 x nodes], N; at fixed nodes minus the reaction of the support
int internal_forces(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                    std::span<const Eigen::Quaterniond> rotations, Eigen::Ref<Eigen::Matrix3Xd> forces,
                    std::span<const double> rest_size = {}, bool with_barrier = true,
                    std::span<const StrainMemory> memory = {});
/// The same bits, with the barrier, with the companion's help.
int internal_forces(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                    std::span<const Eigen::Quaterniond> rotations, Eigen::Ref<Eigen::Matrix3Xd> forces,
                    std::span<const double> rest_size, std::span<const StrainMemory> memory, ElementScratch& scratch);

/// update_rotations(), relax_strain() if asked for, then internal_forces() with the barrier, run by run, in one pass
/// where F and R are found once; of linear tetrahedra four at a time. Equal to those to rounding.
/// @param relaxing  makes memory of later: that is what the forces are of, then
ElementCount update_rotations_and_forces(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                                         std::span<Eigen::Quaterniond> rotations, Eigen::Ref<Eigen::Matrix3Xd> forces,
                                         std::span<const double> rest_size, std::span<const StrainMemory> memory,
                                         ElementScratch& scratch, const Relaxing& relaxing = {});

/// How the law has stiffened each point   (eq. 47).
/// @param rotations         [points] of these very positions
/// @param[out] stiffness    [points]
/// @param companion         takes a part of the elements, here and below; the bits do not know of it
void find_stiffening(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                     std::span<const Eigen::Quaterniond> rotations, std::span<const double> rest_size,
                     std::span<PointStiffness> stiffness, Companion* companion = nullptr);
/// The same next to some nodes; elsewhere `stiffness` stays as it is.
void find_stiffening_around(std::span<const int> nodes, const TissueModel& model, const Eigen::Matrix3Xd& positions,
                            std::span<const Eigen::Quaterniond> rotations, std::span<const double> rest_size,
                            std::span<PointStiffness> stiffness);

/// A step of what relaxes, at a strain that stays   (eq. 46).
/// @param rotations       [points] of these very positions
/// @param dt              h, s
/// @param[in,out] memory  [memory_count()]
void relax_strain(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                  std::span<const Eigen::Quaterniond> rotations, std::span<const double> rest_size, double dt,
                  std::span<StrainMemory> memory, Companion* companion = nullptr);

/// Elastic energy U(p), J   (eq. 2, 34, 37).
double elastic_energy(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                      std::span<const Eigen::Quaterniond> rotations, std::span<const double> rest_size = {},
                      std::span<const StrainMemory> memory = {});

/// Stress and strain of a tetrahedron in its own rotated frame.
struct CorotatedStress {
  Eigen::Matrix3d stretch;  ///< S = sym(R^T F), -
  Eigen::Matrix3d stress;   ///< sigma of S - g I, Pa per area at rest
};
/// @param rest_size  g, edge without stress over that at rest (eq. 34)
CorotatedStress corotated_stress(const TetRest& rest, const Eigen::Matrix3d& f, const Eigen::Matrix3d& r,
                                 double rest_size = 1);
/// The same with the tetrahedron's law (eq. 45): `stress` times R is dU/dF, and no longer symmetric.
/// @param memory  [memory_count()] or empty
CorotatedStress corotated_stress(const TissueModel& model, int tet, const Eigen::Matrix3d& f,
                                 const Eigen::Matrix3d& r, double rest_size, std::span<const StrainMemory> memory);

}  // namespace stylet::physics
