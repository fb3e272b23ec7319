#include "engine/procedures/aspiration/flow.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace stylet::procedures::aspiration {
namespace {

constexpr double kAtmosphere = 101.3e3;  // p0, Pa
// Of Hagenbach's correction: 1 for the kinetic energy of a parabolic profile, the rest for how it comes about.
constexpr double kEntrance = 1.12;
constexpr double kLargestLaminar = 2300;  // Reynolds number

double fourth(double x) {
  return x * x * x * x;
}

/// 8 mu L / (pi r^4), Pa s/m^3.
double resistance(const Bore& bore, const Fluid& fluid) {
  return 8 * fluid.viscosity * bore.length / (std::numbers::pi * fourth(bore.diameter / 2));
}

/// m rho / (pi^2 r^4), Pa s^2/m^6.
double entrance(const Bore& bore, const Fluid& fluid) {
  return kEntrance * fluid.density / (std::numbers::pi * std::numbers::pi * fourth(bore.diameter / 2));
}

/// (4)
double vacuum_of(const Syringe& syringe, const DrawState& state) {
  const double space = syringe.gas + state.plunger - state.drawn;
  return space > 0 ? kAtmosphere * (1 - (syringe.gas + state.air) / space) : 0;
}

/// Space that the gas must have for a vacuum, m^3.
double space_for(const Syringe& syringe, const DrawState& state, double vacuum) {
  return (syringe.gas + state.air) / (1 - vacuum / kAtmosphere);
}

}  // namespace

double flow_rate(const Bore& bore, const Fluid& fluid, double pressure_drop, Law law) {
  if (!(bore.diameter > 0) || pressure_drop == 0) return 0;
  const double linear = resistance(bore, fluid);
  if (law == Law::poiseuille) return pressure_drop / linear;
  // The positive root of (2), in the form without a difference of near numbers.
  const double drop = std::abs(pressure_drop);
  const double flow = 2 * drop / (linear + std::sqrt(linear * linear + 4 * entrance(bore, fluid) * drop));
  return std::copysign(flow, pressure_drop);
}

FlowRegime regime(const Bore& bore, const Fluid& fluid, double flow) {
  if (!(bore.diameter > 0)) return {};
  const double radius = bore.diameter / 2;
  const double rate = std::abs(flow);
  const double moving = entrance(bore, fluid) * rate;
  FlowRegime regime;
  regime.mean_speed = rate / (std::numbers::pi * radius * radius);
  regime.reynolds = fluid.density * regime.mean_speed * bore.diameter / fluid.viscosity;
  regime.entrance_length = std::min(0.06 * regime.reynolds * bore.diameter, bore.length);
  regime.entrance_share = moving / (resistance(bore, fluid) + moving);
  return regime;
}

double laminar_limit(const Bore& bore, const Fluid& fluid) {
  const double flow = kLargestLaminar * std::numbers::pi * bore.diameter * fluid.viscosity / (4 * fluid.density);
  return (resistance(bore, fluid) + entrance(bore, fluid) * flow) * flow;
}

void draw(const Syringe& syringe, const Bore& bore, const Fluid& fluid, const DrawInput& input, double dt,
          DrawState& state) {
  if (input.pulls) {
    const double wanted = space_for(syringe, state, syringe.vacuum) - syringe.gas + state.drawn;
    const double reach = std::min(state.plunger + syringe.plunger_rate * dt, syringe.capacity);
    state.plunger = std::max(state.plunger, std::min(wanted, reach));
  }
  state.vacuum = vacuum_of(syringe, state);
  state.flow = 0;
  if (input.opening == Opening::air) {  // fifty times thinner than the fluid: at once
    state.air = std::max(state.air, state.plunger - state.drawn);
    state.vacuum = vacuum_of(syringe, state);
    return;
  }
  if (input.opening != Opening::fluid) return;
  const double drop = state.vacuum + input.pressure;
  if (!(drop > 0)) return;
  // While the hand pulls, the plunger makes room for what comes in; else the gas gives way until the pressures match.
  double most = std::min(input.available, syringe.capacity - state.drawn);
  if (!input.pulls || state.plunger >= syringe.capacity) {
    const double balance = space_for(syringe, state, -input.pressure);
    most = std::min(most, std::max(0.0, syringe.gas + state.plunger - state.drawn - balance));
  }
  const double volume = std::clamp(flow_rate(bore, fluid, drop) * dt, 0.0, std::max(most, 0.0));
  state.drawn += volume;
  state.flow = volume / dt;
  state.vacuum = vacuum_of(syringe, state);
}

}  // namespace stylet::procedures::aspiration
