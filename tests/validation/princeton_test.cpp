// The Princeton beam: a slender rectangular cantilever under a tip load that is turned about its axis; bending about
// both axes and torsion, coupled by large displacements.
#include "tests/support/beam_chain.h"
#include "tests/validation/residual.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <string>

namespace stylet::physics {
namespace {

using Eigen::Vector3d;
using validation::report_residual;

constexpr double kStripLength = 0.508, kWidth = 12.377e-3, kThickness = 3.2024e-3;  // m
constexpr double kStripYoung = 71.7e9, kPoisson = 0.31, kTorsion = 3.10380;         // Pa, -, N m^2
constexpr std::array<double, 3> kLoads{4.448, 8.896, 13.345};                       // N

/// Motion of the tip: along the axis, along the wide side (stiff), across it (soft), m; twist, degrees.
using TipMotion = std::array<double, 4>;

/// Exact Simo-Reissner solution without gravity, rounded to 1e-5 m and 1e-3 degrees.
struct Row {
  double angle_deg;  ///< of the load from the wide side
  std::array<TipMotion, 3> tips;
};
constexpr std::array<Row, 7> kExact{{
    {0, {{{-.00003, .00536, 0, 0}, {-.00014, .01072, 0, 0}, {-.00030, .01606, 0, 0}}}},
    {15, {{{-.00054, .00521, .02080, -.196}, {-.00224, .01063, .04213, -.799}, {-.00530, .01650, .06450, -1.853}}}},
    {30, {{{-.00192, .00475, .03995, -.337}, {-.00766, .01015, .07946, -1.341}, {-.01716, .01678, .11790, -2.990}}}},
    {45, {{{-.00375, .00397, .05606, -.385}, {-.01439, .00889, .10904, -1.490}, {-.03036, .01534, .15659, -3.181}}}},
    {60, {{{-.00553, .00286, .06813, -.330}, {-.02047, .00665, .12992, -1.245}, {-.04121, .01172, .18192, -2.570}}}},
    {75, {{{-.00680, .00150, .07557, -.189}, {-.02458, .00357, .14221, -.701}, {-.04807, .00633, .19612, -1.418}}}},
    {90, {{{-.00726, 0, .07808, 0}, {-.02602, 0, .14626, 0}, {-.05041, 0, .20069, 0}}}},
}};

/// The element is as stiff about one axis as about the other. Here it has the soft bending stiffness, and two fibres
/// at the wide side's radius of gyration carry what the stiff one has beyond it, as the section's own fibres do. The
/// fibres resist a change of the mean curvature alone: exact in the limit, with second order.
support::BeamChain princeton_beam(int count) {
  const double area = kWidth * kThickness, shear_modulus = kStripYoung / (2 * (1 + kPoisson));
  const double soft = kStripYoung * kWidth * std::pow(kThickness, 3) / 12;
  const double stiff = kStripYoung * kThickness * std::pow(kWidth, 3) / 12;
  const double in_fibres = 1 - soft / stiff;
  auto chain = support::BeamChain::straight(count, kStripLength,
                                            {.axial = (1 - in_fibres) * kStripYoung * area,
                                             .shear = 5.0 / 6.0 * shear_modulus * area,
                                             .bending = soft,
                                             .torsion = kTorsion});
  const SectionStiffness fibre{.axial = 0.5 * in_fibres * kStripYoung * area, .shear = 1, .bending = 0, .torsion = 0};
  for (const double side : {-1, 1}) chain.add_fibre(side * kWidth / std::sqrt(12) * Vector3d::UnitY(), fibre);
  return chain;
}

/// All three loads, one after the other. y is the wide side, z the soft direction.
std::array<TipMotion, 3> tip_motions(int count, double angle_deg) {
  support::BeamChain chain = princeton_beam(count);
  const double angle = angle_deg * std::numbers::pi / 180;
  std::array<TipMotion, 3> tips{};
  for (std::size_t i = 0; i < kLoads.size(); ++i) {
    Vector6d load = Vector6d::Zero();
    load[1] = kLoads[i] * std::cos(angle);
    load[2] = kLoads[i] * std::sin(angle);
    EXPECT_LE(chain.solve(load, 1e-9), 15);
    const Eigen::Matrix3d& r = chain.nodes.back().orientation;
    const double twist = std::atan2(r(2, 1) - r(1, 2), r(1, 1) + r(2, 2)) * 180 / std::numbers::pi;
    tips[i] = {chain.tip().x() - kStripLength, chain.tip().y(), chain.tip().z(), twist};
  }
  return tips;
}

// The fibres converge with second order, so 32 and 64 beams give the limit by extrapolation; what is left is then the
// rounding of the table, half of its last digit, and a fifth of that for the terms of fourth order.
TEST(PrincetonBeam, MatchesTheExactTable) {
  for (const Row& row : kExact) {
    const auto coarse = tip_motions(32, row.angle_deg), fine = tip_motions(64, row.angle_deg);
    double displacement = 0, twist = 0;
    for (std::size_t i = 0; i < kLoads.size(); ++i) {
      for (std::size_t k = 0; k < 4; ++k) {
        const double error = std::abs((4 * fine[i][k] - coarse[i][k]) / 3 - row.tips[i][k]);
        (k < 3 ? displacement : twist) = std::max(k < 3 ? displacement : twist, error);
      }
    }
    const std::string name = "Princeton, load at " + std::to_string(static_cast<int>(row.angle_deg)) + " degrees, ";
    report_residual(name + "displacements, m", displacement, 6e-6);
    report_residual(name + "twist, degrees", twist, 6e-4);
  }
}

TEST(PrincetonBeam, ConvergesWithSecondOrder) {
  const auto a = tip_motions(16, 45), b = tip_motions(32, 45), c = tip_motions(64, 45);
  double worst = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    const double order = std::log2((b[2][k] - a[2][k]) / (c[2][k] - b[2][k]));
    std::printf("  observed order %.2f\n", order);
    worst = std::max(worst, std::abs(order - 2));
  }
  report_residual("Princeton, observed order less 2", worst, 0.15);
}

}  // namespace
}  // namespace stylet::physics
