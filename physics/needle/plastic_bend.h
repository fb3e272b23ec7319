// Bending beyond the strength of the needle's steel: a section that yields, and what stays bent of a beam.
#pragma once

#include <Eigen/Core>

#include <array>

namespace stylet::physics {

/// Moment that a circular tube of an elastic, ideally plastic material carries   (physics/README.md eq. 37):
///   M(p) = M_y + (M_p - M_y) x,  p = 0.16 (M_y/EI) x^2 / (1 - x),   p the plastic curvature that it has been
///   through.
/// The fibres farthest out yield at M_y, all of them at M_p; between them that follows the exact curve of a tube to
/// 1 % of M_y. Bent back, it yields at -M(p): what fibres hold against each other is left out.
struct BendingStrength {
  double first = 0;      ///< M_y, N m; 0: never yields
  double full = 0;       ///< M_p, N m
  double curvature = 0;  ///< 0.16 M_y/EI, 1/m

  bool limited() const { return first > 0; }
};

/// Diameters in m (inner 0: solid), modulus and yield strength in Pa (0: never yields).
BendingStrength tube_strength(double outer_diameter, double inner_diameter, double young_modulus,
                              double yield_strength);

/// What a beam has of plastic bending: the plastic curvature of either half, as a rotation of the end there in the
/// element frame (about y and z, which ride with the needle). End rotations without stress, in other words.
struct PlasticBend {
  std::array<Eigen::Vector2d, 2> turn{Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};  ///< rad
  std::array<double, 2> path{};  ///< that each end has been through, rad: never falls
  std::array<bool, 2> yields{};  ///< in the last flow()
  std::array<Eigen::Vector2d, 2> direction{Eigen::Vector2d::Zero(), Eigen::Vector2d::Zero()};  ///< of moment, unit
  double work = 0;  ///< done on the steel, J: never falls

  bool yielding() const { return yields[0] || yields[1]; }
  /// Angle between the ends that stays without stress, rad.
  double angle() const { return (turn[1] - turn[0]).norm(); }
};

/// Lets a beam yield: implicit return of both ends' moments to what the section carries, m = K (theta - turn), by
/// Gauss-Seidel on the two ends, each exact.
/// @param rotations  of the ends about y and z, element frame, rad
/// @param near, far  K of an end with itself and with the other one, N m/rad
/// @param length     of the beam, m
/// @realtime no allocation; at most 40 sweeps, none where nothing yields
void flow(const BendingStrength& strength, const std::array<Eigen::Vector2d, 2>& rotations, double near, double far,
          double length, PlasticBend& bend);

/// Stiffness to linearise with while the ends yield as in the last flow() [4 x 4]: K - K N (h + N^T K N)^-1 N^T K, N
/// the directions of the moments that yield, with h = near + far instead of the hardening, which is less. So it is
/// half of K or more, and a Newton step neither overshoots whether the ends go on yielding or not, nor do its
/// iterates, each of which leaves what has yielded, bend the needle further than it is.
Eigen::Matrix4d yielding_stiffness(const PlasticBend& bend, double near, double far);

}  // namespace stylet::physics
