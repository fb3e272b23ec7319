// Time of one haptic step: needle of 8 to 64 beams, 0 to 64 constraint rows. Median, 99th percentile and maximum in
// microseconds; the stages of the largest common case by themselves.
#include "physics/contact/constraint_solver.h"
#include "physics/contact/delassus.h"
#include "physics/contact/shaft.h"
#include "physics/loops/haptic_loop.h"
#include "physics/needle/beam.h"
#include "physics/needle/block_tridiagonal.h"
#include "physics/needle/section.h"
#include "tests/physics/haptic_loop_synthetic_patch.h"

#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <vector>

namespace {

using namespace stylet::physics;
using Clock = std::chrono::steady_clock;

void report(benchmark::State& state, std::vector<double>& microseconds) {
  if (microseconds.empty()) return;
  std::sort(microseconds.begin(), microseconds.end());
  const double last = static_cast<double>(microseconds.size() - 1);
  const auto at = [&](double f) { return microseconds[static_cast<std::size_t>(f * last)]; };
  state.counters["median_us"] = at(0.5);
  state.counters["p99_us"] = at(0.99);
  state.counters["max_us"] = microseconds.back();
}

/// The hub sways sideways by 3 mm while every step runs; a new epoch every `steps_per_patch` steps.
void haptic_step(benchmark::State& state) {
  HapticLoopSettings settings;
  settings.needle.beams = static_cast<int>(state.range(0));
  const int contacts = static_cast<int>(state.range(1)) / 2;
  const StylusPose rest;
  HapticLoop loop(settings, rest);
  TissuePatch patch;
  if (contacts > 0) patch = testing::synthetic_patch(loop.state(), contacts, 0.4, 0.98);
  constexpr int kStepsPerPatch = 20;
  std::vector<double> times;
  times.reserve(1 << 20);
  int i = 0;
  for (auto _ : state) {
    StylusPose hub = rest;
    hub.position.x() = 3e-3 * std::sin(2e-3 * i);
    if (contacts > 0 && i % kStepsPerPatch == 0) ++patch.epoch;
    ++i;
    const auto start = Clock::now();
    benchmark::DoNotOptimize(loop.step(hub, 1e-3, patch));
    const auto end = Clock::now();
    const double seconds = std::chrono::duration<double>(end - start).count();
    state.SetIterationTime(seconds);
    if (times.size() < times.capacity()) times.push_back(1e6 * seconds);
  }
  report(state, times);
  if (loop.state().flags != 0) state.SkipWithError("the step raised a flag");
}
BENCHMARK(haptic_step)
    ->ArgNames({"beams", "rows"})
    ->Args({8, 0})
    ->Args({8, 16})
    ->Args({8, 64})
    ->Args({64, 16})
    ->Args({64, 64})
    ->UseManualTime()
    ->Unit(benchmark::kMicrosecond);

struct Stage {
  NeedleProperties properties;
  Needle needle{properties, NeedleBase{}};
  NeedleShape shape = straight_needle(properties, StylusPose{});
  HapticLoop loop{{}, StylusPose{}};
  TissuePatch patch;
  TissuePoints tissue;
  std::vector<ActiveContact> contacts;
  Delassus delassus{needle.node_count(), kMaxRows};
  ConstraintSolver solver{kMaxRows};
  int count;

