// Straight edges against the cubic shaft, and how a slow and late simulation is felt.
#include "tools/bench/coupling_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

namespace stylet::bench {
namespace {

using physics::Coupling;

constexpr double kJumpBound = 0.2e-3;  // N
constexpr double kJumpGain = 20;       // asked of the cubic shaft
constexpr double kKinkBound = 1e-3;    // N
constexpr double kMilli = 1e3;

struct ForceTrace {
  std::vector<double> time_s;
  std::vector<Eigen::Vector3d> forces;  // on the hand, N
  std::uint32_t flags = 0;
};

ForceTrace trace(const reference::ReferenceInsertion& insertion, const reference::ReferenceRun& run) {
  reference::ReferenceExperiment experiment(insertion, run);
  while (experiment.time_s() < insertion.duration) experiment.advance();
  ForceTrace result{.time_s = {}, .forces = experiment.forces(), .flags = experiment.needle_flags()};
  for (std::size_t k = 1; k <= result.forces.size(); ++k) {
    result.time_s.push_back(static_cast<double>(k) / insertion.haptic_hz);
  }
  return result;
}

/// max |F(k+1) - 2 F(k) + F(k-1)| of a component, N.
double largest_kink(const std::vector<Eigen::Vector3d>& forces, int axis) {
  double largest = 0;
  for (std::size_t k = 2; k < forces.size(); ++k) {
    largest = std::max(largest, std::abs(forces[k][axis] - 2 * forces[k - 1][axis] + forces[k - 2][axis]));
  }
  return largest;
}

std::vector<double> differences(const std::vector<Eigen::Vector3d>& forces, int axis, double scale) {
  std::vector<double> values(forces.size(), 0.0);
  for (std::size_t k = 1; k < forces.size(); ++k) values[k] = scale * (forces[k][axis] - forces[k - 1][axis]);
  return values;
}

}  // namespace

Report coupling_shaft(const reference::ReferenceInsertion& insertion, const BenchOptions& options) {
  // The same coupling twice, but for what lies between the nodes; and the paper's own.
  const ForceTrace straight = trace(
      insertion, {.coupling = Coupling::stylet, .track = {.straight_edges = true, .subgrid_compliance = false}});
  const ForceTrace paper = trace(insertion, {.coupling = Coupling::paper_updated});
  const ForceTrace hermite = trace(insertion, {.coupling = Coupling::stylet, .track = {.subgrid_compliance = false}});
  constexpr int kAxial = 0;
  const double jump_straight = reference::jump(straight.forces, kAxial);
  const double jump_hermite = reference::jump(hermite.forces, kAxial);
  const double step_straight = reference::discontinuity(straight.forces, kAxial);
  const double step_hermite = reference::discontinuity(hermite.forces, kAxial);
  const double rough_straight = reference::roughness(straight.forces, kAxial);
  const double rough_hermite = reference::roughness(hermite.forces, kAxial);
  const double kink_straight = largest_kink(straight.forces, kAxial);
  const double kink_hermite = largest_kink(hermite.forces, kAxial);
  Report report;
  report.add({"shaft.jump.paper", reference::jump(paper.forces, kAxial), "N", {}, {}, {}});
  report.add({"shaft.jump.straight", jump_straight, "N", {}, {}, {}});
  report.add(at_most("shaft.jump.hermite", jump_hermite, "N", kJumpBound));
  // A jump by definition is a change per millisecond, so a force without any step has one too: its slope. Both ratios
  // are judged: of what the definition says, and of the steps alone.
  report.add(at_least("shaft.jump.ratio", jump_straight / jump_hermite, "1", kJumpGain));
  report.add({"shaft.discontinuity.paper", reference::discontinuity(paper.forces, kAxial), "N", {}, {}, {}});
  report.add({"shaft.discontinuity.straight", step_straight, "N", {}, {}, {}});
  report.add({"shaft.discontinuity.hermite", step_hermite, "N", {}, {}, {}});
  report.add(at_least("shaft.discontinuity.ratio", step_straight / step_hermite, "1", kJumpGain));
  report.add({"shaft.roughness.straight", rough_straight, "N", {}, {}, {}});
  report.add({"shaft.roughness.hermite", rough_hermite, "N", {}, {}, {}});
  report.add({"shaft.roughness.ratio", rough_straight / rough_hermite, "1", {}, {}, {}});
  report.add({"shaft.kink.straight", kink_straight, "N", {}, {}, {}});
  report.add({"shaft.kink.hermite", kink_hermite, "N", {}, {}, {}});
  report.add({"shaft.kink.ratio", kink_straight / kink_hermite, "1", {}, {}, {}});
  report.add({"shaft.flags", static_cast<double>(straight.flags | paper.flags | hermite.flags), "1", {}, {}, {}});
  if (options.out.empty()) return report;

  const figures::PlotPanel force{
      .title = "Axial force on the hand, R1, no friction",
      .x = {.label = "time, s", .min = 0, .max = insertion.duration},
      .y = {.label = "force, mN"},
      .series = {plot_line("straight edges", straight.time_s, component(straight.forces, kAxial, kMilli), 1),
                 plot_line("cubic shaft", hermite.time_s, component(hermite.forces, kAxial, kMilli), 0)},
      .markers = {},
      .dots = {}};
  const figures::PlotPanel steps{
      .title = "Change from one millisecond to the next",
      .x = {.label = "time, s", .min = 0, .max = insertion.duration},
      .y = {.label = "F(k+1) - F(k), mN"},
      .series = {plot_line("straight edges", straight.time_s, differences(straight.forces, kAxial, kMilli), 1),
                 plot_line("cubic shaft", hermite.time_s, differences(hermite.forces, kAxial, kMilli), 0)},
      .markers = {},
      .dots = {}};
  const std::array panels{force, steps};
  const std::array caption{
      fmt::format("Largest change {:.3f} mN with straight edges, {:.3f} mN with the cubic shaft; without the slope "
                  "{:.4f} and {:.4f} mN.",
                  kMilli * jump_straight, kMilli * jump_hermite, kMilli * step_straight, kMilli * step_hermite),
      fmt::format("Roughness {:.2e} N and {:.2e} N; largest second difference {:.2e} N and {:.2e} N.", rough_straight,
                  rough_hermite, kink_straight, kink_hermite)};
  const std::array columns{FigureColumn{"time_s", straight.time_s},
                           FigureColumn{"axial_straight_n", component(straight.forces, kAxial)},
                           FigureColumn{"axial_hermite_n", component(hermite.forces, kAxial)}};
  write_figure(options.out, "coupling_shaft", panels, caption, columns);
  return report;
}

Report coupling_synchronisation(const reference::ReferenceInsertion& insertion, const BenchOptions& options) {
  reference::ReferenceInsertion slow = insertion;
  slow.simulation_hz = 25;
  const ForceTrace late = trace(slow, {.coupling = Coupling::stylet, .latency_steps = 1});
  const ForceTrace paper = trace(slow, {.coupling = Coupling::paper_updated, .latency_steps = 1});
  const auto worst = [](const ForceTrace& t) {
    return std::max({largest_kink(t.forces, 0), largest_kink(t.forces, 1), largest_kink(t.forces, 2)});
  };
  Report report;
  report.add(at_most("sync.kink", worst(late), "N", kKinkBound));
  report.add({"sync.kink.paper", worst(paper), "N", {}, {}, {}});
  report.add({"sync.flags", static_cast<double>(late.flags), "1", {}, {}, {}});
  if (options.out.empty()) return report;

  constexpr int kLateral = 1;
  const figures::PlotPanel force{
      .title = "Lateral force on the hand, simulation at 25 Hz, one step late",
      .x = {.label = "time, s", .min = 0, .max = insertion.duration},
      .y = {.label = "force Y, N"},
      .series = {plot_line("paper, updated", paper.time_s, component(paper.forces, kLateral), 1),
                 plot_line("stylet", late.time_s, component(late.forces, kLateral), 0)},
      .markers = {},
      .dots = {}};
  const std::array panels{force};
  const std::array caption{
      fmt::format("Largest second difference of any component: {:.3f} mN stylet, {:.1f} mN paper.",
                  kMilli * worst(late), kMilli * worst(paper))};
  const std::array columns{FigureColumn{"time_s", late.time_s},
                           FigureColumn{"force_y_stylet_n", component(late.forces, kLateral)},
                           FigureColumn{"force_y_paper_n", component(paper.forces, kLateral)}};
  write_figure(options.out, "coupling_synchronisation", panels, caption, columns);
  return report;
}

}  // namespace stylet::bench
