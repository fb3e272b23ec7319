#include "physics/contact/lugre.h"

#include <algorithm>
#include <cmath>

namespace stylet::physics {

LugreRow::LugreRow(const LugreConstants& constants, double friction, double viscosity, double length,
                   const Bristles& bristles, double dt) {
  constexpr double kLeastFriction = 1e-6;  // of a deflection of 1 m: keeps the row defined where nothing rubs
  const double sigma_0 = constants.stiffness * length;
  const double speed = std::abs(bristles.velocity);
  const double ratio = bristles.velocity / constants.stribeck_velocity;
  const double g =
      std::max(friction * (1 + (constants.stiction - 1) * std::exp(-ratio * ratio)), kLeastFriction * sigma_0);
  const double sigma_1 = speed > 0 ? std::min(constants.damping * length, 4 * g / speed) : constants.damping * length;
  kept = 1 / (1 + dt * sigma_0 * speed / g);
  const double bristle_force = kept * (sigma_0 + sigma_1 / dt);
  const double stiffness = bristle_force + viscosity / dt;
  compliance = 1 / stiffness;
  offset = compliance * (bristle_force - sigma_1 / dt) * bristles.deflection;
}

double LugreRow::advance(double lambda, double dt, Bristles& bristles) const {
  const double u = -(compliance * lambda + offset);
  bristles.deflection = kept * (bristles.deflection + u);
  bristles.velocity = u / dt;
  return u;
}

}  // namespace stylet::physics
