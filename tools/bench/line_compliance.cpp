#include "tools/bench/line_compliance.h"

#include "tools/bench/figure_files.h"
#include "tools/bench/subgrid_calibration.h"
#include "tools/reference/reference_insertion.h"
#include "tools/reference/resolved_needle.h"
#include "tools/reference/tied_needle.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

namespace stylet::bench {
namespace {

constexpr double kDepth = 0.9;  // of the flexible needle's tip, over the edge
constexpr std::array kMeshes{7, 10, 12, 14, 17};

reference::ResolvedCube cube_of(const reference::ReferenceInsertion& insertion) {
  return {.edge = insertion.cube_edge,
          .material = insertion.material,
          .needle_radius = insertion.needle.outer_diameter / 2};
}

/// Stiffness of the resolved needle, with the resolutions that show that it is converged.
struct Converged {
  double stiffness = 0;  ///< N/m, the finest
  double change = 0;     ///< relative, from the one before
};

Converged converge(const reference::ResolvedCube& cube, reference::NeedleMotion motion, bool quick) {
  if (motion == reference::NeedleMotion::lateral || motion == reference::NeedleMotion::axial) {
    const double coarse = reference::resolved_stiffness(cube, motion, {8, 8, 6});
    const double fine = reference::resolved_stiffness(
        cube, motion, quick ? reference::Resolution{8, 16, 6} : reference::Resolution{12, 16, 8});
    return {fine, std::abs(coarse / fine - 1)};
  }
  // The edge of a flat end is singular: the error goes with the element there, and is extrapolated to none.
  const double coarse = reference::resolved_stiffness(cube, motion, {9, 8, 6});
  const double fine = reference::resolved_stiffness(cube, motion, {18, 8, 12});
  return {2 * fine - coarse, std::abs(coarse / fine - 1)};
}

double spread(const std::vector<double>& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  double mean = 0;
  for (const double v : values) mean += v / static_cast<double>(values.size());
  return (*high - *low) / mean;
}

double worst_error(const std::vector<double>& values, double truth) {
  double worst = 0;
  for (const double v : values) worst = std::max(worst, std::abs(v / truth - 1));
  return worst;
}

/// Answers of one kind over the meshes, without and with sub-grid compliance.
struct ByMesh {
  std::string name;
  std::array<std::vector<double>, 2> values;
};

void report_by_mesh(const ByMesh& answers, double truth, double bound, Report& report) {
  const auto& [without, with] = answers.values;
  report.add({answers.name + ".spread_without", 100 * spread(without), "%", {}, {}, {}});
  report.add(at_most(answers.name + ".spread", 100 * spread(with), "%", 100 * bound));
  if (truth <= 0) return;
  report.add({answers.name + ".error_without", 100 * worst_error(without, truth), "%", {}, {}, {}});
  report.add({answers.name + ".error", 100 * worst_error(with, truth), "%", {}, {}, {}});
}

struct FigurePanel {
  const ByMesh& answers;
  double scale;
  std::string title;
  double truth;  ///< scaled; 0: none
};

void draw(const std::filesystem::path& out, const std::vector<double>& nodes_per_edge,
          const std::vector<FigurePanel>& drawn) {
  std::vector<FigureColumn> columns{{"nodes_per_edge", nodes_per_edge}};
  std::vector<figures::PlotPanel> panels;
  for (const FigurePanel& d : drawn) {
    figures::PlotPanel panel{.title = d.title,
                             .x = {.label = "nodes per edge"},
                             .y = {.label = "", .min = 0},
                             .series = {},
                             .markers = {},
                             .dots = {}};
    const auto add = [&](const std::string& label, std::vector<double> y) {
      const int index = static_cast<int>(panel.series.size());
      panel.series.push_back({.label = label,
                              .x = nodes_per_edge,
                              .y = std::move(y),
                              .colour = figures::plot_colour(index, figures::PlotTheme::light)});
    };
    for (const reference::Subgrid subgrid : {reference::Subgrid::off, reference::Subgrid::on}) {
      const auto s = static_cast<std::size_t>(subgrid);
      std::vector<double> y = d.answers.values[s];
      columns.push_back({d.answers.name + (s == 0 ? "_without" : "_with"), y});
      for (double& v : y) v *= d.scale;
      add(s == 0 ? "single points" : "with sub-grid compliance", std::move(y));
    }
    if (d.truth > 0) add("resolved", std::vector<double>(nodes_per_edge.size(), d.truth));
    panels.push_back(std::move(panel));
  }
  const std::array caption{std::string("A needle through the cube of R1, at rest: what it feels of five meshes.")};
  write_figure(out, "line_compliance", panels, caption, columns);
}

void study_spacing(reference::MeshedCube& mesh, int nodes, Report& report) {
  const reference::ResolvedCube& cube = mesh.cube();
  std::vector<double> stiffness;
  double worst_condition = 0;
  for (const int count : {10, 20, 40, 80}) {
    const reference::TiedNeedle needle =
        reference::tie_needle(mesh, 0.5 * cube.edge, 0.5 * cube.edge, cube.edge, count);
    const reference::TiedAnswer with =
        reference::rigid_answer(mesh, needle, reference::NeedleMotion::lateral, reference::Subgrid::on);
    const reference::TiedAnswer without =
        reference::rigid_answer(mesh, needle, reference::NeedleMotion::lateral, reference::Subgrid::off);
    const std::string name = fmt::format("spacing.{}_nodes.{:.2f}_mm.", nodes, 1e3 * needle.spacing);
    report.add({name + "force_per_mm", 1e-3 * with.stiffness, "N", {}, {}, {}});
    report.add({name + "condition_without", without.condition, "1", {}, {}, {}});
    report.add({name + "condition", with.condition, "1", {}, {}, {}});
    stiffness.push_back(with.stiffness);
    worst_condition = std::max(worst_condition, with.condition);
  }
  const std::string name = fmt::format("spacing.{}_nodes.", nodes);
  report.add(at_most(name + "spread", 100 * spread(stiffness), "%", 3));
  report.add(at_most(name + "worst_condition", worst_condition, "1", 1e3));
}

}  // namespace

Report bench_line_compliance(const BenchOptions& options) {
  const reference::ReferenceInsertion insertion = reference::read_reference_insertion(options.reference_insertion);
  const reference::ResolvedCube cube = cube_of(insertion);
  Report report;

  std::fputs("bench line-compliance: resolved needle\n", stderr);
  std::array<double, 4> truth{};
  for (const reference::NeedleMotion motion : {reference::NeedleMotion::lateral, reference::NeedleMotion::axial,
                                               reference::NeedleMotion::indentation, reference::NeedleMotion::tip}) {
    const Converged resolved = converge(cube, motion, options.quick);
    truth[static_cast<std::size_t>(motion)] = resolved.stiffness;
    const std::string name = fmt::format("resolved.{}.", name_of(motion));
    const double young = cube.material.young_modulus;
    const double nu = cube.material.poisson_ratio;
    const double half_space = 2 * young * cube.needle_radius / (1 - nu * nu);
    Measurement stiffness{name + "stiffness", resolved.stiffness, "N/m", {}, {}, {}};
    if (motion == reference::NeedleMotion::indentation) stiffness.reference = half_space;  // Boussinesq
    report.add(stiffness);
    report.add(at_most(name + "change_by_refinement", 100 * resolved.change, "%", 5));
  }

  std::fputs("bench line-compliance: calibration\n", stderr);
  for (const double nu : options.quick ? std::vector{0.45} : std::vector{0.0, 0.3, 0.45, 0.49}) {
    report.append(calibrate_subgrid(cube, nu, options.quick));
  }

  std::fputs("bench line-compliance: meshes\n", stderr);
  ByMesh lateral{.name = "rigid.lateral", .values = {}}, axial{.name = "rigid.axial", .values = {}},
      flexible{.name = "flexible.lateral", .values = {}}, indentation{.name = "tip.indentation", .values = {}},
      channel{.name = "tip.channel", .values = {}};
  std::vector<double> nodes_per_edge;
  for (const int nodes : kMeshes) {
    if (options.quick && nodes > 12) continue;
    nodes_per_edge.push_back(nodes);
    reference::MeshedCube mesh(cube, reference::lattice_of_r1(nodes));
    const double y = 0.5 * cube.edge, z = y, depth = kDepth * cube.edge;
    const auto parts = [&](double length) {
      return static_cast<int>(std::lround(length / insertion.contact_spacing));
    };
    const reference::TiedNeedle through = reference::tie_needle(mesh, y, z, cube.edge, parts(cube.edge));
    const reference::TiedNeedle inserted = reference::tie_needle(mesh, y, z, depth, parts(depth));
    for (const reference::Subgrid subgrid : {reference::Subgrid::off, reference::Subgrid::on}) {
      lateral.values[static_cast<std::size_t>(subgrid)].push_back(
          reference::rigid_answer(mesh, through, reference::NeedleMotion::lateral, subgrid).stiffness);
      axial.values[static_cast<std::size_t>(subgrid)].push_back(
          reference::rigid_answer(mesh, through, reference::NeedleMotion::axial, subgrid).stiffness);
      flexible.values[static_cast<std::size_t>(subgrid)].push_back(
          reference::flexible_answer(mesh, inserted, depth, insertion.needle, subgrid).stiffness);
      indentation.values[static_cast<std::size_t>(subgrid)].push_back(
          reference::tip_answer(mesh, {0, y, z}, reference::NeedleMotion::indentation, subgrid));
      channel.values[static_cast<std::size_t>(subgrid)].push_back(
          reference::tip_answer(mesh, {0.5 * cube.edge, y, z}, reference::NeedleMotion::tip, subgrid));
    }
    if (nodes == kMeshes.front() || nodes == kMeshes.back()) study_spacing(mesh, nodes, report);
  }
  report_by_mesh(lateral, truth[0], 0.03, report);
  report_by_mesh(axial, truth[1], 0.03, report);
  report_by_mesh(flexible, 0, 0.03, report);
  report_by_mesh(indentation, 1 / truth[2], 0.10, report);
  report_by_mesh(channel, 1 / truth[3], 0.10, report);

  if (!options.out.empty()) {
    draw(options.out, nodes_per_edge,
         {{lateral, 1e-3, "force on a rigid needle per lateral displacement, N/mm", 1e-3 * truth[0]},
          {flexible, 1e-3, "force on the hand per lateral displacement, flexible needle, N/mm", 0},
          {indentation, 1e3, "indentation per force of the tip, mm/N", 1e3 / truth[2]}});
  }
  return report;
}

}  // namespace stylet::bench
