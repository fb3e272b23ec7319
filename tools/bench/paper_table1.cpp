// Table I of the paper: time of the haptic step and its stages through R1, with and without constraints.
#include "physics/loops/haptic_stage_clock.h"
#include "tools/bench/haptic_cost.h"
#include "tools/bench/paper.h"
#include "tools/bench/samples.h"
#include "tools/reference/reference_insertion.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <string>

namespace stylet::bench {

namespace {

using physics::HapticStage;

/// A row of Table I. Figures of the paper: average and maximum, us, without and with 12 to 16 constraints.
struct Row {
  const char* name;
  HapticStage stage;
  bool in_paper;
  double free_average, free_max, constraints_average, constraints_max;
};
constexpr std::array kRows{
    Row{"free_motion", HapticStage::free_motion, true, 90, 150, 60, 150},
    Row{"needle_factor", HapticStage::needle_factor, true, 20, 30, 10, 30},
    Row{"positions", HapticStage::contact_positions, true, 0, 0, 0, 0},
    Row{"directions", HapticStage::contact_directions, true, 0, 0, 0, 30},
    Row{"h", HapticStage::contact_rows, true, 0, 10, 0, 10},
    Row{"delta_free", HapticStage::delta_free, true, 0, 0, 0, 0},
    Row{"w", HapticStage::delassus, true, 0, 30, 40, 120},
    Row{"solve", HapticStage::solve, true, 20, 120, 220, 580},
    Row{"correction", HapticStage::correction, true, 10, 40, 10, 30},
    Row{"force", HapticStage::force, true, 10, 10, 10, 20},
    Row{"synchronisation", HapticStage::synchronisation, false, 0, 0, 0, 0},
    Row{"publication", HapticStage::publication, false, 0, 0, 0, 0},
};

/// Timings of one of the two columns.
struct Column {
  Samples total{1 << 14};  // without the stage clock
  std::array<Samples, physics::kHapticStages> stages;

