#include "physics/contact/subgrid_compliance.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace stylet::physics {

namespace {

using std::numbers::pi;

// Below this logarithm a mesh is as fine as the needle is thick. Some compliance stays, so that contacts that share
// a tetrahedron keep independent rows.
constexpr double kLeastLogarithm = 0.1;
constexpr double kLeastOfTip = 0.05;         // of the compliance of the tip alone, for the same reason
constexpr double kMeanSquaredWeights = 0.4;  // sum of beta_a^2 of a point anywhere in a tetrahedron
constexpr double kMeanOnFace = 0.5;          // the same on a face
constexpr int kBisections = 24;
constexpr double kStiffest = 5;     // exponent, as the law of the elements has it
constexpr double kMostSpacing = 4;  // length / h up to which the calibration reaches

double shear_modulus(const ElasticMaterial& m) {
  return m.young_modulus / (2 * (1 + m.poisson_ratio));
}

double mesh_size(const SubgridSite& site) {
  return std::cbrt(6 * site.tet_volume);
}

// How much linear tetrahedra lock: with lambda / mu, 1 + lambda / mu = 1 / (1 - 2 nu). 0 at nu = 0, 3.5 at 0.45.
double locking(double poisson_ratio) {
  const double x = -std::log(1 - 2 * std::clamp(poisson_ratio, 0.0, 0.49));
  return x * std::sqrt(x);
}

// Of a punch on a half-space, what a tip at the end of its channel yields.
double channel_share(double poisson_ratio) {
  return 0.512 + 0.37 * poisson_ratio;
}

// How far a tip goes into what the mesh does not see, over the same without stiffening. Rings around the tip, each
// sheared to a slope s: c rho^2 s exp(b s^2/2) from the solid, and from a capsule the part of its tension that pulls
// up. Without stiffening the slopes from r to `reach` add up to `linear`.
double yielding(double b, double c, double capsule, double needle_radius, double linear, double force) {
  const double reach = 1 / std::max(1 / needle_radius - linear * c, 0.05 / needle_radius);
  const double width = std::log(reach / needle_radius);
  constexpr int kRings = 6;
  double depth = 0;
  double linear_depth = 0;
  for (int ring = 0; ring < kRings; ++ring) {
    const double rho = needle_radius * std::exp(width * (ring + 0.5) / kRings);
    const double solid = c * rho * rho;
    const double sheet = 2 * pi * rho * capsule;
    double low = 0;
    double high = force / solid;
    linear_depth += high * rho;
    for (int i = 0; i < kBisections; ++i) {
      const double s = 0.5 * (low + high);
      const double longer = std::sqrt(1 + s * s);
      const double held = solid * s * std::exp(std::min(0.5 * b * s * s, kStiffest)) + sheet * s * (1 - 1 / longer);
      (held > force ? high : low) = s;
    }
    depth += 0.5 * (low + high) * rho;
  }
  return depth / linear_depth;
}

}  // namespace

bool stiffens(const SubgridSite& site) {
  return site.material.stiffening > 0 || site.capsule > 0;
}

ShaftCompliance shaft_compliance(const SubgridSite& site, double needle_radius, double length) {
  const double g = shear_modulus(site.material), nu = site.material.poisson_ratio;
  const double h = mesh_size(site);
  const double off_mean = site.barycentric.squaredNorm() - kMeanSquaredWeights;
  const double lock = locking(nu);
  const double lateral_alpha = -0.695 + 0.110 * lock + (-2.97 + 0.245 * lock) * off_mean;  // ln alpha
  const double axial_alpha = -0.515 - 3.1 * off_mean;
  const double spacing = std::min(length / h, kMostSpacing);
  const double seen = std::log(h / needle_radius) - 0.03 * spacing * spacing * spacing;
  return {
      .lateral = (3 - 4 * nu) / (8 * pi * g * (1 - nu) * length) * std::max(seen + lateral_alpha, kLeastLogarithm),
      .axial = 1 / (2 * pi * g * length) * std::max(seen + axial_alpha, kLeastLogarithm)};
}

double turn_compliance(const SubgridSite& site, double length) {
  return 1 / (4 * pi * shear_modulus(site.material) * length);
}

double surface_tip_compliance(const SubgridSite& site, double needle_radius) {
  const double g = shear_modulus(site.material), nu = site.material.poisson_ratio;
  const double punch = (1 - nu) / (4 * g * needle_radius);
  const double seen = 1.85 + 2.2 * (site.barycentric.squaredNorm() - kMeanOnFace);
  return std::max(punch - seen * (1 - nu) / (2 * pi * g * mesh_size(site)), kLeastOfTip * punch);
}

double stiffened_tip_compliance(const SubgridSite& site, double needle_radius, double force) {
  const double linear = surface_tip_compliance(site, needle_radius);
  if (!(force > 0) || !stiffens(site)) return linear;
  const double c = 4 * shear_modulus(site.material) / (1 - site.material.poisson_ratio);
  return linear * yielding(site.material.stiffening, c, site.capsule, needle_radius, linear, force);
}

double channel_tip_compliance(const SubgridSite& site, double needle_radius) {
  const double g = shear_modulus(site.material), nu = site.material.poisson_ratio;
  const double lock = locking(nu);
  const double tip = channel_share(nu) * (1 - nu) / (4 * g * needle_radius);
  const double seen =
      1.4 - 0.13 * lock + (2.0 - 0.25 * lock) * (site.barycentric.squaredNorm() - kMeanSquaredWeights);
  return std::max(tip - seen / (4 * pi * g * mesh_size(site)), kLeastOfTip * tip);
}

double stiffened_channel_compliance(const SubgridSite& site, double needle_radius, double force) {
  const double linear = channel_tip_compliance(site, needle_radius);
  if (!(force > 0) || site.material.stiffening <= 0) return linear;
  const double nu = site.material.poisson_ratio;
  const double c = 4 * shear_modulus(site.material) / ((1 - nu) * channel_share(nu));
  return linear * yielding(site.material.stiffening, c, 0, needle_radius, linear, force);
}

}  // namespace stylet::physics
