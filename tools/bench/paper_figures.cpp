#include "tools/bench/paper_figures.h"

#include "tools/bench/figure_files.h"
#include "tools/bench/insertion_trace.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <string>
#include <vector>

namespace stylet::bench {
namespace {

using figures::PlotPanel;
using figures::PlotSeries;
using physics::Coupling;

constexpr std::size_t kContacts = 8;  // of Fig. 2
// An insertion straight to the last digit bends nothing and turns no normal at all; a hand is off by a millimetre.
constexpr double kStraight = 0.1;      // of the curved insertion's sideways motion
constexpr double kRoughnessGain = 10;  // asked of the update
constexpr double kPaperDirectionRatio = 0.01;
constexpr int kY = 1;

std::vector<double> scaled(std::vector<double> values, double scale) {
  for (double& v : values) v *= scale;
  return values;
}

double largest(const std::vector<double>& values) {
  double result = 0;
  for (const double v : values) result = std::max(result, std::abs(v));
  return result;
}

double median(std::vector<double> values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

figures::Colour colour(int index) {
  return figures::plot_colour(index, figures::PlotTheme::light);
}

// ---- Fig. 2

/// Of contact i = 0..7, over all simulation steps with exactly 8 contacts.
struct ContactChanges {
  std::array<std::vector<double>, kContacts> by_contact;
  std::vector<double> all;
};

ContactChanges changes_of(const InsertionTrace& trace) {
  ContactChanges changes;
  for (const DirectionChanges& step : trace.direction_changes) {
    if (step.norms.size() != kContacts) continue;
    for (std::size_t i = 0; i < kContacts; ++i) changes.by_contact[i].push_back(step.norms[i]);
    changes.all.insert(changes.all.end(), step.norms.begin(), step.norms.end());
  }
  return changes;
}

/// A line with dots over the contact's number, in thousandths.
void add_contact_series(PlotPanel& panel, const std::string& label, const std::vector<double>& values, int index) {
  PlotSeries series{.label = label, .x = {}, .y = scaled(values, 1e3), .colour = colour(index)};
  for (std::size_t i = 0; i < values.size(); ++i) {
    series.x.push_back(static_cast<double>(i + 1));
    panel.dots.push_back({series.x.back(), series.y[i], series.colour});
  }
  panel.series.push_back(std::move(series));
}

PlotSeries largest_change_in_time(const InsertionTrace& trace, const std::string& label, int index) {
  PlotSeries series{.label = label, .x = {}, .y = {}, .colour = colour(index)};
  for (const DirectionChanges& step : trace.direction_changes) {
    series.x.push_back(step.time_s);
    series.y.push_back(1e3 * largest(step.norms));
  }
  return series;
}

void draw_figure_2(const std::filesystem::path& out, const InsertionTrace& straight, const InsertionTrace& curved,
                   const Report& numbers) {
  PlotPanel by_contact{.title = "Change of the contact normal over one simulation step",
                       .x = {.label = "contact, from the surface to the tip", .min = 0.5, .max = 8.5},
                       .y = {.label = "|Δn|, 1e-3", .min = 0},
                       .series = {},
                       .markers = {},
                       .dots = {}};
  std::vector<FigureColumn> columns{{"contact", {1, 2, 3, 4, 5, 6, 7, 8}}};
  const auto add = [&](const InsertionTrace& trace, const std::string& shape, int index) {
    const ContactChanges changes = changes_of(trace);
    std::vector<double> middle, top;
    for (const std::vector<double>& values : changes.by_contact) {
      middle.push_back(median(values));
      top.push_back(values.empty() ? std::numeric_limits<double>::quiet_NaN() : largest(values));
    }
    add_contact_series(by_contact, shape + ", median", middle, index);
    add_contact_series(by_contact, shape + ", largest", top, index + 2);
    columns.push_back({shape + "_median", middle});
    columns.push_back({shape + "_largest", top});
  };
  add(curved, "curved", 0);
  add(straight, "straight", 1);
  const PlotPanel in_time{
      .title = "Largest of all contacts",
      .x = {.label = "time, s", .min = 0, .max = straight.time_s.back()},
      .y = {.label = "max |Δn|, 1e-3", .min = 0},
      .series = {largest_change_in_time(curved, "curved", 0), largest_change_in_time(straight, "straight", 1)},
      .markers = {},
      .dots = {}};
  const std::array panels{by_contact, in_time};
  const auto value = [&](const std::string& name) {
    for (const Measurement& m : numbers.measurements) {
      if (m.name == name) return m.value;
    }
    return std::numeric_limits<double>::quiet_NaN();
  };
  const std::array caption{
      std::string(
          "Fig. 2. Norm of the constraint direction changes in the haptic loop over one simulation step (20 ms), "
          "8 contacts, 343 nodes; straight: 1 mm sideways, curved: 10 mm."),
      fmt::format("Median |Δn| over the needle's edge length (m): {:.3f} straight, {:.3f} curved.",
                  value("fig2.straight.ratio"), value("fig2.curved.ratio")),
      std::string("Paper: \"about one hundredth of the length of the edges\"; greater for a curved insertion.")};
  write_figure(out, "fig2_direction_changes", panels, caption, columns);
}

void report_figure_2(Report& report, const std::string& shape, const InsertionTrace& trace, double edge_length) {
  const ContactChanges changes = changes_of(trace);
  const double middle = median(changes.all);
  report.add({"fig2." + shape + ".change", middle, "1", {}, {}, {}});
  report.add({"fig2." + shape + ".change.max", largest(changes.all), "1", {}, {}, {}});
  report.add({"fig2." + shape + ".ratio", middle / edge_length, "1/m", kPaperDirectionRatio, {}, {}});
}

/// What moves the ratio: how far the needle goes aside in a simulation step. The paper's hand is a recording that is
/// not published.
Report figure_2_by_motion(const reference::ReferenceInsertion& insertion, int worker_period, bool quick) {
  Report report;
  const double edge_length = insertion.needle.length / insertion.needle.beams;
  const auto add = [&](const std::string& name, double amplitude, double simulation_hz) {
    reference::ReferenceInsertion run = insertion;
    run.lateral_amplitude = amplitude;
    run.simulation_hz = simulation_hz;
    const InsertionTrace trace =
        trace_insertion(run, {.coupling = Coupling::paper_updated, .worker_period = worker_period});
    report.add({"fig2.by_motion." + name + ".ratio",
                median(changes_of(trace).all) / edge_length,
                "1/m",
                kPaperDirectionRatio,
                {},
                {}});
  };
  add("2mm", 0.002, insertion.simulation_hz);
  add("4mm", 0.004, insertion.simulation_hz);
  if (quick) return report;
  add("6mm", 0.006, insertion.simulation_hz);
  add("10mm_100hz", 0.010, 2 * insertion.simulation_hz);
  add("10mm_25hz", 0.010, insertion.simulation_hz / 2);
  return report;
}

// ---- Fig. 3 and 4

/// The couplings through the same motion. trajectory: directions normal to the line of the contact points.
struct TracePair {
  InsertionTrace frozen, updated, trajectory;
};

TracePair trace_both(const reference::ReferenceInsertion& insertion, int latency_steps, int worker_period) {
  const auto trace = [&](Coupling coupling) {
    return trace_insertion(insertion, {.coupling = coupling,
                                       .relative_compliance = 0,
                                       .latency_steps = latency_steps,
                                       .worker_period = worker_period});
  };
  return {trace(Coupling::paper_frozen), trace(Coupling::paper_updated), trace(Coupling::paper_trajectory)};
}

void report_force(Report& report, const std::string& prefix, const std::string& suffix, const TracePair& pair,
                  bool judged) {
  const double frozen = reference::roughness(pair.frozen.forces, kY);
  const double updated = reference::roughness(pair.updated.forces, kY);
  const double trajectory = reference::roughness(pair.trajectory.forces, kY);
  report.add({prefix + "roughness.frozen" + suffix, frozen, "N", {}, {}, {}});
  report.add({prefix + "roughness.trajectory" + suffix, trajectory, "N", {}, {}, {}});
  report.add({prefix + "roughness.ratio_trajectory" + suffix, frozen / trajectory, "1", {}, {}, {}});
  report.add({prefix + "roughness.updated" + suffix, updated, "N", {}, {}, {}});
  const std::string ratio = prefix + "roughness.ratio" + suffix;
  report.add(judged ? at_least(ratio, frozen / updated, "1", kRoughnessGain)
                    : Measurement{ratio, frozen / updated, "1", {}, {}, {}});
  report.add({prefix + "jump.frozen" + suffix, reference::jump(pair.frozen.forces, kY), "N", {}, {}, {}});
  report.add({prefix + "jump.updated" + suffix, reference::jump(pair.updated.forces, kY), "N", {}, {}, {}});
  report.add({prefix + "jump.trajectory" + suffix, reference::jump(pair.trajectory.forces, kY), "N", {}, {}, {}});
}

PlotPanel force_panel(const std::string& title, const TracePair& pair) {
  // Updated on top: where both agree its line is seen.
  return {.title = title,
          .x = {.label = "time, s", .min = 0, .max = pair.updated.time_s.back()},
          .y = {.label = "force on the hand, Y, N"},
          .series = {{.label = "frozen",
                      .x = pair.frozen.time_s,
                      .y = component(pair.frozen.forces, kY),
                      .colour = colour(1)},
                     {.label = "updated",
                      .x = pair.updated.time_s,
                      .y = component(pair.updated.forces, kY),
                      .colour = colour(0)},
                     {.label = "normal to the trajectory",
                      .x = pair.trajectory.time_s,
                      .y = component(pair.trajectory.forces, kY),
                      .colour = colour(2)}},
          .markers = {},
          .dots = {}};
}

/// Sample after the largest step of the Y force.
std::size_t largest_jump(const InsertionTrace& trace) {
  std::size_t at = 1;
  double most = 0;
  for (std::size_t k = 1; k < trace.forces.size(); ++k) {
    const double step = std::abs(trace.forces[k][kY] - trace.forces[k - 1][kY]);
    if (step > most) {
      most = step;
      at = k;
    }
  }
  return at;
}

/// 160 ms around a sample, with the simulation steps marked.
PlotPanel zoom(const std::string& title, const TracePair& pair, std::size_t centre, int steps_between) {
  const auto cut = [&](const InsertionTrace& trace, const std::string& label, int index) {
    PlotSeries series{.label = label, .x = {}, .y = {}, .colour = colour(index)};
    const std::size_t from = centre > 80 ? centre - 80 : 0;
    for (std::size_t k = from; k < std::min(from + 161, trace.forces.size()); ++k) {
      series.x.push_back(trace.time_s[k]);
      series.y.push_back(trace.forces[k][kY]);
    }
    return series;
  };
  PlotPanel panel{.title = title,
                  .x = {.label = "time, s (dashed: a new patch from the simulation loop)"},
                  .y = {.label = "force on the hand, Y, N"},
                  .series = {cut(pair.frozen, "frozen", 1), cut(pair.updated, "updated", 0),
                             cut(pair.trajectory, "normal to the trajectory", 2)},
                  .markers = {},
                  .dots = {}};
  panel.x.min = panel.series[0].x.front();
  panel.x.max = panel.series[0].x.back();
  for (std::size_t k = 0; k < pair.frozen.time_s.size(); k += static_cast<std::size_t>(steps_between)) {
    const double x = pair.frozen.time_s[k];
    if (x >= panel.x.min && x <= panel.x.max) panel.markers.push_back({x, {}});
  }
  return panel;
}

std::string force_sentence(const TracePair& pair) {
  return fmt::format(
      "Roughness {:.2e} N frozen, {:.2e} N updated ({:.0f} times less), {:.2e} N normal to the trajectory; jump "
      "{:.1f} "
      "mN frozen, {:.1f} mN updated.",
      reference::roughness(pair.frozen.forces, kY), reference::roughness(pair.updated.forces, kY),
      reference::roughness(pair.frozen.forces, kY) / reference::roughness(pair.updated.forces, kY),
      reference::roughness(pair.trajectory.forces, kY), 1e3 * reference::jump(pair.frozen.forces, kY),
      1e3 * reference::jump(pair.updated.forces, kY));
}

void draw_figure_3(const std::filesystem::path& out, const TracePair& lockstep, const TracePair& late,
                   int steps_between) {
  const PlotPanel along{.title = "Component of the constraint forces along the shaft",
                        .x = {.label = "time, s", .min = 0, .max = lockstep.updated.time_s.back()},
                        .y = {.label = "sum over contacts, mN"},
                        .series = {{.label = "frozen",
                                    .x = lockstep.frozen.time_s,
                                    .y = scaled(lockstep.frozen.along_shaft, 1e3),
                                    .colour = colour(1)},
                                   {.label = "updated",
                                    .x = lockstep.updated.time_s,
                                    .y = scaled(lockstep.updated.along_shaft, 1e3),
                                    .colour = colour(0)},
                                   {.label = "normal to the trajectory",
                                    .x = lockstep.trajectory.time_s,
                                    .y = scaled(lockstep.trajectory.along_shaft, 1e3),
                                    .colour = colour(2)}},
                        .markers = {},
                        .dots = {}};
  const std::size_t centre = largest_jump(lockstep.frozen);
  const std::array panels{force_panel("Force across the insertion, reference insertion R1", lockstep),
                          zoom("Around the largest jump of the frozen coupling", lockstep, centre, steps_between),
                          zoom("The same, one simulation step of latency", late, centre, steps_between), along};
  const std::array caption{
      std::string(
          "Fig. 3. Y component of the force during an insertion with partial withdrawals, with and without contact "
          "direction updates, 343 nodes."),
      force_sentence(lockstep), "One step of latency: " + force_sentence(late),
      std::string("Paper: the peaks that come of the needle's straight edges are eliminated by the updates.")};
  const std::array columns{FigureColumn{"time_s", lockstep.frozen.time_s},
                           FigureColumn{"force_y_frozen_n", component(lockstep.frozen.forces, kY)},
                           FigureColumn{"force_y_updated_n", component(lockstep.updated.forces, kY)},
                           FigureColumn{"force_y_trajectory_n", component(lockstep.trajectory.forces, kY)},
                           FigureColumn{"force_y_frozen_late_n", component(late.frozen.forces, kY)},
                           FigureColumn{"force_y_updated_late_n", component(late.updated.forces, kY)},
                           FigureColumn{"along_shaft_frozen_n", lockstep.frozen.along_shaft},
                           FigureColumn{"along_shaft_updated_n", lockstep.updated.along_shaft},
                           FigureColumn{"along_shaft_trajectory_n", lockstep.trajectory.along_shaft}};
  write_figure(out, "fig3_force", panels, caption, columns);
}

}  // namespace

Report paper_figures_2_and_3(const reference::ReferenceInsertion& insertion, const BenchOptions& options) {
  Report report;
  const int worker_period = options.quick ? 10 : 1;
  reference::ReferenceInsertion straight_motion = insertion;
  straight_motion.lateral_amplitude *= kStraight;
  const InsertionTrace straight = trace_insertion(
      straight_motion, {.coupling = Coupling::paper_updated, .latency_steps = 0, .worker_period = worker_period});
  const TracePair lockstep = trace_both(insertion, 0, worker_period);
  const double edge_length = insertion.needle.length / insertion.needle.beams;
  report_figure_2(report, "straight", straight, edge_length);
  report_figure_2(report, "curved", lockstep.updated, edge_length);
  report_figure_2(report, "curved_trajectory", lockstep.trajectory, edge_length);
  if (!options.out.empty()) draw_figure_2(options.out, straight, lockstep.updated, report);

  const TracePair late = trace_both(insertion, 1, worker_period);
  report_force(report, "fig3.", "", lockstep, true);
  report_force(report, "fig3.", ".latency", late, false);
  report.add({"fig3.along_shaft.frozen", largest(lockstep.frozen.along_shaft), "N", {}, {}, {}});
  report.add({"fig3.along_shaft.updated", largest(lockstep.updated.along_shaft), "N", {}, {}, {}});
  report.add({"fig3.along_shaft.trajectory", largest(lockstep.trajectory.along_shaft), "N", {}, {}, {}});
  report.append(figure_2_by_motion(insertion, worker_period, options.quick));
  if (!options.out.empty()) {
    draw_figure_3(options.out, lockstep, late, insertion.haptic_steps_per_simulation_step());
  }
  return report;
}

Report paper_figure_4(const reference::ReferenceInsertion& insertion, const BenchOptions& options) {
  // The factor is renewed about as often as a worker manages at 50 Hz.
  struct Mesh {
    int nodes_per_edge;
    int worker_period;
  };
  const std::vector<Mesh> meshes = options.quick ? std::vector<Mesh>{{10, 10}} : std::vector<Mesh>{{12, 5}, {18, 20}};
  Report report;
  std::vector<PlotPanel> panels;
  std::vector<std::string> caption{
      "Fig. 4. Y component of the force as in Fig. 3, with finer volumes.",
  };
  std::vector<FigureColumn> columns;
  for (const Mesh& mesh : meshes) {
    reference::ReferenceInsertion finer = insertion;
    finer.nodes_per_edge = mesh.nodes_per_edge;
    const int nodes = mesh.nodes_per_edge * mesh.nodes_per_edge * mesh.nodes_per_edge;
    std::fprintf(stderr, "bench paper: Fig. 4, %d nodes\n", nodes);
    const TracePair pair = trace_both(finer, 0, mesh.worker_period);
    report_force(report, fmt::format("fig4.{}.", nodes), "", pair, false);
    panels.push_back(force_panel(fmt::format("{} nodes", nodes), pair));
    panels.push_back(zoom(fmt::format("{} nodes, around the largest jump", nodes), pair, largest_jump(pair.frozen),
                          insertion.haptic_steps_per_simulation_step()));
    caption.push_back(fmt::format("{} nodes: ", nodes) + force_sentence(pair));
    if (columns.empty()) columns.push_back({"time_s", pair.frozen.time_s});
    columns.push_back({fmt::format("force_y_frozen_{}_nodes_n", nodes), component(pair.frozen.forces, kY)});
    columns.push_back({fmt::format("force_y_updated_{}_nodes_n", nodes), component(pair.updated.forces, kY)});
  }
  caption.emplace_back(
      "Paper: with a fine mesh the force is still smoothed by the updates; the needle's edges are not felt.");
  if (!options.out.empty()) write_figure(options.out, "fig4_force_finer", panels, caption, columns);
  return report;
}

}  // namespace stylet::bench
