// Time of the haptic step with friction, in one body and in three, and of the solver by its number of rows.
#include "tools/bench/coupling_parts.h"
#include "tools/bench/samples.h"
#include "tools/reference/kuhn_box.h"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <utility>

namespace stylet::bench {
namespace {

using physics::ContactRow;
using physics::Coupling;

/// Slabs in a row along the needle's way, equally thick, that fill the insertion's cube but for the gaps.
struct SlabRun {
  int slabs = 1;
  int cells = 6;       ///< across a slab
  int cells_deep = 6;  ///< along the needle
  double gap = 0;      ///< between slabs, m
  int beams = 8;
  double spacing = 0.010;  ///< of contacts, m
  double depth = 0.078;    ///< of the tip, m
  int lateral_rows = 16;   ///< a step counts with at least so many
  double duration = 4;     ///< s, with the way in
};

std::vector<physics::SimulationBody> slabs(const reference::ReferenceInsertion& insertion, const SlabRun& run) {
  std::vector<physics::SimulationBody> bodies;
  const double thick = (insertion.cube_edge - (run.slabs - 1) * run.gap) / run.slabs;
  for (int i = 0; i < run.slabs; ++i) {
    const double x = i * (thick + run.gap);
    physics::SimulationBody body;
    body.mesh = reference::kuhn_box({x, 0, 0}, {x + thick, insertion.cube_edge, insertion.cube_edge},
                                    {run.cells_deep, run.cells, run.cells});
    body.tet_materials.assign(body.mesh.tets.size(), insertion.material);
    body.fixed_nodes = reference::nodes_where(body.mesh, [](const Eigen::Vector3d& p) { return p.z() < 1e-9; });
    bodies.push_back(std::move(body));
  }
  return bodies;
}

struct StepTimes {
  Samples step;   // whole haptic steps
  Samples solve;  // of them the solver
  int most_lateral_rows = 0;
  int most_rows = 0;
  int most_bodies = 0;
  std::uint32_t flags = 0;
};

/// In at 45 mm/s, then to and fro by 2 mm along the needle and 1 mm across it, so that contacts stick, slip and turn
/// round.
StepTimes time_steps(const reference::ReferenceInsertion& insertion, const SlabRun& run) {
  physics::SimulationLoop simulation(
      slabs(insertion, run),
      {.dt = 1 / insertion.simulation_hz, .contact_spacing = run.spacing, .lay_contacts = false});
  physics::HapticLoopSettings settings{.needle = insertion.needle, .base = {}, .coupling = Coupling::stylet};
  settings.needle.beams = run.beams;
  settings.track.spacing = run.spacing;
  settings.tissues = one_tissue(
      {.cutting_force = 0.2, .friction_per_length = 5, .friction_coefficient = 0.1, .viscous_friction = 1});
  reference::ReferenceInsertion motion = insertion;
  motion.lateral_amplitude = 0;
  constexpr double kSpeed = 0.045;  // m/s
  const double way = run.depth / kSpeed;
  motion.axial_speed = {{0, kSpeed}, {way, kSpeed}, {way + 1e-3, 0}};
  const auto base = [&](double time) {
    physics::StylusPose pose = motion.base(time);
    const double phase = 2 * std::numbers::pi * 2 * std::max(0.0, time - way - 1e-3);  // 2 Hz
    pose.position += Eigen::Vector3d(-1e-3 * (1 - std::cos(phase)), 1e-3 * std::sin(0.5 * phase), 0);
    return pose;
  };
  physics::HapticLoop haptic(settings, base(0));
  physics::HapticStageClock clock;
  physics::TissuePatch patch = simulation.make_patch();

  const double dt = 1 / insertion.haptic_hz;
  const auto simulation_steps = std::lround(run.duration * insertion.simulation_hz);
  StepTimes times{.step = Samples(static_cast<std::size_t>(run.duration * insertion.haptic_hz) + 1),
                  .solve = Samples(static_cast<std::size_t>(run.duration * insertion.haptic_hz) + 1)};
  long haptic_step = 0;
  // Half of the steps are timed as a whole, with the clock of the stages off.
  for (long step = 0; step < simulation_steps; ++step) {
    simulation.step({.needle = &haptic.state(), .time_s = dt * static_cast<double>(haptic_step)}, patch);
    if (step % 5 == 0) simulation.worker().step();
    for (int i = 0; i < insertion.haptic_steps_per_simulation_step(); ++i) {
      const physics::StylusPose hub = base(dt * static_cast<double>(++haptic_step));
      const bool by_stage = i % 2 == 1;
      haptic.time_stages(by_stage ? &clock : nullptr);
      const auto start = Clock::now();
      const physics::NeedleState& needle = haptic.step(hub, dt, patch);
      const auto end = Clock::now();
      times.flags |= needle.flags;
      const int lateral = 2 * needle.contact_count;
      times.most_lateral_rows = std::max(times.most_lateral_rows, lateral);
      times.most_rows = std::max(times.most_rows, haptic.delassus().rows());
      if (lateral < run.lateral_rows) continue;
      std::array<bool, physics::kMaxBodies> touched{};
      for (int c = 0; c < needle.contact_count; ++c) {
        touched[needle.contacts[c].body] = true;
      }
      times.most_bodies =
          std::max(times.most_bodies, static_cast<int>(std::count(touched.begin(), touched.end(), true)));
      if (by_stage) {
        times.solve.add(clock.time(physics::HapticStage::solve));
      } else {
        times.step.add(end - start);
      }
    }
  }
  return times;
}

void report_steps(const std::string& name, const StepTimes& times, double bound_us, Report& report) {
  report.add(at_most(name + ".median", times.step.count() > 0 ? times.step.median() : std::nan(""), "us", bound_us));
  report.add({name + ".p99", times.step.p99(), "us", {}, {}, {}});
  report.add({name + ".max", times.step.max(), "us", {}, {}, {}});
  report.add({name + ".solve.median", times.solve.median(), "us", {}, {}, {}});
  report.add({name + ".steps", static_cast<double>(times.step.count()), "1", {}, {}, {}});
  report.add({name + ".lateral_rows", static_cast<double>(times.most_lateral_rows), "1", {}, {}, {}});
  report.add({name + ".rows", static_cast<double>(times.most_rows), "1", {}, {}, {}});
  report.add({name + ".bodies", static_cast<double>(times.most_bodies), "1", {}, {}, {}});
  report.add({name + ".flags", static_cast<double>(times.flags), "1", {}, {}, {}});
}

/// `groups` contacts in a row, of each two bilateral rows, one of friction, and one that only presses, as between
/// organs. Near ones move together; a group's rows are coupled.
struct SolverProblem {
  explicit SolverProblem(int groups_wanted) : groups(groups_wanted) {
    const int m = 4 * groups;
    Eigen::Matrix4d own = Eigen::Vector4d(3e-3, 3e-3, 1e-3, 3e-3).asDiagonal();
    own += 3e-4 * (Eigen::Matrix4d::Ones() - Eigen::Matrix4d(Eigen::Matrix4d::Identity()));
    w.resize(m, m);
    for (int i = 0; i < groups; ++i) {
      for (int j = 0; j < groups; ++j) {
        const double near = std::exp(-0.5 * std::abs(i - j));
        for (int a = 0; a < 4; ++a) {
          for (int b = 0; b < 4; ++b) w(row(i, a), row(j, b)) = near * own(a, b);
        }
      }
    }
    rows.resize(m);
    for (int i = 0; i < groups; ++i) {
      const auto id = static_cast<std::uint64_t>(4 * i);
      const auto at = [&](int kind) -> ContactRow& { return rows[row(i, kind)]; };
      at(0) = physics::bilateral_row(id, 1e-5);
      at(1) = physics::bilateral_row(id + 1, 1e-5);
      at(2) = physics::friction_row(id + 2, 0.1, 0.2, {row(i, 0), row(i, 1)}, 0, 1e-5);
      at(3) = physics::unilateral_row(id + 3, 1e-5);
    }
    delta = lambda = Eigen::VectorXd::Zero(m);
    slipped = Eigen::VectorXd::Zero(groups);
  }
  /// Bilateral rows first, as the solver likes them.
  int row(int group, int kind) const { return kind < 2 ? 2 * group + kind : kind * groups + group; }
  /// Motions asked for in the k-th millisecond.
  void move(int k) {
    const double sway = 2e-3 * std::sin(3e-3 * k), along = 10e-3 * std::sin(4e-3 * k);
    for (int i = 0; i < groups; ++i) {
      delta[row(i, 0)] = sway * (1 + 0.1 * i);
      delta[row(i, 1)] = 0.5 * sway;
      delta[row(i, 2)] = along - slipped[i];
      delta[row(i, 3)] = 1e-3 * std::sin(5e-3 * k + i);
    }
  }
  void remember(const physics::BoundedSolver& solver) {
    for (int i = 0; i < groups; ++i) slipped[i] += solver.motion()[row(i, 2)];
  }

