// Corotational Timoshenko beam element for large displacements and rotations (Battini and Pacoste 2002).
#pragma once

#include "physics/needle/plastic_bend.h"
#include "physics/needle/section.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace stylet::physics {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;
using Vector12d = Eigen::Matrix<double, 12, 1>;
using Matrix12d = Eigen::Matrix<double, 12, 12>;

/// A beam between two nodes, without load but for what has stayed of bending.
struct Beam {
  double length = 0;  ///< rest length, m
  Eigen::Matrix3d rest_frame =
      Eigen::Matrix3d::Identity();  ///< node frame <- element frame at rest, x along the beam
  SectionStiffness section;
  BendingStrength strength{};
  PlasticBend bend{};
};

/// Pose of one end: position and node frame -> patient frame.
struct BeamEnd {
  Eigen::Vector3d position;
  Eigen::Matrix3d orientation;
};

/// Force and tangent on the 12 DOFs (translation, spin of the first node, then of the second), patient frame.
/// Spins act from the left: R <- exp(w) R.
struct BeamResponse {
  Vector12d force;    ///< internal force: the exact gradient of beam_energy()
  Matrix12d tangent;  ///< symmetric part of the derivative of the force
};

/// Which part of the tangent to compute.
enum class Tangent {
  full,      ///< with the geometric part (buckling, stress stiffening); may be indefinite
  material,  ///< positive semi-definite whatever the load
};

/// Elastic energy, J (physics/README.md eq. 9).
double beam_energy(const Beam& beam, const BeamEnd& a, const BeamEnd& b);

/// Internal force and tangent (physics/README.md eq. 10, 11).
/// The cited tangent leaves out the change of the frame's coefficients with the load, which is of third order in the
/// local rotations (relative error 7e-6 at 0.2 rad against differences of the force). Away from equilibrium the
/// derivative of a moment with respect to spins has an antisymmetric part that no Newton step needs: it is
/// symmetrised.
/// @realtime  no allocation
BeamResponse beam_response(const Beam& beam, const BeamEnd& a, const BeamEnd& b, Tangent tangent = Tangent::full);

/// The same, once what the ends' rotations are beyond the beam's strength has stayed (physics/README.md eq. 37). The
/// tangent is that of further yielding where it yielded. Nothing else where it did not, to the bit.
/// @realtime  no allocation
BeamResponse yielding_response(Beam& beam, const BeamEnd& a, const BeamEnd& b, Tangent tangent = Tangent::full);

}  // namespace stylet::physics
