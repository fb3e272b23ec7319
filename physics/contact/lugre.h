// LuGre friction of a contact on the shaft, as a linear row of the contact system.
#pragma once

namespace stylet::physics {

/// Constants of the bristles, beside the tissue's own friction. The model is that of Canudas de Wit, Olsson, Astrom
/// and Lischinsky (IEEE Trans. Autom. Control 40(3), 1995), in use for needles since Asadian, Kermani and Patel (2010
/// on). The values are ours, of the order that such fits have for 18G in liver; they were measured on nothing.
struct LugreConstants {
  double stiffness = 6e4;           ///< sigma_0 per length of shaft, N/m^2: 18 N/m of friction at 0.3 mm
  double damping = 300;             ///< sigma_1 per length of shaft, N s/m^2: 5 ms of the stiffness
  double stiction = 1.2;            ///< static over Coulomb friction, >= 1
  double stribeck_velocity = 2e-3;  ///< where most of that has gone, m/s
};

/// What a contact remembers.
struct Bristles {
  double deflection = 0;  ///< z, m
  double velocity = 0;    ///< of the needle over the tissue in the last step, m/s
};

/// One step of the bristles by backward Euler with |v| of the step before   (README eq. 29):
///   z' = v - sigma_0 |v| z / g(v),  force = sigma_0 z + sigma_1 z' + sigma_2 v
/// With the motion u = v dt of the step the force is K u + f_0: linear, so the contact's row stays bilateral, with
/// the compliance 1/K and the motion f_0/K on its right side. Passive at any dt: energy of the bristles and what they
/// take are never less than what comes in, as long as sigma_1 <= 4 g(v)/|v|, to which it is limited.
struct LugreRow {
  double compliance = 0;  ///< 1/K, m/N
  double offset = 0;      ///< f_0/K, m
  double kept = 1;        ///< z at the end of the step is this part of z + u

  /// @param friction   Coulomb friction of the contact, N, >= 0
  /// @param viscosity  sigma_2 of the contact, N s/m
  /// @param length     of shaft that it stands for, m, > 0
  LugreRow(const LugreConstants& constants, double friction, double viscosity, double length,
           const Bristles& bristles, double dt);
  /// After the solve. @return u, how far the needle has moved over the tissue in the step, m
  double advance(double lambda, double dt, Bristles& bristles) const;
};

}  // namespace stylet::physics
