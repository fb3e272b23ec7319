// Needles as they are sold: shear coefficient of the tube, and stiffness derived from the gauge.
#include "physics/needle/needle.h"
#include "tests/support/beam_chain.h"
#include "tests/validation/residual.h"
#include "tools/reference/dense_algebra.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>

namespace stylet::physics {
namespace {

using validation::report_residual;

/// Cowper's definition, 2 (1 + nu) I / (-(A/I) int x (chi + x y^2) dA) (I_x = I_y), with the flexure function of a
/// tube of outer radius 1 and inner radius m, chi = -(3/4 + nu/2)((1 + m^2) r + m^2/r) cos t + r^3/4 cos 3t.
double integrated_shear_coefficient(double m, double nu) {
  constexpr std::array<double, 4> kPoint{-.8611363115940526, -.3399810435848563, .3399810435848563,
                                         .8611363115940526};
  constexpr std::array<double, 4> kWeight{.3478548451374538, .6521451548625461, .6521451548625461, .3478548451374538};
  constexpr int kAngles = 16;  // exact for these products of cosines, as four Gauss points are for the radius
  double integral = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const double r = 0.5 * (1 + m) + 0.5 * (1 - m) * kPoint[i];
    for (int k = 0; k < kAngles; ++k) {
      const double t = 2 * std::numbers::pi * k / kAngles;
      const double x = r * std::cos(t), y = r * std::sin(t);
      const double chi =
          -(0.75 + 0.5 * nu) * ((1 + m * m) * r + m * m / r) * std::cos(t) + 0.25 * r * r * r * std::cos(3 * t);
      integral += x * (chi + x * y * y) * r * kWeight[i] * 0.5 * (1 - m) * 2 * std::numbers::pi / kAngles;
    }
  }
  const double area = std::numbers::pi * (1 - m * m);
  const double inertia = std::numbers::pi / 4 * (1 - std::pow(m, 4));
  return -2 * (1 + nu) * inertia * inertia / (area * integral);
}

TEST(Section, ShearCoefficientMatchesCowper) {
  double worst = 0, worst_limit = 0;
  for (const double nu : {0.0, 0.3, 0.33, 0.45}) {
    for (const double m : {0.01, 0.3, 0.66, 0.724, 0.95}) {
      worst = std::max(worst, std::abs(cowper_shear_coefficient(m, nu) / integrated_shear_coefficient(m, nu) - 1));
    }
    const double solid = 6 * (1 + nu) / (7 + 6 * nu), thin = 2 * (1 + nu) / (4 + 3 * nu);
    worst_limit = std::max({worst_limit, std::abs(cowper_shear_coefficient(0, nu) / solid - 1),
                            std::abs(cowper_shear_coefficient(1, nu) / thin - 1)});
  }
  report_residual("shear coefficient of tubes over Cowper's integral, less 1", worst, 1e-12);
  report_residual("the same, solid circle and thin tube", worst_limit, 1e-14);
}

/// Derived stiffness of 150 mm needles: E 200 GPa (steel) and 60 GPa (NiTi), nu 0.3, clamped at the hub. The
/// diameters are the catalogue's; the other columns have the digits that stand there, cut or rounded: one unit of the
/// last is their tolerance.
struct Gauge {
  int gauge;
  double outer_mm, inner_mm;
  double bending, tip_stiffness, buckling_free, buckling_pinned, bending_nitinol;
};
constexpr std::array<Gauge, 4> kGauges{{{17, 1.473, 1.067, .0335, 29.8, 3.67, 30.1, .0101},
                                        {18, 1.270, .838, .0207, 18.4, 2.27, 18.6, .0062},
                                        {20, .908, .603, .00538, 4.78, .59, 4.83, .0016},
                                        {22, .718, .413, .00232, 2.06, .25, 2.08, .0007}}};
constexpr double kNeedleLength = 0.150;

/// Load at which a chain, compressed by it, turns unstable with its tip free or pinned.
double buckling_load(const SectionStiffness& s, int beams, bool pinned, double high) {
  const auto stable = [&](double p) {
    auto chain = support::BeamChain::straight(beams, kNeedleLength, s);
    for (auto& node : chain.nodes) node.position *= 1 - p / s.axial;
    if (!pinned) return chain.is_stable();
    Eigen::MatrixXd k;
    Eigen::VectorXd f;
    chain.assemble(k, f);
    const Eigen::Index n = k.rows();
    k(n - 5, n - 5) += 1e9;  // the pin: far stiffer than the needle, N/m
    k(n - 4, n - 4) += 1e9;
    return reference::is_positive_definite(k);
  };
  double low = 0;
  EXPECT_FALSE(stable(high));
  for (int i = 0; i < 40; ++i) (stable(0.5 * (low + high)) ? low : high) = 0.5 * (low + high);
  return low;
}

TEST(NeedleGauges, StiffnessIsTheTables) {
  for (const Gauge& g : kGauges) {
    const NeedleProperties steel{
        .length = kNeedleLength, .outer_diameter = 1e-3 * g.outer_mm, .inner_diameter = 1e-3 * g.inner_mm};
    const auto section = [&](double young) {
      return tube_section(steel.outer_diameter, steel.inner_diameter, young, steel.poisson_ratio);
    };
    const std::string name = std::to_string(g.gauge) + "G ";
    const auto report = [&](const char* what, double value, double reference, double last_digit) {
      std::printf("  %s%s %.5g (table %.4g)\n", name.c_str(), what, value, reference);
      report_residual(name + what + " off the table", std::abs(value - reference), last_digit);
    };
    report("EI steel, N m^2", section(200e9).bending, g.bending, g.bending < .01 ? 1e-5 : 1e-4);
    report("EI NiTi, N m^2", section(60e9).bending, g.bending_nitinol, 1e-4);

    const StylusPose hub;
    Needle needle(steel, {});
    ASSERT_TRUE(needle.linearise(straight_needle(steel, hub), hub, 1e-3));
    Eigen::VectorXd load = Eigen::VectorXd::Zero(6 * needle.node_count()), motion = load;
    load[load.size() - 6] = 1;
    needle.solve(load, motion);
    report("k_tip, N/m", 1 / motion[motion.size() - 6], g.tip_stiffness, g.tip_stiffness < 10 ? 1e-2 : 1e-1);
    // 8 beams buckle up to 0.4 % late, and at 2.5 times the wave number of the pinned case more: 32 beams here.
    report("P_cr fixed-free, N", buckling_load(section(200e9), 32, false, 8), g.buckling_free, 1e-2);
    report("P_cr fixed-pinned, N", buckling_load(section(200e9), 32, true, 80), g.buckling_pinned,
           g.buckling_pinned < 10 ? 1e-2 : 1e-1);
  }
}

}  // namespace
}  // namespace stylet::physics