  explicit Stage(const benchmark::State& state) : count(static_cast<int>(state.range(0)) / 2) {
    patch = testing::synthetic_patch(loop.state(), count, 0.4, 0.98);
    tissue.load(patch);
    for (int i = 0; i < count; ++i) {
      const ShaftPoint p = project_on_shaft(shape.nodes(), tissue.position(i));
      contacts.push_back(lateral_contact(i, 2 * i, p, lateral_directions(p.tangent, shape.orientation(p.beam))));
    }
    needle.linearise(shape, StylusPose{}, 1e-3);
    delassus.assemble(needle, tissue, contacts, count);
  }
};

void linearise_needle(benchmark::State& state) {
  Stage s(state);
  for (auto _ : state) benchmark::DoNotOptimize(s.needle.linearise(s.shape, StylusPose{}, 1e-3));
}
void respond_beam(benchmark::State& state) {
  const NeedleProperties n;
  const Beam beam{.length = n.length / n.beams,
                  .rest_frame = Eigen::Matrix3d::Identity(),
                  .section = tube_section(n.outer_diameter, n.inner_diameter, n.young_modulus, n.poisson_ratio)};
  const BeamEnd a{Eigen::Vector3d::Zero(), Eigen::Matrix3d::Identity()};
  const BeamEnd b{Eigen::Vector3d(beam.length, 1e-3, 0), Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitZ()).matrix()};
  for (auto _ : state) benchmark::DoNotOptimize(beam_response(beam, a, b));
}
void assemble_needle(benchmark::State& state) {
  Stage s(state);
  for (auto _ : state) {
    s.needle.assemble(s.shape, StylusPose{}, 1e-3);
    benchmark::ClobberMemory();
  }
}
/// With a copy of A_n, which the factorisation overwrites.
void factorise_block_tridiagonal(benchmark::State& state) {
  Stage s(state);
  s.needle.assemble(s.shape, StylusPose{}, 1e-3);
  const BlockTridiagonal a_n = s.needle.factor();
  BlockTridiagonal factor = a_n;
  for (auto _ : state) {
    factor = a_n;
    benchmark::DoNotOptimize(factor.factorise());
  }
}
void solve_block_tridiagonal(benchmark::State& state) {
  Stage s(state);
  const Eigen::VectorXd load = Eigen::VectorXd::Constant(6 * s.needle.node_count(), 1e-3);
  Eigen::VectorXd x = load;
  for (auto _ : state) {
    x = load;
    s.needle.factor().solve(x);
    benchmark::DoNotOptimize(x.data());
    benchmark::ClobberMemory();
  }
}
void synchronise_patch(benchmark::State& state) {
  Stage s(state);
  for (auto _ : state) benchmark::DoNotOptimize(s.tissue.load(s.patch));
}
void assemble_delassus(benchmark::State& state) {
  Stage s(state);
  for (auto _ : state) {
    s.delassus.assemble(s.needle, s.tissue, s.contacts, s.count);
    benchmark::ClobberMemory();
  }
}
void solve_constraints(benchmark::State& state) {
  Stage s(state);
  const Eigen::VectorXd delta = Eigen::VectorXd::Constant(2 * s.count, 1e-4);
  Eigen::VectorXd lambda = delta;
  for (auto _ : state) {
    const double compliance = 1e-3 * s.delassus.mean_tissue_compliance();
    benchmark::DoNotOptimize(s.solver.solve(s.delassus.matrix(), compliance, delta, lambda));
  }
}
BENCHMARK(linearise_needle)->ArgName("rows")->Arg(16)->Unit(benchmark::kMicrosecond);
BENCHMARK(respond_beam)->Unit(benchmark::kMicrosecond);
BENCHMARK(assemble_needle)->ArgName("rows")->Arg(16)->Unit(benchmark::kMicrosecond);
BENCHMARK(factorise_block_tridiagonal)->ArgName("rows")->Arg(16)->Unit(benchmark::kMicrosecond);
BENCHMARK(solve_block_tridiagonal)->ArgName("rows")->Arg(16)->Unit(benchmark::kMicrosecond);
BENCHMARK(synchronise_patch)->ArgName("rows")->Arg(16)->Arg(64)->Unit(benchmark::kMicrosecond);
BENCHMARK(assemble_delassus)->ArgName("rows")->Arg(16)->Arg(64)->Unit(benchmark::kMicrosecond);
BENCHMARK(solve_constraints)->ArgName("rows")->Arg(16)->Arg(64)->Unit(benchmark::kMicrosecond);

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  std::printf("built with: %s\n", STYLET_FLAGS);
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
