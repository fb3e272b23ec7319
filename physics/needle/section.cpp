#include "physics/needle/section.h"

#include <cmath>
#include <numbers>

namespace stylet::physics {

double cowper_shear_coefficient(double diameter_ratio, double poisson_ratio) {
  const double m2 = diameter_ratio * diameter_ratio;
  const double nu = poisson_ratio;
  const double s = (1 + m2) * (1 + m2);
  return 6 * (1 + nu) * s / ((7 + 6 * nu) * s + (20 + 12 * nu) * m2);
}

SectionStiffness tube_section(double outer_diameter, double inner_diameter, double young_modulus,
                              double poisson_ratio) {
  const double ro = 0.5 * outer_diameter;
  const double ri = 0.5 * inner_diameter;
  const double area = std::numbers::pi * (ro * ro - ri * ri);
  const double inertia = std::numbers::pi / 4 * (std::pow(ro, 4) - std::pow(ri, 4));
  const double shear_modulus = young_modulus / (2 * (1 + poisson_ratio));
  const double kappa = cowper_shear_coefficient(inner_diameter / outer_diameter, poisson_ratio);
  return {.axial = young_modulus * area,
          .shear = kappa * shear_modulus * area,
          .bending = young_modulus * inertia,
          .torsion = shear_modulus * 2 * inertia};
}

}  // namespace stylet::physics
