// Stages of a simulation step, and the step itself, by mesh size: median, p99 and max of the wall time, median and
// p99 of the thread's CPU time, in milliseconds.
//
//   bin/stylet_simulation_bench
//
// The cube of reference insertion R1 with n nodes an edge. In the whole step a stiff needle goes through one body, or
// through two of that size one behind the other, at 45 mm/s and 50 Hz; the factorisation worker runs between the
// steps, outside the measured time.
#include "physics/loops/simulation_loop.h"
#include "physics/tissue/blas.h"
#include "physics/tissue/corotational.h"
#include "tests/support/kuhn_box.h"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <memory>
#include <vector>

namespace stylet::physics {
namespace {

SimulationBody cube(int nodes_per_edge, double low_x) {
  SimulationBody body;
  const int cells = nodes_per_edge - 1;
  body.mesh = support::kuhn_box({low_x, 0, 0}, {low_x + 0.1, 0.1, 0.1}, {cells, cells, cells});
  body.tet_materials.assign(body.mesh.tets.size(), {10e3, 0.45});
  body.fixed_nodes = support::nodes_where(body.mesh, [](const Eigen::Vector3d& x) { return x.z() < 1e-9; });
  return body;
}

/// CPU time of this thread, s: what the work costs when other programs are pressing on the cores.
double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return double(now.tv_sec) + 1e-9 * double(now.tv_nsec);
}

/// Times `work` once an iteration, not what is done `between`, and reports the distribution.
template <typename Work, typename Between>
void sample(benchmark::State& state, const Work& work, const Between& between) {
  std::vector<double> milliseconds;
  std::vector<double> cpu;
  for (auto _ : state) {
    const double cpu_start = cpu_seconds();
    const auto start = std::chrono::steady_clock::now();
    work();
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    state.SetIterationTime(elapsed.count());
    milliseconds.push_back(1e3 * elapsed.count());
    cpu.push_back(1e3 * (cpu_seconds() - cpu_start));
    between();
  }
  const auto quantile = [](std::vector<double>& samples, double q) {
    std::sort(samples.begin(), samples.end());
    return samples[static_cast<std::size_t>(q * double(samples.size() - 1))];
  };
  state.counters["median_ms"] = quantile(milliseconds, 0.5);
  state.counters["p99_ms"] = quantile(milliseconds, 0.99);
  state.counters["max_ms"] = quantile(milliseconds, 1);
  state.counters["cpu_median_ms"] = quantile(cpu, 0.5);
  state.counters["cpu_p99_ms"] = quantile(cpu, 0.99);
}

template <typename Work>
void sample(benchmark::State& state, const Work& work) {
  sample(state, work, [] {});
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

void assembly(benchmark::State& state) {
  Tissue& t = tissue(int(state.range(0)));
  sample(state, [&] { t.assemble(); });
}

void factorisation(benchmark::State& state) {
  Tissue& t = tissue(int(state.range(0)));
  sample(state, [&] { t.factor.factorise(t.pattern, t.values, t.workspace); });
  state.counters["nnzL_M"] = 1e-6 * double(t.factor.factor_nonzeros());
}

void solve(benchmark::State& state) {
  Tissue& t = tissue(int(state.range(0)));
  Eigen::VectorXd b = Eigen::VectorXd::Random(t.model.dof_count());
  Eigen::VectorXd x(b.size());
  sample(state, [&] { t.factor.solve(b, x, t.workspace); });
}

/// W_bar of `nodes` nodes from nothing: what one new contact costs (4), and a whole path (40).
void w_bar(benchmark::State& state) {
  Tissue& t = tissue(int(state.range(0)));
  IsolatedDofs isolated(t.model.node_count(), kMaxPatchNodes);
  std::vector<int> nodes;
  for (int i = 0; i < int(state.range(1)); ++i) nodes.push_back(t.model.node_count() / 2 + i);
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
    needle.orientations[std::size_t(i)] =
        Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), Eigen::Vector3d::UnitX());
  }
  for (int b = 0; b < patch.body_count; ++b) {
    for (int i = 0; i < patch.bodies[std::size_t(b)].node_count; ++i) {
      needle.forces[std::size_t(needle.force_count++)] = {
          .body = b, .node = patch.bodies[std::size_t(b)].node_ids[std::size_t(i)], .force = {0, 0.02, 0.01}};
    }
  }
  return needle;
}

/// One simulation step with range(1) bodies of range(0)^3 nodes each; the factor is renewed every 10 steps.
void step(benchmark::State& state) {
  std::vector<SimulationBody> bodies;
  for (int b = 0; b < int(state.range(1)); ++b) bodies.push_back(cube(int(state.range(0)), 0.11 * b));
  SimulationLoop loop(std::move(bodies), {.dt = 0.02});
  TissuePatch patch = loop.make_patch();
  const double depth = state.range(1) == 1 ? 0.095 : 0.2;
  double tip = -0.002;
  double direction = 1;
  int count = 0;
  int most_contacts = 0;
  int most_nodes = 0;
  NeedleState needle = needle_to(tip, patch);
  SimulationReport report;
  const auto advance = [&] {
    most_contacts = std::max(most_contacts, report.contact_count);
    most_nodes = std::max(most_nodes, report.isolated_nodes);
    if (++count % 10 == 0) loop.worker().step();
    tip += direction * 0.0009;
    if (tip > depth || tip < -0.002) direction = -direction;
    needle = needle_to(tip, patch);
  };
  sample(
      state, [&] { report = loop.step({.needle = &needle}, patch); }, advance);
  state.counters["contacts"] = most_contacts;
  state.counters["isolated"] = most_nodes;
}

void register_all() {
  for (const int n : {10, 14, 18}) {
    const auto configure = [&](benchmark::internal::Benchmark* b, int iterations) {
      b->UseManualTime()->Unit(benchmark::kMillisecond)->Iterations(iterations);
    };
    configure(benchmark::RegisterBenchmark("rotations", rotations)->Arg(n), 50);
    configure(benchmark::RegisterBenchmark("forces", forces)->Arg(n), 50);
    configure(benchmark::RegisterBenchmark("assembly", assembly)->Arg(n), 30);
    configure(benchmark::RegisterBenchmark("factorisation", factorisation)->Arg(n), n > 14 ? 5 : 10);
    configure(benchmark::RegisterBenchmark("solve", solve)->Arg(n), 50);
    configure(benchmark::RegisterBenchmark("w_bar", w_bar)->Args({n, 4}), 30);
    configure(benchmark::RegisterBenchmark("w_bar", w_bar)->Args({n, 40}), 10);
    configure(benchmark::RegisterBenchmark("step", step)->Args({n, 1}), 300);
    if (n == 14) configure(benchmark::RegisterBenchmark("step", step)->Args({n, 2}), 300);
  }
}

}  // namespace
}  // namespace stylet::physics

int main(int argc, char** argv) {
  const stylet::physics::BlasLibrary blas = stylet::physics::use_single_threaded_blas();
  std::printf("flags: %s; BLAS: %s\n", STYLET_FLAGS, blas.name.c_str());
  stylet::physics::register_all();
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
