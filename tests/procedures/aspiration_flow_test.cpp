// Fluid through a needle into a syringe, against formulas written out here and numbers of ISO 9626.
#include "engine/procedures/aspiration/flow.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>

namespace stylet::procedures::aspiration {
namespace {

constexpr double kMillilitre = 1e-6;
constexpr Bore k18G{.diameter = 0.838e-3, .length = 0.150};  // regular wall, ISO 9626
constexpr Bore k20G{.diameter = 0.603e-3, .length = 0.150};
constexpr Bore k22G{.diameter = 0.413e-3, .length = 0.150};
constexpr Fluid kSerous{};

TEST(AspirationFlow, IsHagenPoiseuilleWhereTheNeedleIsThin) {
  // Water at 20 C, 1.002 mPa s, through a capillary of 0.2 mm and 100 mm under 10 kPa: 3.92 mm^3/s by hand.
  const Bore capillary{.diameter = 0.2e-3, .length = 0.1};
  const Fluid water{.viscosity = 1.002e-3, .density = 998};
  EXPECT_NEAR(flow_rate(capillary, water, 10e3, Law::poiseuille), 3.9194e-9, 1e-12);
  EXPECT_NEAR(flow_rate(capillary, water, 10e3) / flow_rate(capillary, water, 10e3, Law::poiseuille), 1, 0.01);
  // The fourth power of the diameter, and the inverse of length and viscosity.
  const double flow = flow_rate(k22G, kSerous, 1e3, Law::poiseuille);
  EXPECT_NEAR(flow_rate({2 * k22G.diameter, k22G.length}, kSerous, 1e3, Law::poiseuille) / flow, 16, 1e-9);
  EXPECT_NEAR(flow_rate({k22G.diameter, k22G.length / 3}, kSerous, 1e3, Law::poiseuille) / flow, 3, 1e-9);
  EXPECT_NEAR(flow_rate(k22G, {.viscosity = kSerous.viscosity / 2}, 1e3, Law::poiseuille) / flow, 2, 1e-9);
}

TEST(AspirationFlow, EntranceTakesWhatItsLawSays) {
  for (const Bore& bore : {k18G, k20G, k22G}) {
    for (const double drop : {100.0, 5e3, 60e3}) {
      const double q = flow_rate(bore, kSerous, drop);
      const double r4 = std::pow(bore.diameter / 2, 4);
      const double back = 8 * kSerous.viscosity * bore.length * q / (std::numbers::pi * r4) +
                          1.12 * kSerous.density * q * q / (std::numbers::pi * std::numbers::pi * r4);
      EXPECT_NEAR(back / drop, 1, 1e-12);
      EXPECT_LT(q, flow_rate(bore, kSerous, drop, Law::poiseuille));
      EXPECT_EQ(flow_rate(bore, kSerous, -drop), -q);
    }
  }
  EXPECT_EQ(flow_rate(k18G, kSerous, 0), 0);
  EXPECT_EQ(flow_rate({.diameter = 0, .length = 0.15}, kSerous, 60e3), 0);
}

TEST(AspirationFlow, ReportsTheLaminarLimit) {
  struct Gauge {
    const char* name;
    Bore bore;
  };
  for (const auto& [name, bore] : {Gauge{"18G", k18G}, Gauge{"20G", k20G}, Gauge{"22G", k22G}}) {
    const double q = flow_rate(bore, kSerous, 60e3);
    const FlowRegime at = regime(bore, kSerous, q);
    std::printf(
        "  %s, 60 kPa: %.2f ml/s (%.2f by Poiseuille), %.1f m/s, Re %.0f, entrance %.0f mm and %.0f %% of the drop; "
        "laminar below %.0f kPa\n",
        name, q / kMillilitre, flow_rate(bore, kSerous, 60e3, Law::poiseuille) / kMillilitre, at.mean_speed,
        at.reynolds, at.entrance_length * 1e3, 100 * at.entrance_share, laminar_limit(bore, kSerous) * 1e-3);
    const FlowRegime limit = regime(bore, kSerous, flow_rate(bore, kSerous, laminar_limit(bore, kSerous)));
    EXPECT_NEAR(limit.reynolds, 2300, 1e-6);
    EXPECT_NEAR(at.reynolds, 4 * kSerous.density * q / (std::numbers::pi * bore.diameter * kSerous.viscosity), 1e-6);
  }
  EXPECT_TRUE(regime(k22G, kSerous, flow_rate(k22G, kSerous, 60e3)).laminar());
  EXPECT_FALSE(regime(k18G, kSerous, flow_rate(k18G, kSerous, 60e3)).laminar()) << "a hand can pull that much";
}

/// Draws until a time.
DrawState drain(const Syringe& syringe, const Bore& bore, DrawInput input, double seconds, double dt) {
  DrawState state;
  const double full = input.available;
  for (int i = 0; i < std::lround(seconds / dt); ++i) {
    input.available = full - state.drawn;
    draw(syringe, bore, kSerous, input, dt, state);
  }
  return state;
}

TEST(AspirationFlow, HeldVacuumDrawsFlowTimesTimeWhateverTheStep) {
  const Syringe quick{.plunger_rate = 1};  // the vacuum is there at once
  for (const double dt : {0.1, 0.02, 0.001}) {
    const DrawState state =
        drain(quick, k20G, {.pulls = true, .opening = Opening::fluid, .available = 50e-6}, 10, dt);
    EXPECT_NEAR(state.drawn / (10 * flow_rate(k20G, kSerous, quick.vacuum)), 1, 1e-9) << dt;
    EXPECT_GE(state.plunger, state.drawn);
  }
}

TEST(AspirationFlow, VacuumIsBoylesAndNeverMoreThanTheHandHolds) {
  const Syringe syringe;
  DrawState state;
  for (int i = 0; i < 100; ++i) {  // in tissue: nothing flows
    draw(syringe, k18G, kSerous, {.pulls = true, .opening = Opening::tissue}, 0.005, state);
    const double space = syringe.gas + state.plunger;
    EXPECT_NEAR((101.3e3 - state.vacuum) * space, 101.3e3 * syringe.gas, 1e-9);
    EXPECT_LE(state.vacuum, syringe.vacuum * (1 + 1e-12));
  }
  EXPECT_NEAR(state.vacuum, syringe.vacuum, 1e-6);
  EXPECT_EQ(state.drawn, 0);
  const double plunger = state.plunger;
  // Let go in the fluid it draws on until the pressures are equal, and not a drop more.
  for (int i = 0; i < 500; ++i) {
    draw(syringe, k18G, kSerous, {.opening = Opening::fluid, .pressure = -5e3, .available = 40e-6}, 0.02, state);
  }
  EXPECT_NEAR(state.vacuum, 5e3, 1);
  EXPECT_NEAR(syringe.gas + plunger - state.drawn, syringe.gas / (1 - 5e3 / 101.3e3), 1e-10);
  // Out in the air it is lost.
  draw(syringe, k18G, kSerous, {.pulls = true, .opening = Opening::air}, 0.02, state);
  EXPECT_NEAR(state.vacuum, 0, 1e-6);
  EXPECT_GT(state.air, 0);
}

TEST(AspirationFlow, NeverTakesMoreThanThereIsOrThanTheSyringeHolds) {
  const DrawState empty = drain({}, k18G, {.pulls = true, .opening = Opening::fluid, .available = 20e-6}, 60, 0.02);
  EXPECT_NEAR(empty.drawn, 20e-6, 1e-18);
  EXPECT_LE(empty.drawn, 20e-6 * (1 + 1e-12));
  const Syringe small{.capacity = 10e-6};
  const DrawState full = drain(small, k18G, {.pulls = true, .opening = Opening::fluid, .available = 50e-6}, 60, 0.02);
  EXPECT_LE(full.drawn, small.capacity);
  EXPECT_GT(full.drawn, 0.94 * small.capacity);  // the rest is the gas that it began with
  EXPECT_NEAR(full.vacuum, 0, 1);
}

TEST(AspirationFlow, StopsWhereTheCystPullsAsHardAsTheHandAndWhereTheOpeningIsShut) {
  const Syringe syringe;
  const DrawState pulled_back =
      drain(syringe, k18G,
            {.pulls = true, .opening = Opening::fluid, .pressure = -syringe.vacuum, .available = 50e-6}, 5, 0.02);
  EXPECT_LT(pulled_back.drawn, 1e-12);
  const DrawState shut =
      drain(syringe, k18G, {.pulls = true, .opening = Opening::tissue, .available = 50e-6}, 5, 0.02);
  EXPECT_EQ(shut.drawn, 0);
  EXPECT_EQ(shut.flow, 0);
}

}  // namespace
}  // namespace stylet::procedures::aspiration
