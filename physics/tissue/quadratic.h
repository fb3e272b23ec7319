// Quadratic tetrahedra with one dilatation each (P2/P0): they bend, and do not lock where tissue hardly gives way.
//
// Ten nodes, four Gauss points. Shape is measured at the points, volume in the mean of the element (physics/README.md
// eq. 42 to 48). A run of eight tetrahedra of the mesh is one element (refinement.h), so whoever asks where something
// is sees tetrahedra alone.
#pragma once

#include "physics/tissue/closest_rotation.h"
#include "physics/tissue/companion.h"
#include "physics/tissue/element_scratch.h"
#include "physics/tissue/inversion.h"
#include "physics/tissue/strain_law.h"
#include "physics/tissue/strain_memory.h"
#include "physics/tissue/tissue_model.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cstddef>
#include <span>
#include <vector>

namespace stylet::physics {

/// The elements of a mesh of refined tetrahedra.
/// @param materials  [tets]; a point has those of the two tetrahedra next to it, in layers if they differ (eq. 51)
/// @throws std::invalid_argument if the tetrahedra are not runs of eight as refined() makes them, or an element is
///         not positively oriented at one of its points
std::vector<QuadraticRest> quadratic_elements(const TetMesh& mesh, std::span<const ElasticMaterial> materials);

/// Volume at rest of each of the four points of an element, m^3; not positive where it is not positively oriented
/// there.
/// @param element  of a mesh of refined tetrahedra
/// @throws std::invalid_argument if its tetrahedra are not as refined() makes them
Eigen::Array4d volumes_at_points(const TetMesh& mesh, std::size_t element);

/// Gradients of the shape functions at the four points, [node][axis], 1/m.
std::array<std::array<Lanes, 3>, 10> gradients_of(const QuadraticRest& rest);

/// Where the nodes of a tetrahedron of the mesh are among the ten of its element.
std::array<std::size_t, 4> places_of(const TissueModel& model, int tet);

/// As update_rotations(). Counts points and tetrahedra of the mesh with det F <= 0.
int update_quadratic_rotations(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                               std::span<Eigen::Quaterniond> rotations);

/// As update_rotations_and_forces(), without the capsule, of the elements of a run alone.
/// @param[in,out] forces  [3 x nodes of the run], added to, N
ElementCount update_quadratic_rotations_and_forces(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                                                   std::span<Eigen::Quaterniond> rotations, const TetRun& run,
                                                   Eigen::Ref<Eigen::Matrix3Xd> forces,
                                                   std::span<const double> rest_size,
                                                   std::span<const StrainMemory> memory, const Relaxing& relaxing);
/// As internal_forces(), of the same.
int quadratic_forces(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                     std::span<const Eigen::Quaterniond> rotations, const TetRun& run,
                     Eigen::Ref<Eigen::Matrix3Xd> forces, std::span<const double> rest_size,
                     std::span<const StrainMemory> memory);

/// cof F = dJ/dF of every point, which turn and stretch the gradient of the volume (eq. 44).
/// @param[out] cofactors  [points]
/// @param companion       takes a part of the loop, here and below; the bits do not know of it
void find_cofactors(const TissueModel& model, const Eigen::Matrix3Xd& positions, std::span<Eigen::Matrix3d> cofactors,
                    Companion* companion = nullptr);

/// As find_squeezed(), of points and tetrahedra.
void find_squeezed_quadratics(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                              std::span<const double> rest_size, std::vector<SqueezedTet>& found);

/// As uninverted_fraction(), of the points of a run.
double uninverted_fraction_of_points(const TissueModel& model, const Eigen::Matrix3Xd& before,
                                     const Eigen::Matrix3Xd& after, const TetRun& run);

/// As find_stiffening(), of one element.
void find_quadratic_stiffening(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                               std::span<const Eigen::Quaterniond> rotations, std::span<const double> rest_size,
                               std::size_t element, std::span<PointStiffness> stiffness);
/// As relax_strain().
void relax_quadratic_strain(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                            std::span<const Eigen::Quaterniond> rotations, std::span<const double> rest_size,
                            double dt, std::span<StrainMemory> memory, Companion* companion);

/// As internal_forces(), without the capsule; returns the number of points in the barrier.
/// @param linearised  at the given rotations: linear in the positions, without barrier
int quadratic_forces(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                     std::span<const Eigen::Quaterniond> rotations, Eigen::Ref<Eigen::Matrix3Xd> forces,
                     std::span<const double> rest_size, bool linearised, std::span<const StrainMemory> memory);

/// As elastic_energy(), without the capsule.
double quadratic_energy(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                        std::span<const Eigen::Quaterniond> rotations, std::span<const double> rest_size,
                        std::span<const StrainMemory> memory);

/// What an element of a cavity does: its volume, and the work of its stress as all its lengths grow.
struct ElementWork {
  double volume = 0;  ///< m^3
  double work = 0;    ///< dU / d ln of the lengths, J
};
/// @param size    edge without stress over that at rest (eq. 34)
/// @param memory  [elements] or empty
ElementWork work_of(const TissueModel& model, const Eigen::Matrix3Xd& positions,
                    std::span<const Eigen::Quaterniond> rotations, int element, double size,
                    std::span<const StrainMemory> memory = {});

}  // namespace stylet::physics
