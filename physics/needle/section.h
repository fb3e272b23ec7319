// Cross-section of the needle: stiffness of a hollow (or solid) circular section.
#pragma once

namespace stylet::physics {

/// Section times material: what a Timoshenko beam needs to know.
struct SectionStiffness {
  double axial = 0;    ///< E A, N
  double shear = 0;    ///< kappa G A, N
  double bending = 0;  ///< E I, N m^2, the same about both axes
  double torsion = 0;  ///< G J, N m^2
};

/// Shear coefficient of a hollow circular section, Cowper 1966.
/// @param diameter_ratio  inner over outer, 0 (solid) to <1 (thin tube)
double cowper_shear_coefficient(double diameter_ratio, double poisson_ratio);

/// Circular tube. Diameters in m (inner 0: solid), modulus in Pa.
SectionStiffness tube_section(double outer_diameter, double inner_diameter, double young_modulus,
                              double poisson_ratio);

}  // namespace stylet::physics
