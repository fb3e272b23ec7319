// Time of one solve of bilateral and friction rows: a needle that is pushed in, swayed and drawn back, so that
// contacts stick, slip and turn round. Warm starts from the step before, cold from nothing. Counters: median, 99th
// percentile and maximum in microseconds, pivots and bound updates a solve, and the elimination's operations as a
// part of what the core can do.
#include "physics/contact/bounded_solver.h"
#include "physics/contact/constraint_solver.h"
#include "physics/messages/messages.h"

#include <benchmark/benchmark.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <random>
#include <vector>

namespace {

using namespace stylet::physics;
using Clock = std::chrono::steady_clock;

/// Multiplications and additions a second with everything in registers: ten independent chains of fused ones.
double peak_flops() {
  using Packet = Eigen::internal::packet_traits<double>::type;
  constexpr int kChains = 10;
  constexpr int kRounds = 2'000'000;
  constexpr int kLanes = Eigen::internal::packet_traits<double>::size;
  double best = 0;
  for (int trial = 0; trial < 5; ++trial) {
    Packet x[kChains];
    for (Packet& p : x) p = Eigen::internal::pset1<Packet>(1.0);
    const Packet a = Eigen::internal::pset1<Packet>(0.999);
    const Packet b = Eigen::internal::pset1<Packet>(1e-3);
    const auto start = Clock::now();
    for (int i = 0; i < kRounds; ++i) {
      for (Packet& p : x) p = Eigen::internal::pmadd(p, a, b);
    }
    for (Packet& p : x) benchmark::DoNotOptimize(p);
    const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
    best = std::max(best, 2.0 * kLanes * kChains * kRounds / seconds);
  }
  return best;
}

/// `contacts` along a shaft, two lateral rows and one axial friction row each, bilateral rows first.
struct Shaft {
  int contacts;
  std::vector<ContactRow> rows;
  Eigen::MatrixXd w;
  Eigen::VectorXd delta;
  Eigen::VectorXd lambda;
  Eigen::VectorXd anchors;

  Shaft(int contact_count, double viscosity) : contacts(contact_count) {
    const int m = 3 * contacts;
    std::mt19937 engine(1);
    std::normal_distribution<double> tilt(0, 0.2);
    // Compliance of tissue and needle: near contacts move together, the needle hardly stretches. In each contact's
    // own directions, which are tilted against the shaft.
    Eigen::MatrixXd straight = Eigen::MatrixXd::Zero(m, m);
    Eigen::MatrixXd turn = Eigen::MatrixXd::Zero(m, m);
    for (int i = 0; i < contacts; ++i) {
      for (int j = 0; j < contacts; ++j) {
        const double near = std::exp(-0.5 * std::abs(i - j));
        for (int k = 0; k < 3; ++k) straight(3 * i + k, 3 * j + k) = k < 2 ? 3e-3 * near : 1e-3 * near + 1e-5;
      }
      const Eigen::Matrix3d r =
          Eigen::AngleAxisd(tilt(engine), Eigen::Vector3d(tilt(engine), 1, tilt(engine)).normalized()).matrix();
      for (int k = 0; k < 3; ++k) {
        const int row = k < 2 ? 2 * i + k : 2 * contacts + i;
        for (int l = 0; l < 3; ++l) turn(row, 3 * i + l) = r(k, l);
      }
    }
    w = turn * straight * turn.transpose();
    for (int i = 0; i < 2 * contacts; ++i) rows.push_back(bilateral_row(static_cast<std::uint64_t>(i), 1e-5));
    for (int i = 0; i < contacts; ++i) {
      rows.push_back(
          friction_row(1000u + static_cast<std::uint64_t>(i), 0.1, 0.2, {2 * i, 2 * i + 1}, viscosity, 1e-5));
    }
    delta = lambda = Eigen::VectorXd::Zero(m);
    anchors = Eigen::VectorXd::Zero(contacts);
  }

