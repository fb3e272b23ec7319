// Stages of a simulation step, and the step itself, by mesh size: median, p99 and max of the wall time, median and
// p99 of the thread's CPU time, in milliseconds; rates in hertz; memory traffic beside what the machine streams.
//
//   bin/stylet_simulation_bench
//
// The cube of reference insertion R1 with n nodes an edge. In the whole step a stiff needle with 8 contacts (16 rows)
// a body goes to and fro at 45 mm/s and 50 Hz, so that every sixth step lays a contact: steps with and without are
// reported apart. The factorisation worker runs between the steps, outside the measured time (delivery_). A contact
// that nobody saw coming costs the step w_bar_outside of 4 nodes more.
#include "physics/loops/simulation_loop.h"
#include "physics/needle/needle.h"
#include "physics/tissue/blas.h"
#include "physics/tissue/corotational.h"
#include "tools/reference/kuhn_box.h"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <ctime>
#include <limits>
#include <memory>
#include <string>
#include <vector>

namespace stylet::physics {
namespace {

SimulationBody cube(int nodes_per_edge, double low_x) {
  SimulationBody body;
  const int cells = nodes_per_edge - 1;
  body.mesh = reference::kuhn_box({low_x, 0, 0}, {low_x + 0.1, 0.1, 0.1}, {cells, cells, cells});
  body.tet_materials.assign(body.mesh.tets.size(), {10e3, 0.45});
  body.fixed_nodes = reference::nodes_where(body.mesh, [](const Eigen::Vector3d& x) { return x.z() < 1e-9; });
  return body;
}

/// CPU time of this thread, s: what the work costs when other programs are pressing on the cores.
double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

/// Durations of one kind of work, ms.
struct Durations {
  void report(benchmark::State& state, const std::string& prefix = "") {
    if (cpu.empty()) return;
    const auto quantile = [](std::vector<double>& samples, double q) {
      std::sort(samples.begin(), samples.end());
      return samples[static_cast<std::size_t>(q * double(samples.size() - 1))];
    };
    if (!wall.empty()) {
      state.counters[prefix + "median_ms"] = quantile(wall, 0.5);
      state.counters[prefix + "p99_ms"] = quantile(wall, 0.99);
      state.counters[prefix + "max_ms"] = quantile(wall, 1);
    }
    state.counters[prefix + "cpu_median_ms"] = quantile(cpu, 0.5);
    state.counters[prefix + "cpu_p99_ms"] = quantile(cpu, 0.99);
  }
  std::vector<double> wall;
  std::vector<double> cpu;
};

/// Runs `work` and files its time in whatever `kind()` then returns.
template <typename Work, typename Kind>
void time_into(benchmark::State& state, const Work& work, const Kind& kind) {
  const double cpu_start = cpu_seconds();
  const auto start = std::chrono::steady_clock::now();
  work();
  const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
  const double cpu = cpu_seconds() - cpu_start;
  state.SetIterationTime(elapsed.count());
  Durations& durations = kind();
  durations.wall.push_back(1e3 * elapsed.count());
  durations.cpu.push_back(1e3 * cpu);
}

/// Times `work` once an iteration. Returns the median CPU time, ms.
template <typename Work>
double sample(benchmark::State& state, const Work& work) {
  Durations durations;
  for (auto _ : state) time_into(state, work, [&]() -> Durations& { return durations; });
  durations.report(state);
  return state.counters["cpu_median_ms"];
}

/// What one core reads from memory, the bound of a solve.
void stream(benchmark::State& state) {
  const Eigen::VectorXd numbers = Eigen::VectorXd::Ones(std::int64_t{1} << 25);
  double sum = 0;
  const double ms = sample(state, [&] { benchmark::DoNotOptimize(sum += numbers.sum()); });
  state.counters["GB_s"] = 8e-6 * double(numbers.size()) / ms;
}

/// A bent cube with all that the stages need.
struct Tissue {
  explicit Tissue(const SimulationBody& body) : model(body.mesh, body.tet_materials, body.fixed_nodes) {
    for (int n = 0; n < model.node_count(); ++n) {
      const double z = positions(2, n);
      positions.col(n) += Eigen::Vector3d(z * z, 0.3 * z * z, 0);
    }
    update_rotations(model, positions, rotations);
    assemble();
    factor.factorise(pattern, values, workspace);
  }
  void assemble() { pattern.assemble(model, rotations, 1, values); }

