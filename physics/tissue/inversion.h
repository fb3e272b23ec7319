// What keeps tetrahedra from turning inside out: an energy that grows without bound as one is squeezed flat, and how
// far a step may go before the first one is.
//
// Linear tetrahedra give way more and more where they are squeezed, and invert at a finite force. J = det F.
#pragma once

#include "physics/tissue/closest_rotation.h"
#include "physics/tissue/companion.h"
#include "physics/tissue/tissue_model.h"

#include <Eigen/Core>

#include <span>
#include <vector>

namespace stylet::physics {

/// Share of its volume below which a tetrahedron stiffens; above it (2) holds to the bit. Of the shipped sessions
/// only cyst_aspiration goes below it, in up to four tetrahedra beside the cyst. Engineering value.
inline constexpr double kSqueezed = 0.35;

/// The barrier psi(J) of eq. 40 and its derivatives, per volume at rest; all zero where J >= kSqueezed.
struct Barrier {
  double energy = 0;     ///< psi, Pa
  double slope = 0;      ///< psi', Pa; <= 0
  double curvature = 0;  ///< psi'', Pa; >= 0
};
/// @param j  J > 0: where a tetrahedron is inverted there is no barrier, and (2) turns it back
Barrier barrier(const TetRest& rest, double j);

/// d det F / dF.
Eigen::Matrix3d cofactor(const Eigen::Matrix3d& f);

/// What has a barrier of its own in a quadratic element: its four points, then its eight tetrahedra.
inline constexpr int kSqueezable = 12;

/// A tetrahedron in the barrier, as the stiffness needs it: psi'' and d J / dF where it is now.
struct SqueezedTet {
  int tet = 0;           ///< of quadratic elements: kSqueezable * element + which of it
  double curvature = 0;  ///< psi'', Pa
  Eigen::Matrix3d cofactor = Eigen::Matrix3d::Identity();
};
/// @param rest_size  as internal_forces(): tetrahedra of a cavity that is not full have no barrier
/// @param[out] found  ascending
void find_squeezed(const TissueModel& model, const Eigen::Matrix3Xd& positions, std::span<const double> rest_size,
                   std::vector<SqueezedTet>& found);

/// Largest fraction <= 1 of the straight way from `before` to `after` on which every tetrahedron, and every point of
/// a quadratic element, keeps three tenths of the volume that it has before. Exact to 1e-6: the volume is a cubic
/// along the way. What is inverted before does not count.
/// @param companion  takes a part of the elements; the bits do not know of it
double uninverted_fraction(const TissueModel& model, const Eigen::Matrix3Xd& before, const Eigen::Matrix3Xd& after,
                           Companion* companion = nullptr);
/// The same of one tetrahedron or point, up to `limit`.
/// @param before  its edges, or F;  @param change  of them on the whole way
double uninverted_fraction(const Eigen::Matrix3d& before, const Eigen::Matrix3d& change, double limit);
/// The same of four.
double uninverted_fraction(const LaneMatrix& before, const LaneMatrix& change, double limit);

}  // namespace stylet::physics
