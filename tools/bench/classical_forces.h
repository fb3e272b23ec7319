// The force models that the paper cites (II), to run on the same motion as the coupled one.
#pragma once

#include <Eigen/Core>

#include <span>
#include <string_view>

namespace stylet::bench {

/// What a classical model knows of a needle: one sample of a recorded motion. No tissue moves, nothing is coupled.
struct NeedleMotion {
  double depth = 0;                                     ///< of the tip below the surface at rest, m; negative outside
  double velocity = 0;                                  ///< along the needle, positive inward, m/s
  double inserted_length = 0;                           ///< of shaft inside, m
  Eigen::Vector2d deviation = Eigen::Vector2d::Zero();  ///< of the shaft from its track, across the needle, m
  double diameter = 1.27e-3;                            ///< outer, m
  double dt = 1e-3;                                     ///< since the sample before, s
};

/// What a model keeps from sample to sample.
struct TrackState {
  bool punctured = false;
  double deepest = 0;   ///< end of the track cut so far, m
  double friction = 0;  ///< of the sample before, N (Karnopp)
  double bristle = 0;   ///< mean deflection of the bristles, m (LuGre)
};

/// On the hand, N.
struct ClassicalForce {
  double axial = 0;  ///< positive pushes the needle out
  Eigen::Vector2d lateral = Eigen::Vector2d::Zero();
};

/// Okamura et al. 2004: capsule stiffness, a polynomial of second order of the depth until it is punctured; then
/// friction after Karnopp per inserted length, with a stick band; and a constant cutting force while the track grows.
/// In the band the hand's force would decide; the motion is prescribed here, so friction keeps what it had, up to its
/// static limit.
ClassicalForce okamura_force(const NeedleMotion& motion, TrackState& state);

/// Exponentials of the depth (Pepley et al.): rising before the puncture, falling to the cutting force behind it, and
/// friction that saturates. There is no velocity in it: withdrawal runs back along the same curve.
ClassicalForce depth_exponential_force(const NeedleMotion& motion, TrackState& state);

/// Nonlinear in velocity and diameter (after Wu et al.), along the motion: (c + f L) (d / d0) (|v| / v0)^q. The
/// arguments are the paper's account of theirs; the power law is ours.
ClassicalForce velocity_diameter_force(const NeedleMotion& motion, TrackState& state);

/// After Alamilla et al.: capsule stiffness; after the puncture cutting, LuGre friction per inserted length, and a
/// lateral force that grows with the deviation from the track. LuGre by backward Euler, stable at any dt:
///   z' = v - s0 |v| z / g(v),  g = f_c + (f_s - f_c) exp(-(v / v_s)^2),  f = s0 z + s1 z' + s2 v
ClassicalForce lugre_force(const NeedleMotion& motion, TrackState& state);

struct ClassicalModel {
  std::string_view name;
  ClassicalForce (*force)(const NeedleMotion&, TrackState&);
};
std::span<const ClassicalModel> classical_models();

/// Where a number comes from.
enum class Origin {
  recalled,  ///< quoted second-hand from the publication named, not checked against it
  derived    ///< ours, so that all models draw one profile at 5 mm/s (classical_forces.cpp); not measured
};
struct ForceConstant {
  std::string_view model;
  std::string_view name;
  double value;
  std::string_view unit;
  Origin origin;
};
/// All numbers in the models.
std::span<const ForceConstant> classical_constants();

}  // namespace stylet::bench
