// What sub-grid compliance makes of the dependence on mesh and contact spacing, and of the contact system.
#include "tools/bench/coupling_parts.h"
#include "tools/reference/dense_algebra.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

namespace stylet::bench {
namespace {

using physics::Coupling;
using physics::TipState;

constexpr double kMeshBound = 3;         // % spread of the peak force
constexpr double kTipBound = 10;         // % spread of the indentation
constexpr double kConditionBound = 1e3;  // of W + C

/// How often the worker delivers a factor: about what it manages at 50 Hz.
int worker_period(int nodes_per_edge) {
  return nodes_per_edge < 14 ? 1 : 5;
}

/// Largest condition numbers over a run.
struct Condition {
  double plain = 1;
  /// With every row scaled to a diagonal of 1: a contact just laid stands for little shaft, so its compliance is
  /// large by design, which is no loss of digits.
  double scaled = 1;
};

double condition_of(const Eigen::MatrixXd& matrix) {
  const Eigen::VectorXd eigenvalues = reference::symmetric_eigenvalues(matrix);
  const double most = eigenvalues.maxCoeff();
  // What rounding leaves of a dependent row may have any sign.
  return most / std::max(eigenvalues.minCoeff(), std::numeric_limits<double>::epsilon() * most);
}

/// Of the contact system of the last step.
void watch(const physics::HapticLoop& haptic, Condition& worst) {
  const int rows = haptic.delassus().rows();
  if (rows < 2) return;
  Eigen::MatrixXd system = haptic.delassus().matrix();
  system.triangularView<Eigen::StrictlyUpper>() = system.transpose();
  for (int r = 0; r < rows; ++r) system(r, r) += haptic.laws()[r].compliance;
  worst.plain = std::max(worst.plain, condition_of(system));
  const Eigen::VectorXd scale = system.diagonal().cwiseSqrt().cwiseInverse();
  worst.scaled = std::max(worst.scaled, condition_of(scale.asDiagonal() * system * scale.asDiagonal()));
}

struct MeshRun {
  double peak = 0;  // of |F|, N
  Condition condition;
  std::uint32_t flags = 0;
};

MeshRun run_mesh(const reference::ReferenceInsertion& insertion, bool subgrid) {
  reference::ReferenceExperiment experiment(insertion, {.coupling = Coupling::stylet,
                                                        .track = {.subgrid_compliance = subgrid},
                                                        .worker_period = worker_period(insertion.nodes_per_edge)});
  MeshRun result;
  const int watched_every = insertion.haptic_steps_per_simulation_step() / 4;
  while (experiment.time_s() < insertion.duration) {
    experiment.simulation_step();
    for (int i = 0; i < insertion.haptic_steps_per_simulation_step(); ++i) {
      experiment.haptic_step();
      if (i % watched_every == 0) watch(experiment.haptic(), result.condition);
    }
  }
  for (const Eigen::Vector3d& force : experiment.forces()) result.peak = std::max(result.peak, force.norm());
  result.flags = experiment.needle_flags();
  return result;
}

/// How far a needle presses the surface in before it breaks, m; NaN if it does not break.
double indentation_at_puncture(const reference::ReferenceInsertion& insertion, bool subgrid, double tip_radius) {
  constexpr double kForce = 0.05;   // N
  constexpr double kSpeed = 0.010;  // m/s: the depth is known to 10 um
  reference::ReferenceInsertion straight = insertion;
  straight.lateral_amplitude = 0;
  straight.axial_speed = {{0, kSpeed}, {1, kSpeed}};
  straight.duration = 1;
  reference::ReferenceExperiment experiment(straight,
                                            {.coupling = Coupling::stylet,
                                             .track = {.subgrid_compliance = subgrid, .tip_radius = tip_radius},
                                             .tissues = one_tissue({.puncture_force = kForce}),
                                             .worker_period = worker_period(insertion.nodes_per_edge)});
  double depth = 0;
  while (experiment.time_s() < straight.duration) {
    experiment.simulation_step();
    for (int i = 0; i < straight.haptic_steps_per_simulation_step(); ++i) {
      experiment.haptic_step();
      const physics::NeedleState& needle = experiment.needle();
      if (needle.tip == TipState::inside) return depth;
      // The cube's face is the plane x = 0.
      if (needle.tip == TipState::indenting) depth = needle.positions(0, needle.node_count - 1);
    }
  }
  return std::numeric_limits<double>::quiet_NaN();
}

/// One answer by mesh or spacing, without and with sub-grid compliance.
struct Pair {
  std::vector<double> off, on;
};

figures::PlotPanel panel(const std::string& title, const std::string& x_label, const std::string& y_label,
                         const std::vector<double>& x, const Pair& y, double scale) {
  const auto scaled = [&](std::vector<double> values) {
    for (double& v : values) v *= scale;
    return values;
  };
  return {.title = title,
          .x = {.label = x_label},
          .y = {.label = y_label, .min = 0},
          .series = {plot_line("single points", x, scaled(y.off), 1),
                     plot_line("with sub-grid compliance", x, scaled(y.on), 0)},
          .markers = {},
          .dots = {}};
}

}  // namespace

Report coupling_subgrid(const reference::ReferenceInsertion& insertion, const BenchOptions& options) {
  const std::vector<int> meshes = options.quick ? std::vector{7, 10} : std::vector{7, 10, 12, 14, 17};
  const std::vector<double> spacings =
      options.quick ? std::vector{0.010, 0.005} : std::vector{0.010, 0.005, 0.0025, 0.00125};

  Report report;
  Pair peaks, depths;
  std::vector<double> blunt_depths;  // with the radius that sessions have: the mesh itself resolves most of it
  std::vector<double> nodes;
  Condition condition;
  std::uint32_t flags = 0;
  for (const int n : meshes) {
    std::fprintf(stderr, "bench coupling: %d nodes an edge\n", n);
    reference::ReferenceInsertion mesh = insertion;
    mesh.nodes_per_edge = n;
    const MeshRun off = run_mesh(mesh, false);
    const MeshRun on = run_mesh(mesh, true);
    nodes.push_back(n);
    peaks.off.push_back(off.peak);
    peaks.on.push_back(on.peak);
    condition.plain = std::max(condition.plain, on.condition.plain);
    condition.scaled = std::max(condition.scaled, on.condition.scaled);
    flags |= on.flags;
    const double needle_radius = 0.5 * insertion.needle.outer_diameter;
    depths.off.push_back(indentation_at_puncture(mesh, false, needle_radius));
    depths.on.push_back(indentation_at_puncture(mesh, true, needle_radius));
    blunt_depths.push_back(indentation_at_puncture(mesh, true, physics::NeedleTrackSettings{}.tip_radius));
    report.add({fmt::format("subgrid.peak.{}", n), on.peak, "N", {}, {}, {}});
  }
  report.add({"subgrid.spread.off", kPercent * relative_spread(peaks.off), "%", {}, {}, {}});
  report.add(at_most("subgrid.spread.on", kPercent * relative_spread(peaks.on), "%", kMeshBound));

  Pair by_spacing;
  std::vector<double> spacing_mm;
  Condition dense, dense_off;
  std::uint32_t dense_flags = 0;
  for (const double spacing : spacings) {
    std::fprintf(stderr, "bench coupling: contacts every %g mm\n", 1e3 * spacing);
    reference::ReferenceInsertion finer = insertion;
    finer.contact_spacing = spacing;
    const MeshRun off = run_mesh(finer, false);
    const MeshRun on = run_mesh(finer, true);
    spacing_mm.push_back(1e3 * spacing);
    by_spacing.off.push_back(off.peak);
    by_spacing.on.push_back(on.peak);
    dense.plain = std::max(dense.plain, on.condition.plain);
    dense.scaled = std::max(dense.scaled, on.condition.scaled);
    dense_off.plain = std::max(dense_off.plain, off.condition.plain);
    dense_flags |= on.flags;
    report.add({fmt::format("subgrid.spacing.peak.{:g}mm", 1e3 * spacing), on.peak, "N", {}, {}, {}});
    report.add({fmt::format("subgrid.spacing.peak_off.{:g}mm", 1e3 * spacing), off.peak, "N", {}, {}, {}});
  }
  report.add({"subgrid.spacing.spread.off", kPercent * relative_spread(by_spacing.off), "%", {}, {}, {}});
  report.add({"subgrid.spacing.spread.on", kPercent * relative_spread(by_spacing.on), "%", {}, {}, {}});
  report.add(at_most("subgrid.condition", std::max(condition.plain, dense.plain), "1", kConditionBound));
  report.add({"subgrid.condition.off", dense_off.plain, "1", {}, {}, {}});
  report.add({"subgrid.condition.10mm", condition.plain, "1", {}, {}, {}});
  report.add({"subgrid.condition.scaled", std::max(condition.scaled, dense.scaled), "1", {}, {}, {}});
  report.add({"subgrid.condition.scaled.10mm", condition.scaled, "1", {}, {}, {}});
  report.add({"subgrid.flags", static_cast<double>(flags), "1", {}, {}, {}});
  report.add({"subgrid.spacing.flags", static_cast<double>(dense_flags), "1", {}, {}, {}});

  report.add({"subgrid.indentation.mean",
              Eigen::Map<const Eigen::VectorXd>(depths.on.data(), static_cast<Eigen::Index>(depths.on.size())).mean(),
              "m",
              {},
              {},
              {}});
  report.add({"subgrid.indentation.spread.off", kPercent * relative_spread(depths.off), "%", {}, {}, {}});
  report.add(at_most("subgrid.indentation.spread.on", kPercent * relative_spread(depths.on), "%", kTipBound));
  report.add(
      {"subgrid.indentation.spread.session_radius", kPercent * relative_spread(blunt_depths), "%", {}, {}, {}});

  if (options.out.empty()) return report;
  const std::array panels{
      panel("Peak force on the hand, R1", "nodes per edge", "N", nodes, peaks, 1),
      panel("Indentation at puncture (0.05 N)", "nodes per edge", "mm", nodes, depths, 1e3),
  };
  const std::array caption{
      fmt::format("Spread of the peak {:.1f} % without, {:.1f} % with; of the indentation {:.0f} % and {:.1f} %.",
                  kPercent * relative_spread(peaks.off), kPercent * relative_spread(peaks.on),
                  kPercent * relative_spread(depths.off), kPercent * relative_spread(depths.on))};
  const std::array columns{FigureColumn{"nodes_per_edge", nodes}, FigureColumn{"peak_off_n", peaks.off},
                           FigureColumn{"peak_on_n", peaks.on}, FigureColumn{"indentation_off_m", depths.off},
                           FigureColumn{"indentation_on_m", depths.on}};
  write_figure(options.out, "coupling_subgrid", panels, caption, columns);
  // Single points leave the plot where their rows become dependent.
  const std::array spacing_panels{
      panel("Peak force by contact spacing, 7 nodes per edge", "spacing, mm", "N", spacing_mm, by_spacing, 1)};
  const std::array spacing_caption{fmt::format("Spread {:.1f} % without, {:.1f} % with.",
                                               kPercent * relative_spread(by_spacing.off),
                                               kPercent * relative_spread(by_spacing.on))};
  const std::array spacing_columns{FigureColumn{"spacing_mm", spacing_mm}, FigureColumn{"peak_off_n", by_spacing.off},
                                   FigureColumn{"peak_on_n", by_spacing.on}};
  write_figure(options.out, "coupling_spacing", spacing_panels, spacing_caption, spacing_columns);
  return report;
}

}  // namespace stylet::bench