  TissueModel model;
  Eigen::Matrix3Xd positions = rest_positions(model);
  Eigen::Matrix3Xd forces{3, model.node_count()};
  std::vector<Eigen::Quaterniond> rotations{model.tets.size(), Eigen::Quaterniond::Identity()};
  StiffnessPattern pattern{model};
  std::vector<double> values = std::vector<double>(pattern.nonzeros());
  SolveWorkspace workspace;
  Factorisation factor{pattern, workspace};
};

/// The same cube for all stages of a size: benchmarks of a size run one after the other.
Tissue& tissue(int nodes_per_edge) {
  static int size = 0;
  static std::unique_ptr<Tissue> current;
  if (size != nodes_per_edge) current = std::make_unique<Tissue>(cube(nodes_per_edge, 0));
  size = nodes_per_edge;
  return *current;
}

void rotations(benchmark::State& state) {
  Tissue& t = tissue(int(state.range(0)));
  // The warm start is off by what a simulation step turns: about a milliradian.
  const auto before = t.rotations;
  Eigen::Matrix3Xd moved = t.positions;
  for (int n = 0; n < t.model.node_count(); ++n) moved(0, n) += 0.02 * moved(2, n) * moved(2, n);
  sample(state, [&] {
    std::copy(before.begin(), before.end(), t.rotations.begin());
    benchmark::DoNotOptimize(update_rotations(t.model, moved, t.rotations));
  });
  state.counters["nodes"] = t.model.node_count();
  state.counters["tets"] = t.model.tet_count();
}

void forces(benchmark::State& state) {
  Tissue& t = tissue(int(state.range(0)));
  sample(state, [&] { internal_forces(t.model, t.positions, t.rotations, t.forces); });
}

/// Rotations and forces as a step makes them, in one pass, by range(1) threads.
void rotations_and_forces(benchmark::State& state) {
  Tissue& t = tissue(int(state.range(0)));
  Companion companion(state.range(1) > 1);
  ElementScratch scratch{.companion = &companion, .sums = {}};
  const auto before = t.rotations;
  Eigen::Matrix3Xd moved = t.positions;
  for (int n = 0; n < t.model.node_count(); ++n) moved(0, n) += 0.02 * moved(2, n) * moved(2, n);
  sample(state, [&] {
    std::copy(before.begin(), before.end(), t.rotations.begin());
    benchmark::DoNotOptimize(update_rotations_and_forces(t.model, moved, t.rotations, t.forces, {}, {}, scratch));
  });
}

void assembly(benchmark::State& state) {
  Tissue& t = tissue(int(state.range(0)));
  sample(state, [&] { t.assemble(); });
}

/// By range(1) threads; 0: as CHOLMOD makes it, one.
void factorisation(benchmark::State& state) {
  Tissue& t = tissue(int(state.range(0)));
  Companion companion(state.range(1) > 1);
  Factorisation factor(t.pattern, t.workspace);
  factor.make_own_from(state.range(1) == 0 ? std::numeric_limits<std::size_t>::max() : 0);
  t.workspace.companion = &companion;
  sample(state, [&] { factor.factorise(t.pattern, t.values, t.workspace); });
  t.workspace.companion = nullptr;
  state.counters["nnzL_M"] = 1e-6 * double(factor.factor_nonzeros());
}

/// One right-hand side: L is read twice.
void solve(benchmark::State& state) {
  Tissue& t = tissue(int(state.range(0)));
  const Eigen::VectorXd b = Eigen::VectorXd::Random(t.model.dof_count());
  Eigen::VectorXd x(b.size());
  const double ms = sample(state, [&] { t.factor.solve(b, x, t.workspace); });
  state.counters["GB_s"] = 2 * 8e-6 * double(t.factor.factor_nonzeros()) / ms;
}

/// The same with L in range(1) of PassPrecision, by range(2) threads.
void solve_nearly(benchmark::State& state) {
  Tissue& t = tissue(int(state.range(0)));
  Companion companion(state.range(2) > 1);
  t.factor.limit_precision(static_cast<PassPrecision>(state.range(1)), 0);
  t.factor.factorise(t.pattern, t.values, t.workspace);
  t.workspace.companion = &companion;
  const Eigen::VectorXd b = Eigen::VectorXd::Random(t.model.dof_count());
  Eigen::VectorXd x(b.size());
  const double ms = sample(state, [&] { t.factor.solve_nearly(b, x, t.workspace); });
  t.workspace.companion = nullptr;
  state.counters["GB_s"] = 2e-6 * double(t.factor.compact().bytes()) / ms;
  state.counters["MB"] = 1e-6 * double(t.factor.compact().bytes());
  state.counters["serial"] = t.factor.compact().serial_share();
  Eigen::VectorXd exact(b.size());
  t.factor.solve(b, exact, t.workspace);
  state.counters["rel_error"] = (x - exact).norm() / exact.norm();
}

/// The free nodes nearest to the line where the needle goes, in a straight tube through the cube.
std::vector<int> corridor_nodes(const TissueModel& model, int count) {
  std::vector<int> nodes;
  for (int n = 0; n < model.node_count(); ++n) {
    if (model.free_index[n] >= 0) nodes.push_back(n);
  }
  const auto distance = [&](int n) {
    const Eigen::Vector3d& x = model.mesh.nodes[n];
    return std::hypot(x.y() - 0.047, x.z() - 0.053);
  };
  std::stable_sort(nodes.begin(), nodes.end(), [&](int a, int b) { return distance(a) < distance(b); });
  nodes.resize(count);
  return nodes;
}

std::vector<int> dofs_of(const TissueModel& model, const std::vector<int>& nodes) {
  std::vector<int> dofs;
  for (const int node : nodes) {
    for (int c = 0; c < 3; ++c) dofs.push_back(3 * model.free_index[node] + c);
  }
  return dofs;
}

/// W_bar of a corridor of range(1) nodes that the factor eliminates last: all of it, from the factor. Beside it what
/// the order costs: symbolic analysis, a factorisation, the growth of L. rel_error: against full solves.
void w_bar_trailing(benchmark::State& state) {
  Tissue& t = tissue(int(state.range(0)));
  const std::vector<int> nodes = corridor_nodes(t.model, int(state.range(1)));
  const std::vector<int> dofs = dofs_of(t.model, nodes);
  const auto size = static_cast<Eigen::Index>(dofs.size());
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(t.model.dof_count(), size);
  for (Eigen::Index k = 0; k < size; ++k) columns(dofs[k], k) = 1;
  t.factor.solve(columns, columns, t.workspace);
  const Eigen::MatrixXd exact = columns(dofs, Eigen::all);
  const double plain = double(t.factor.factor_nonzeros());

  const double start = cpu_seconds();
  t.factor.order_last(dofs, t.pattern, t.workspace);
  const double analysed = cpu_seconds();
  t.factor.factorise(t.pattern, t.values, t.workspace);
  const double factorised = cpu_seconds();
  IsolatedDofs isolated(t.model.node_count(), kMaxPatchNodes);
  sample(state, [&] { isolated.reset(nodes, t.model, t.factor); });
  Eigen::MatrixXd w_bar(size, size);
  isolated.gather(nodes, w_bar);
  state.counters["dofs"] = double(size);
  state.counters["rel_error"] = (w_bar - exact).norm() / exact.norm();
  state.counters["analysis_ms"] = 1e3 * (analysed - start);
  state.counters["factorisation_ms"] = 1e3 * (factorised - analysed);
  state.counters["nnzL_growth"] = double(t.factor.factor_nonzeros()) / plain;
  t.factor.order_last({}, t.pattern, t.workspace);
  t.factor.factorise(t.pattern, t.values, t.workspace);
}

/// W_bar of range(1) nodes outside the corridor: what one unforeseen contact costs (4), and a whole path (40).
void w_bar_outside(benchmark::State& state) {
  Tissue& t = tissue(int(state.range(0)));
  IsolatedDofs isolated(t.model.node_count(), kMaxPatchNodes);
  const std::vector<int> nodes = corridor_nodes(t.model, int(state.range(1)));
  sample(state, [&] {
    isolated.clear();
    isolated.isolate(nodes, t.model, t.factor, t.workspace);
  });
}

/// A rigid straight needle whose tip is at `tip_x`, pressing a little on all isolated nodes.
NeedleState needle_to(double tip_x, const TissuePatch& patch) {
  NeedleState needle;
  needle.node_count = 9;
  for (int i = 0; i < 9; ++i) {
    needle.positions.col(i) = Eigen::Vector3d(tip_x - 0.25 + 0.03125 * i, 0.047, 0.053);
    needle.orientations[i] = orientation_along(Eigen::Vector3d::UnitX());
  }
  for (int b = 0; b < patch.body_count; ++b) {
    for (int i = 0; i < patch.bodies[b].node_count; ++i) {
      needle.forces[needle.force_count++] = {
          .body = b, .node = patch.bodies[b].node_ids[i], .force = {0, 0.02, 0.01}};
    }
  }
  return needle;
}

/// One simulation step with range(1) bodies of range(0)^3 nodes each; L in range(2) of PassPrecision, range(3)
/// threads.
void step(benchmark::State& state) {
  const int n = int(state.range(0));
  std::vector<SimulationBody> bodies;
  bodies.reserve(state.range(1));
  for (int b = 0; b < int(state.range(1)); ++b) bodies.push_back(cube(n, 0.11 * b));
  SimulationLoop loop(
      std::move(bodies),
      {.dt = 0.02, .two_threads = state.range(3) > 1, .coarsest = static_cast<PassPrecision>(state.range(2))});
  TissuePatch patch = loop.make_patch();
  const int worker_period = n > 20 ? 30 : 10;  // about what a factorisation takes at 50 Hz
  const double stroke = 0.0024;
  double tip = state.range(1) == 1 ? -0.002 : 0.108;
  const double end = tip + 0.0735;  // the eighth contact of the last body is laid 1.5 mm before
  NeedleState needle = needle_to(tip, patch);
  SimulationReport report;
  int count = 0;
  Durations delivery;
  const auto advance = [&](double by) {
    if (++count % worker_period == 0) {
      const double start = cpu_seconds();
      loop.worker().step();
      delivery.cpu.push_back(1e3 * (cpu_seconds() - start));
    }
    tip += by;
    needle = needle_to(tip, patch);
  };
  while (tip < end) {
    report = loop.step({.needle = &needle}, patch);
    advance(0.0025);
  }

  Durations quiet;
  Durations laying;
  double direction = -1;
  int contacts = report.contact_count;
  int computed = 0;
  int laid = 0;
  for (auto _ : state) {
    time_into(
        state, [&] { report = loop.step({.needle = &needle}, patch); },
        [&]() -> Durations& { return report.contact_count > contacts ? laying : quiet; });
    if (report.contact_count > contacts) {
      ++laid;
      computed += report.new_isolated_nodes;
    }
    contacts = report.contact_count;
    if (tip > end || tip < end - stroke) direction = tip > end ? -1 : 1;
    advance(direction * 0.0009);
  }
  quiet.report(state);
  laying.report(state, "laying_");
  delivery.report(state, "delivery_");
  state.counters["rate_hz"] = 1e3 / state.counters["median_ms"];
  state.counters["cpu_rate_hz"] = 1e3 / state.counters["cpu_median_ms"];
  state.counters["contacts"] = contacts;
  state.counters["isolated"] = report.isolated_nodes;
  state.counters["laid"] = laid;
  state.counters["nodes_computed_a_contact"] = laid == 0 ? 0 : double(computed) / laid;
}

void register_all() {
  const auto add = [](const char* name, void (*run)(benchmark::State&), const std::vector<std::int64_t>& arguments,
                      int iterations) {
    auto* const registered = benchmark::RegisterBenchmark(name, run);
    if (!arguments.empty()) registered->Args(arguments);
    registered->UseManualTime()->Unit(benchmark::kMillisecond)->Iterations(iterations);
  };
  add("stream", stream, {}, 8);
  for (const int n : {7, 10, 12, 14, 16, 18, 27}) {
    const int few = n > 20 ? 3 : 10;
    add("rotations", rotations, {n}, 50);
    add("forces", forces, {n}, 50);
    for (const int threads : {1, 2}) {
      add("rotations_and_forces", rotations_and_forces, {n, threads}, 50);
      for (const auto precision : {PassPrecision::single, PassPrecision::sixteen_bits, PassPrecision::twelve_bits}) {
        add("solve_nearly", solve_nearly, {n, static_cast<int>(precision), threads}, 50);
      }
    }
    add("solve", solve, {n}, 30);
    add("w_bar_trailing", w_bar_trailing, {n, 40}, 30);
    add("w_bar_trailing", w_bar_trailing, {n, 100}, 30);
    add("w_bar_outside", w_bar_outside, {n, 4}, 2 * few);
    add("w_bar_outside", w_bar_outside, {n, 40}, few);
    add("assembly", assembly, {n}, 20);
    for (const int threads : {0, 1, 2}) add("factorisation", factorisation, {n, threads}, few);
    for (const auto precision : {PassPrecision::single, PassPrecision::sixteen_bits, PassPrecision::twelve_bits}) {
      for (const int threads : {1, 2}) {
        add("step", step, {n, 1, static_cast<int>(precision), threads}, n > 20 ? 120 : 240);
      }
    }
    if (n == 14) add("step", step, {n, 2, 0, 2}, 240);
  }
}

}  // namespace
}  // namespace stylet::physics

int main(int argc, char** argv) {
  const stylet::physics::BlasLibrary& blas = stylet::physics::single_threaded_blas();
  std::printf("flags: %s; BLAS: %s\n", STYLET_FLAGS, blas.name.c_str());
  stylet::physics::register_all();
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