  /// Relative motions asked for in the k-th millisecond; sticking friction rows remember where they stick.
  void move(int k) {
    const double sway = 2e-3 * std::sin(3e-3 * k);
    const double depth = 10e-3 * std::sin(4e-3 * k);
    for (int i = 0; i < contacts; ++i) {
      delta[2 * i] = sway * (1 + 0.1 * i);
      delta[2 * i + 1] = 0.5 * sway;
      delta[2 * contacts + i] = depth - anchors[i];
    }
  }
  void remember(const BoundedSolver& solver) {
    for (int i = 0; i < contacts; ++i) anchors[i] += solver.motion()[2 * contacts + i];
  }
};

void solve(benchmark::State& state, bool warm, double viscosity) {
  static const double peak = peak_flops();
  Shaft shaft(static_cast<int>(state.range(0)) / 2, viscosity);
  BoundedSolver solver(kMaxRows);
  std::vector<double> times;
  times.reserve(1 << 20);
  double pivots = 0;
  double updates = 0;
  double residual = 0;
  int fallbacks = 0;
  int k = 0;
  for (auto _ : state) {
    shaft.move(k++);
    if (!warm) {
      solver.forget();
      shaft.lambda.setZero();
    }
    const auto start = Clock::now();
    const BoundedSolveReport report = solver.solve(shaft.rows, shaft.w, shaft.delta, shaft.lambda);
    const double seconds = std::chrono::duration<double>(Clock::now() - start).count();
    shaft.remember(solver);
    state.SetIterationTime(seconds);
    if (times.size() < times.capacity()) times.push_back(1e6 * seconds);
    pivots += report.pivots;
    updates += report.bound_updates;
    residual = std::max(residual, report.residual);
    fallbacks += report.fallback;
  }
  std::sort(times.begin(), times.end());
  const auto at = [&](double f) {
    return times[static_cast<std::size_t>(f * static_cast<double>(times.size() - 1))];
  };
  const double m = 3.0 * shaft.contacts;
  const double b = shaft.contacts;
  const double flops = (m * m * m - b * b * b) / 3;
  state.counters["median_us"] = at(0.5);
  state.counters["p99_us"] = at(0.99);
  state.counters["max_us"] = times.back();
  state.counters["pivots"] = pivots / k;
  state.counters["updates"] = updates / k;
  state.counters["fallbacks"] = fallbacks;
  state.counters["residual"] = residual;
  state.counters["Mflop"] = 1e-6 * flops;
  state.counters["of_peak"] = flops / (1e-6 * at(0.5)) / peak;
}

/// The elimination by itself: rows eliminated, rows left.
void eliminate(benchmark::State& state) {
  static const double peak = peak_flops();
  const int leading = static_cast<int>(state.range(0));
  const int trailing = static_cast<int>(state.range(1));
  const Shaft shaft((leading + trailing) / 3, 0);
  PanelLdl ldl(kMaxRows);
  std::vector<double> softening(kMaxRows);
  for (auto _ : state) {
    ldl.resize(leading, trailing);
    for (int j = 0; j < leading + trailing; ++j) {
      std::copy_n(shaft.w.col(j).data() + j, leading + trailing - j, ldl.column(j) + j);
    }
    benchmark::DoNotOptimize(ldl.factorise(softening.data()));
  }
  const double m = leading + trailing;
  const double flops = (m * m * m - static_cast<double>(trailing) * trailing * trailing) / 3;
  state.counters["of_peak"] = benchmark::Counter(flops / peak, benchmark::Counter::kIsIterationInvariantRate);
}

/// All rows bilateral, by the solver of the paper couplings: the yardstick.
void solve_all_bilateral(benchmark::State& state) {
  Shaft shaft(static_cast<int>(state.range(0)) / 2, 0);
  shaft.move(1);
  ConstraintSolver solver(kMaxRows);
  for (auto _ : state) benchmark::DoNotOptimize(solver.solve(shaft.w, 1e-5, shaft.delta, shaft.lambda));
}

void sizes(benchmark::internal::Benchmark* b) {
  b->ArgNames({"bilateral", "friction"})->Args({16, 8})->Args({64, 32})->Args({128, 64});
  b->Unit(benchmark::kMicrosecond);
}

BENCHMARK_CAPTURE(solve, warm, true, 0.0)->Apply(sizes)->UseManualTime();
BENCHMARK_CAPTURE(solve, cold, false, 0.0)->Apply(sizes)->UseManualTime();
BENCHMARK_CAPTURE(solve, warm_viscous, true, 50.0)->Apply(sizes)->UseManualTime();
BENCHMARK(eliminate)->Apply(sizes);
BENCHMARK(solve_all_bilateral)->Apply(sizes);

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  std::printf("built with: %s; fused multiply-adds in registers: %.1f Gflop/s\n", STYLET_FLAGS, 1e-9 * peak_flops());
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
