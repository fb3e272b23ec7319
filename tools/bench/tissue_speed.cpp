// How long a simulation step and a factorisation take, beside the way before: all of L in double, by one thread.
#include "physics/loops/simulation_loop.h"
#include "physics/messages/messages.h"
#include "physics/tissue/blas.h"
#include "physics/tissue/companion.h"
#include "physics/tissue/factorisation.h"
#include "physics/tissue/stiffness.h"
#include "tools/bench/samples.h"
#include "tools/bench/tissue_parts.h"
#include "tools/reference/kuhn_box.h"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace stylet::bench {
namespace {

using Eigen::Vector3d;
using physics::PassPrecision;

constexpr double kPeriod = 0.02;  // s
constexpr std::size_t kNever = std::numeric_limits<std::size_t>::max();

/// The cube of R1.
physics::SimulationBody cube(int nodes_per_edge) {
  physics::SimulationBody body;
  const int cells = nodes_per_edge - 1;
  body.mesh = reference::kuhn_box(Vector3d::Zero(), Vector3d::Constant(0.1), {cells, cells, cells});
  body.tet_materials.assign(body.mesh.tets.size(), {10e3, 0.45});
  body.fixed_nodes = reference::nodes_where(body.mesh, [](const Vector3d& x) { return x.z() < 1e-9; });
  return body;
}

/// A stiff straight needle whose tip is at `tip_x`, pressing a little on all isolated nodes.
physics::NeedleState needle_to(double tip_x, const physics::TissuePatch& patch) {
  physics::NeedleState needle;
  needle.node_count = 9;
  for (int i = 0; i < 9; ++i) {
    needle.positions.col(i) = Vector3d(tip_x - 0.25 + 0.03125 * i, 0.047, 0.053);
    needle.orientations[i] = Eigen::Quaterniond::FromTwoVectors(Vector3d::UnitZ(), Vector3d::UnitX());
  }
  for (int i = 0; i < patch.bodies[0].node_count; ++i) {
    needle.forces[needle.force_count++] = {.body = 0, .node = patch.bodies[0].node_ids[i], .force = {0, 0.02, 0.01}};
  }
  return needle;
}

/// The contacts of R1: a needle laid into the cube, then to and fro at 45 mm/s.
class Insertion {
public:
  Insertion(int nodes_per_edge, PassPrecision coarsest, bool two_threads)
      : loop_(bodies(nodes_per_edge), {.dt = kPeriod, .two_threads = two_threads, .coarsest = coarsest}),
        patch_(loop_.make_patch()),
        needle_(needle_to(tip_, patch_)) {
    while (tip_ < kEnd) {
      step();
      needle_ = needle_to(tip_ += 0.0025, patch_);
    }
  }

