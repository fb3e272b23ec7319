// Fluid through a needle into a syringe: Hagen and Poiseuille, with the entrance, and a hand that pulls.
//
// SI. Pressures are relative to the atmosphere, positive above it; a vacuum is positive below it.
//
//   1  Q = pi r^4 dp / (8 mu L)                                laminar flow through a bore
//   2  dp = 8 mu L Q / (pi r^4) + m rho Q^2 / (pi^2 r^4)       with what it costs to get the fluid moving, m = 1.12
//   3  Re = 2 rho Q / (pi r mu)                                laminar below 2300
//   4  vacuum = p0 (1 - G0 / G)                                gas of the syringe, G0 its volume at p0 (Boyle)
#pragma once

namespace stylet::procedures::aspiration {

/// The way through the needle.
struct Bore {
  double diameter = 0;  ///< inner, m; 0: solid, nothing flows
  double length = 0;    ///< hub to tip, m
};

/// Serous fluid, as in a simple cyst: 0.96 mm^2/s in a viscometer (0.90-1.15), 1.63 mPa s (1.27-2.09) in a capillary
/// (Celik et al., Sci. Rep. 13, 2023, 22178); a value between the two.
struct Fluid {
  double viscosity = 1.3e-3;  ///< Pa s
  double density = 1005;      ///< kg/m^3
};

/// What makes a flow.
enum class Law {
  poiseuille,  ///< (1)
  entrance,    ///< (2): Hagenbach's correction, as in viscometers
};

/// Flow under a pressure drop, m^3/s; 0 where there is none, negative where it is.
/// @param pressure_drop  Pa
double flow_rate(const Bore& bore, const Fluid& fluid, double pressure_drop, Law law = Law::entrance);

/// What a flow is like.
struct FlowRegime {
  double mean_speed = 0;       ///< m/s
  double reynolds = 0;         ///< (3)
  double entrance_length = 0;  ///< until the profile is a parabola, 0.06 Re d, m; at most the bore's length
  double entrance_share = 0;   ///< of the pressure drop that (1) leaves out
  bool laminar() const { return reynolds < 2300; }
};
FlowRegime regime(const Bore& bore, const Fluid& fluid, double flow);

/// Pressure drop above which (2) gives a Reynolds number of 2300, Pa: beyond it the flow may be turbulent, and is
/// less than any of the laws says. 22G, 150 mm: 320 kPa, more than there is; 18G: 46 kPa, which a hand does pull.
double laminar_limit(const Bore& bore, const Fluid& fluid);

/// 20 ml syringes reach 69 kPa by hand, 10 ml ones 58 kPa (Haseler et al., Cardiovasc. Intervent. Radiol. 34, 2011,
/// 590: 517 and 435 torr); a larger one takes more force for the same.
struct Syringe {
  double capacity = 60e-6;      ///< m^3
  double gas = 0.5e-6;          ///< in its tip and the needle's hub before it is pulled, m^3 at p0; engineering value
  double vacuum = 60e3;         ///< that the hand holds at most, Pa
  double plunger_rate = 20e-6;  ///< that the hand pulls at most, m^3/s; engineering value
};

/// Where the needle's opening lies.
enum class Opening {
  tissue,  ///< or against the wall: closed
  fluid,
  air,  ///< the syringe fills with air
};

/// What one step needs to know.
struct DrawInput {
  bool pulls = false;  ///< else the hand lets the plunger follow: what vacuum there is goes on drawing
  Opening opening = Opening::tissue;
  double pressure = 0;   ///< of the fluid, Pa
  double available = 0;  ///< fluid left there, m^3
};

/// Syringe and what was drawn into it.
struct DrawState {
  double plunger = 0;  ///< volume behind it, m^3
  double drawn = 0;    ///< fluid, m^3
  double air = 0;      ///< that came in through the needle, m^3 at p0
  double vacuum = 0;   ///< Pa
  double flow = 0;     ///< mean of the last step, m^3/s
};

/// One step: the hand moves the plunger, then fluid flows under the vacuum that this makes. So a vacuum that the hand
/// holds gives exactly Q dt; never more than is available, than the syringe holds, or than makes the pressures equal.
/// @param dt  s
void draw(const Syringe& syringe, const Bore& bore, const Fluid& fluid, const DrawInput& input, double dt,
          DrawState& state);

}  // namespace stylet::procedures::aspiration