  int groups;
  std::vector<ContactRow> rows;
  Eigen::MatrixXd w;
  Eigen::VectorXd delta, lambda, slipped;
};

struct SolverTimes {
  Samples times;
  int fallbacks = 0;
  double residual = 0;
};

SolverTimes time_solver(int rows, int solves) {
  SolverProblem problem(rows / 4);
  physics::BoundedSolver solver(physics::kMaxRows);
  SolverTimes result{.times = Samples(static_cast<std::size_t>(solves))};
  for (int k = 0; k < solves; ++k) {
    problem.move(k);
    physics::BoundedSolveReport report;
    result.times.time([&] { report = solver.solve(problem.rows, problem.w, problem.delta, problem.lambda); });
    problem.remember(solver);
    result.fallbacks += report.fallback ? 1 : 0;
    result.residual = std::max(result.residual, report.residual);
  }
  return result;
}

}  // namespace

Report coupling_speed(const reference::ReferenceInsertion& insertion, const BenchOptions& options) {
  Report report;
  const double duration = options.quick ? 2.4 : 6;
  report_steps("speed.9_nodes.16_rows", time_steps(insertion, {.duration = duration}), 40, report);
  report_steps("speed.33_nodes.64_rows",
               time_steps(insertion, {.slabs = 3,
                                      .cells_deep = 3,
                                      .gap = 1e-3,
                                      .beams = 32,
                                      .spacing = 0.0025,
                                      .depth = 0.095,
                                      .lateral_rows = 64,
                                      .duration = duration + 0.3}),
               200, report);

  std::vector<double> sizes, medians, p99s;
  for (const int rows : {16, 32, 64, 96, 128, 160, 192}) {
    const SolverTimes solver = time_solver(rows, options.quick ? 300 : 5000);
    const std::string name = fmt::format("speed.solver.{}_rows", rows);
    report.add({name + ".median", solver.times.median(), "us", {}, {}, {}});
    report.add({name + ".p99", solver.times.p99(), "us", {}, {}, {}});
    report.add({name + ".fallbacks", static_cast<double>(solver.fallbacks), "1", {}, {}, {}});
    report.add({name + ".residual", solver.residual, "1", {}, {}, {}});
    sizes.push_back(rows);
    medians.push_back(solver.times.median());
    p99s.push_back(solver.times.p99());
  }
  if (options.out.empty()) return report;
  const std::array panels{figures::PlotPanel{
      .title = "One solve of the contact system, from the step before",
      .x = {.label = "rows: half bilateral, a quarter friction, a quarter unilateral", .min = 0},
      .y = {.label = "time, us", .min = 0},
      .series = {plot_line("median", sizes, medians, 0), plot_line("99th percentile", sizes, p99s, 1)},
      .markers = {},
      .dots = {}}};
  const std::array caption{fmt::format("192 rows: median {:.0f} us.", medians.back())};
  const std::array columns{FigureColumn{"rows", sizes}, FigureColumn{"median_us", medians},
                           FigureColumn{"p99_us", p99s}};
  write_figure(options.out, "coupling_solver", panels, caption, columns);
  return report;
}

}  // namespace stylet::bench
