#include "tools/bench/subgrid_calibration.h"

#include "physics/contact/subgrid_compliance.h"
#include "tools/reference/tied_needle.h"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

namespace stylet::bench {

const char* name_of(reference::NeedleMotion motion) {
  constexpr std::array kNames{"lateral", "axial", "indentation", "channel_tip"};
  return kNames[static_cast<std::size_t>(motion)];
}

namespace {

constexpr double kPi = std::numbers::pi;

double shear_modulus(const reference::ResolvedCube& cube) {
  return cube.material.young_modulus / (2 * (1 + cube.material.poisson_ratio));
}

// ln alpha as physics/contact has it, for a site of the given sum of squared weights.
double built_in_log_alpha(const reference::ResolvedCube& cube, reference::NeedleMotion motion,
                          double squared_weights) {
  const double g = shear_modulus(cube), nu = cube.material.poisson_ratio;
  const double h = 0.02, length = 1e-3;
  // Weights (1 - 3 b, b, b, b) with the sum of squares asked for.
  const double b = (3 - std::sqrt(12 * squared_weights - 3)) / 12;
  const physics::SubgridSite site{
      .tet_volume = h * h * h / 6, .material = cube.material, .barycentric = Eigen::Vector4d(1 - 3 * b, b, b, b)};
  const physics::ShaftCompliance c = physics::shaft_compliance(site, cube.needle_radius, length);
  const double k =
      motion == reference::NeedleMotion::axial ? 1 / (2 * kPi * g) : (3 - 4 * nu) / (8 * kPi * g * (1 - nu));
  const double compliance = motion == reference::NeedleMotion::axial ? c.axial : c.lateral;
  return compliance * length / k - std::log(h / cube.needle_radius);
}

/// ln alpha = at_mean + slope (sum beta^2 - 0.4), least squares over lines through meshes.
struct AlphaFit {
  double at_mean = 0;
  double slope = 0;
  double rms = 0;  ///< of what is left
};

struct AlphaSample {
  double squared_weights = 0;  ///< mean over the line
  double log_alpha = 0;
};

AlphaFit fit(const std::vector<AlphaSample>& samples) {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (const AlphaSample& s : samples) {
    const double off_mean = s.squared_weights - 0.4;
    n += 1;
    x += off_mean;
    y += s.log_alpha;
    xx += off_mean * off_mean;
    xy += off_mean * s.log_alpha;
  }
  AlphaFit result;
  result.slope = (n * xy - x * y) / (n * xx - x * x);
  result.at_mean = (y - result.slope * x) / n;
  for (const AlphaSample& s : samples) {
    const double left = s.log_alpha - result.at_mean - result.slope * (s.squared_weights - 0.4);
    result.rms += left * left / n;
  }
  result.rms = std::sqrt(result.rms);
  return result;
}

// The line runs through the middle of cells, along nodes, and between; and through meshes without order.
std::vector<reference::Lattice> calibration_lattices(bool quick) {
  std::vector<reference::Lattice> lattices;
  for (const int nodes : quick ? std::vector{9} : std::vector{8, 9, 11, 12}) {
    for (const double y : {0.0, 0.25, 0.5})
      for (const double z : {0.0, 0.25, 0.5}) lattices.push_back({.nodes_per_edge = nodes, .offset = {y, z}});
    lattices.push_back({.nodes_per_edge = nodes, .jitter = 0.25});
  }
  return lattices;
}

}  // namespace

Report calibrate_subgrid(reference::ResolvedCube cube, double nu, bool quick) {
  Report report;
  cube.material.poisson_ratio = nu;
  cube.support = reference::Support::walls;
  std::array<std::vector<AlphaSample>, 2> samples;
  std::array<double, 2> target{};
  for (const reference::NeedleMotion motion : {reference::NeedleMotion::lateral, reference::NeedleMotion::axial}) {
    target[static_cast<std::size_t>(motion)] = reference::resolved_stiffness(
        cube, motion, quick ? reference::Resolution{8, 8, 6} : reference::Resolution{10, 16, 6});
  }
  for (const reference::Lattice& lattice : calibration_lattices(quick)) {
    reference::MeshedCube mesh(cube, lattice);
    // A hair beside the middle, where tetrahedra meet.
    const reference::TiedNeedle needle =
        reference::tie_needle(mesh, 0.500001 * cube.edge, 0.500002 * cube.edge, cube.edge, 50);
    double squared_weights = 0;
    for (const auto& point : needle.points) squared_weights += point.barycentric.squaredNorm() / 50;
    for (const reference::NeedleMotion motion : {reference::NeedleMotion::lateral, reference::NeedleMotion::axial}) {
      samples[static_cast<std::size_t>(motion)].push_back(
          {squared_weights,
           reference::fitted_log_alpha(mesh, needle, motion, target[static_cast<std::size_t>(motion)])});
    }
  }
  for (const reference::NeedleMotion motion : {reference::NeedleMotion::lateral, reference::NeedleMotion::axial}) {
    const AlphaFit f = fit(samples[static_cast<std::size_t>(motion)]);
    const std::string name = fmt::format("calibration.nu_{:.2f}.{}.", nu, name_of(motion));
    const double built_in = built_in_log_alpha(cube, motion, 0.4);
    const double built_in_slope = (built_in_log_alpha(cube, motion, 0.6) - built_in) / 0.2;
    report.add({name + "ln_alpha", f.at_mean, "1", built_in, {}, {}});
    report.add({name + "ln_alpha_by_weights", f.slope, "1", built_in_slope, {}, {}});
    report.add({name + "rms_left", f.rms, "1", {}, {}, {}});
    report.add(at_most(name + "off_built_in", std::abs(f.at_mean - built_in), "1", 0.1));
  }
  return report;
}

}  // namespace stylet::bench