  void step() { loop_.step({.needle = &needle_}, patch_); }
  void move() {
    if (tip_ > kEnd || tip_ < kEnd - 0.0024) direction_ = tip_ > kEnd ? -1 : 1;
    needle_ = needle_to(tip_ += direction_ * 0.0009, patch_);
  }
  /// As the needle is, until nothing moves. The worker rests.
  const Eigen::Matrix3Xd& rested() {
    for (int i = 0; i < 40; ++i) step();
    return loop_.tissue().positions[0];
  }
  physics::SimulationLoop& loop() { return loop_; }

private:
  static constexpr double kEnd = 0.0715;  // m
  static std::vector<physics::SimulationBody> bodies(int nodes_per_edge) {
    std::vector<physics::SimulationBody> result;
    result.push_back(cube(nodes_per_edge));
    return result;
  }
  physics::SimulationLoop loop_;
  physics::TissuePatch patch_;
  double tip_ = -0.002;
  double direction_ = -1;
  physics::NeedleState needle_;
};

/// Steps at 50 Hz beside a worker that never rests.
Samples time_steps(Insertion& insertion, int count) {
  Samples samples(static_cast<std::size_t>(count));
  const std::jthread worker([&loop = insertion.loop()](const std::stop_token& stop) {
    physics::disable_openmp_teams();
    while (!stop.stop_requested()) {
      if (!loop.worker().step()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
    }
  });
  Clock::time_point next = Clock::now();
  for (int i = 0; i < count; ++i) {
    samples.time([&] { insertion.step(); });
    insertion.move();
    next = std::max(next + std::chrono::milliseconds(20), Clock::now());
    std::this_thread::sleep_until(next);
  }
  return samples;
}

/// What `threads` read from memory at once, bytes/s.
double streamed(int threads) {
  const Eigen::VectorXf numbers = Eigen::VectorXf::Ones(std::int64_t{1} << 26);
  physics::Companion companion(threads > 1);
  constexpr int kParts = 8;
  const Eigen::Index length = numbers.size() / kParts;
  std::array<float, kParts> sums{};
  Samples samples;
  for (int i = 0; i < 8; ++i) {
    samples.time([&] {
      companion.run(kParts, [&](int part) { sums[part] += numbers.segment(part * length, length).sum(); });
    });
  }
  return sums[0] > 0 ? 4 * static_cast<double>(numbers.size()) / (1e-6 * samples.median()) : 0;
}

/// One factor of the cube with 60 nodes of it last.
struct Factor {
  Factor(const physics::TissueModel& model, const physics::StiffnessPattern& pattern, std::size_t own_from,
         PassPrecision coarsest, bool two_threads)
      : companion(two_threads), factorisation(pattern, workspace) {
    workspace.companion = &companion;
    factorisation.make_own_from(own_from);
    factorisation.limit_precision(coarsest);
    std::vector<int> trailing;
    for (int dof = model.dof_count() / 2; dof < model.dof_count() / 2 + 180; ++dof) trailing.push_back(dof);
    factorisation.order_last(trailing, pattern, workspace);
  }
  Samples time(const physics::StiffnessPattern& pattern, std::span<const double> values, int count) {
    Samples samples;
    for (int i = 0; i < count; ++i) samples.time([&] { factorisation.factorise(pattern, values, workspace); });
    return samples;
  }
  Eigen::MatrixXd compliance() const {
    const auto size = static_cast<Eigen::Index>(factorisation.trailing().size());
    Eigen::MatrixXd result(size, size);
    factorisation.trailing_compliance(result);
    return result;
  }
  /// Both passes of one right-hand side.
  Samples time_passes(int dofs) {
    Eigen::VectorXd x = Eigen::VectorXd::LinSpaced(dofs, -1, 1);
    Samples samples;
    for (int i = 0; i < 30; ++i) samples.time([&] { factorisation.solve_nearly(x, x, workspace); });
    return samples;
  }

  physics::Companion companion;
  physics::SolveWorkspace workspace;
  physics::Factorisation factorisation;
};

struct Target {
  double step_ms = 0;
  double factorisation_ms = 0;
};

void time_factor(const std::string& name, const physics::TissueModel& model, bool quick, double bound_ms,
                 double stream, Report& report) {
  const physics::StiffnessPattern pattern(model);
  std::vector<double> values(pattern.nonzeros());
  pattern.assemble(model, std::vector<Eigen::Quaterniond>(model.point_count(), Eigen::Quaterniond::Identity()), 1,
                   values);
  const std::size_t own_from = quick ? 0 : 1 << 20;  // the small ones, too
  Factor now(model, pattern, own_from, PassPrecision::twelve_bits, true);
  Factor before(model, pattern, kNever, PassPrecision::full, false);
  const int count = quick ? 2 : 5;
  const Samples now_us = now.time(pattern, values, count);
  const Samples before_us = before.time(pattern, values, count);
  report.add(
      noted(at_most(name + ".factorisation", 1e-3 * now_us.median(), "ms", bound_ms, 1e-3 * before_us.median()),
            "two threads, with L read into few bits; reference: CHOLMOD in the same run, one thread"));
  const double flops = now.factorisation.flops();
  report.add({.name = name + ".factorisation.rate", .value = 1e-3 * flops / now_us.median(), .unit = "GFlop/s"});
  report.add(
      {.name = name + ".factorisation.before.rate", .value = 1e-3 * flops / before_us.median(), .unit = "GFlop/s"});
  const Eigen::MatrixXd w_bar = before.compliance();
  report.add(at_most(name + ".w_bar.error", (now.compliance() - w_bar).norm() / w_bar.norm(), "1", 1e-12));

  const Samples passes = now.time_passes(model.dof_count());
  const double bytes = static_cast<double>(now.factorisation.compact().bytes());
  report.add({.name = name + ".passes.median",
              .value = 1e-3 * passes.median(),
              .unit = "ms",
              .reference = 1e-3 * before.time_passes(model.dof_count()).median(),
              .note = "of one right-hand side; reference: L in double, one thread"});
  report.add({.name = name + ".passes.bandwidth",
              .value = 2e-3 * bytes / passes.median(),
              .unit = "GB/s",
              .reference = 1e-9 * stream,
              .note = "reference: what two threads stream; more comes from the cache"});
  report.add({.name = name + ".factor.memory",
              .value = 8e-6 * static_cast<double>(now.factorisation.factor_nonzeros()),
              .unit = "MB",
              .note = "L in double: of a factor, of which the worker and the steps hold three"});
  report.add({.name = name + ".passes.memory",
              .value = 1e-6 * bytes,
              .unit = "MB",
              .reference = 8e-6 * static_cast<double>(now.factorisation.factor_nonzeros()),
              .note = "what a pass reads"});
}

void time_mesh(int nodes_per_edge, bool quick, const Target& target, double stream, Report& report) {
  const std::string name = fmt::format("speed.{}_nodes", nodes_per_edge * nodes_per_edge * nodes_per_edge);
  const int steps = quick ? 20 : 200;
  {
    Insertion now(nodes_per_edge, PassPrecision::twelve_bits, true);
    Insertion before(nodes_per_edge, PassPrecision::full, false);
    const Eigen::Matrix3Xd rest = physics::rest_positions(before.loop().model(0));
    const Eigen::Matrix3Xd at_rest = before.rested();
    report.add(noted(
        at_most(name + ".equilibrium.error", (now.rested() - at_rest).norm() / (at_rest - rest).norm(), "1", 1e-10),
        "of the displacement, against L in double"));
    const Samples now_us = time_steps(now, steps);
    const Samples before_us = time_steps(before, steps);
    report.add(
        noted(at_most(name + ".step.median", 1e-3 * now_us.median(), "ms", target.step_ms, 1e-3 * before_us.median()),
              "beside a worker that never rests; reference: L in double, one thread, in the same run"));
    report.add({.name = name + ".step.p99",
                .value = 1e-3 * now_us.p99(),
                .unit = "ms",
                .reference = 1e-3 * before_us.p99()});
    report.add(
        {.name = name + ".tetrahedra", .value = static_cast<double>(now.loop().model(0).tets.size()), .unit = "1"});
  }
  const physics::SimulationBody body = cube(nodes_per_edge);
  time_factor(name, physics::TissueModel(body.mesh, body.tet_materials, body.fixed_nodes), quick,
              target.factorisation_ms, stream, report);
}

}  // namespace

Report tissue_speed(const BenchOptions& options) {
  Report report;
  const double one = streamed(1);
  const double two = streamed(2);
  report.add({.name = "speed.stream.one_thread", .value = 1e-9 * one, .unit = "GB/s"});
  report.add({.name = "speed.stream.two_threads", .value = 1e-9 * two, .unit = "GB/s"});
  if (options.quick) {
    time_mesh(9, true, {.step_ms = 10, .factorisation_ms = 500}, two, report);
    return report;
  }
  time_mesh(18, false, {.step_ms = 2.5, .factorisation_ms = 150}, two, report);
  time_mesh(27, false, {.step_ms = 10, .factorisation_ms = 500}, two, report);
  return report;
}

}  // namespace stylet::bench