  void add_stages(const physics::HapticStageClock& clock) {
    for (std::size_t s = 0; s < stages.size(); ++s) stages[s].add(clock.time(static_cast<HapticStage>(s)));
  }
  Samples& stage(HapticStage s) { return stages[static_cast<std::size_t>(s)]; }
};

struct Run {
  double duration;
  int repeats;
};

/// R1 in air: the same motion of the hub, no tissue.
void time_in_air(const reference::ReferenceInsertion& insertion, const Run& run, bool by_stage, Column& column) {
  const physics::TissuePatch no_tissue;
  const int steps = static_cast<int>(run.duration * insertion.haptic_hz);
  for (int r = 0; r < run.repeats; ++r) {
    physics::HapticLoopSettings settings;
    settings.needle = insertion.needle;
    physics::HapticLoop loop(settings, insertion.base(0));
    physics::HapticStageClock clock;
    if (by_stage) loop.time_stages(&clock);
    for (int i = 1; i <= steps; ++i) {
      const physics::StylusPose hub = insertion.base(i / insertion.haptic_hz);
      const auto start = Clock::now();
      loop.step(hub, 1 / insertion.haptic_hz, no_tissue);
      const auto time = Clock::now() - start;
      if (by_stage) {
        column.add_stages(clock);
      } else {
        column.total.add(time);
      }
    }
  }
}

/// R1: the steps with 12 to 16 rows.
void time_in_tissue(const reference::ReferenceInsertion& insertion, const Run& run, bool by_stage, Column& column) {
  for (int r = 0; r < run.repeats; ++r) {
    reference::ReferenceExperiment experiment(insertion, {});
    physics::HapticStageClock clock;
    if (by_stage) experiment.haptic().time_stages(&clock);
    while (experiment.time_s() < run.duration) {
      experiment.simulation_step();
      for (int i = 0; i < insertion.haptic_steps_per_simulation_step(); ++i) {
        const auto start = Clock::now();
        experiment.haptic_step();
        const auto time = Clock::now() - start;
        const int rows = 2 * experiment.needle().contact_count;
        if (rows < 12 || rows > 16) continue;
        if (by_stage) {
          column.add_stages(clock);
        } else {
          column.total.add(time);
        }
      }
    }
  }
}

void add_rows(Report& report, const std::string& column_name, Column& column, bool with_constraints) {
  for (const Row& row : kRows) {
    const std::string name = std::string("table1.") + row.name + "." + column_name;
    if (row.in_paper) {
      add_quantiles(report, name, column.stage(row.stage),
                    with_constraints ? row.constraints_average : row.free_average,
                    with_constraints ? row.constraints_max : row.free_max);
    } else {
      add_quantiles(report, name, column.stage(row.stage));
    }
  }
}

void add_total(Report& report, const std::string& name, const Samples& total, double paper_average, double paper_max,
               std::optional<double> median_bound) {
  report.add({name + ".average", total.average(), "us", paper_average, {}, {}});
  report.add({name + ".max", total.max(), "us", paper_max, {}, {}});
  report.add(median_bound ? at_most(name + ".median", total.median(), "us", *median_bound, paper_average)
                          : Measurement{name + ".median", total.median(), "us", paper_average, {}, {}});
  report.add({name + ".p99", total.p99(), "us", {}, {}, {}});
  report.add({name + ".steps", static_cast<double>(total.count()), "1", {}, {}, {}});
}

/// Steps with exactly so many rows: R1 with contacts laid densely enough to come to them, then the hub sways by 0.1
/// mm there, between two simulation steps. Rows this dense depend on each other on this mesh, so they are softened as
/// by default.
Samples time_rows(reference::ReferenceInsertion insertion, int rows, int steps) {
  constexpr double kDepth = 0.045;  // m of shaft in the cube, which R1 passes
  insertion.contact_spacing = kDepth / (0.5 * rows - 0.5);
  reference::ReferenceExperiment experiment(insertion, {.relative_compliance = 1e-3});
  const auto reached = [&] { return 2 * experiment.needle().contact_count == rows; };
  while (experiment.time_s() < insertion.duration && !reached()) experiment.advance();
  Samples samples(static_cast<std::size_t>(steps));
  physics::StylusPose hub = insertion.base(experiment.time_s());
  const double rest = hub.position.y();
  for (int i = 0; i < steps; ++i) {
    hub.position.y() = rest + 1e-4 * std::sin(0.02 * i);
    const auto start = Clock::now();
    experiment.haptic().step(hub, 1 / insertion.haptic_hz, experiment.patch_in_use());
    const auto time = Clock::now() - start;
    if (reached()) samples.add(time);
  }
  return samples;
}

}  // namespace

Report paper_table1(const BenchOptions& options) {
  const reference::ReferenceInsertion insertion = reference::read_reference_insertion(options.reference_insertion);
  // Quick: until the first rows of Table I have been there for a while.
  const Run run = options.quick ? Run{0.6 * insertion.duration, 1} : Run{insertion.duration, 3};
  Column free;
  Column constraints;
  for (const bool by_stage : {false, true}) {
    time_in_air(insertion, run, by_stage, free);
    time_in_tissue(insertion, run, by_stage, constraints);
  }
  Report report;
  add_total(report, "table1.total.constraints", constraints.total, 390, 970, 30.0);
  add_rows(report, "constraints", constraints, true);
  add_total(report, "table1.total.free", free.total, 160, 330, {});
  add_rows(report, "free", free, false);

  const MachinePeak peak = measure_peak();
  report.add({"machine.dgemm", peak.flops_per_us * 1e-3, "Gflop/s", {}, {}, {}});
  report.add({"machine.stream.cache", peak.cache_bytes_per_us * 1e-3, "GB/s", {}, {}, {}});
  report.add({"machine.stream.memory", peak.memory_bytes_per_us * 1e-3, "GB/s", {}, {}, {}});
  for (const int rows : {16, 64, 192}) {
    const Samples samples = time_rows(insertion, rows, options.quick ? 300 : 5000);
    const std::string name = "rows." + std::to_string(rows);
    const Cost cost = haptic_step_cost(insertion.needle.beams, rows);
    const double limit = peak.shortest_time_us(cost);
    report.add({name + ".steps", static_cast<double>(samples.count()), "1", {}, {}, {}});
    report.add({name + ".median", samples.median(), "us", {}, {}, {}});
    report.add({name + ".p99", samples.p99(), "us", {}, {}, {}});
    report.add({name + ".max", samples.max(), "us", {}, {}, {}});
    report.add({name + ".flops", cost.flops, "flop", {}, {}, {}});
    report.add({name + ".bytes", cost.bytes, "byte", {}, {}, {}});
    report.add({name + ".limit", limit, "us", {}, {}, {}});
    report.add({name + ".fraction_of_limit", samples.count() > 0 ? limit / samples.median() : 0, "1", {}, {}, {}});
  }
  return report;
}

}  // namespace stylet::bench
