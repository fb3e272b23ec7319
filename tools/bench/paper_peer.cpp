// The haptic problems of R1 solved as SOFA's LCPForceFeedback does (Peterlik et al. 2011): the constraint system of
// the simulation step stays as it is for all haptic steps until the next; only the violation follows the device, the
// needle moving rigidly with it; Gauss-Seidel, warm-started, to a tolerance. Beside it, in the same run: the direct
// solve of the same systems, and Stylet's whole step.
#include "physics/contact/constraint_solver.h"
#include "tools/bench/gauss_seidel.h"
#include "tools/bench/paper.h"
#include "tools/bench/samples.h"
#include "tools/reference/reference_insertion.h"

#include <Eigen/Core>

#include <array>
#include <string>
#include <vector>

namespace stylet::bench {

namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

/// What the simulation step froze: W, delta_free, the contacts' directions, where the hub was.
struct FrozenSystem {
  MatrixXd w;                   // [rows x rows], m/N
  VectorXd delta_free;          // [rows], m
  VectorXd lambda;              // [rows], N: the solution then
  Eigen::Matrix3Xd directions;  // [3 x rows]
  Vector3d hub = Vector3d::Zero();

  explicit FrozenSystem(const physics::HapticLoop& loop, const Vector3d& hub_position)
      : delta_free(loop.delta_free()), lambda(loop.lambda()), directions(loop.directions()), hub(hub_position) {
    w = MatrixXd(loop.delassus().matrix()).selfadjointView<Eigen::Lower>();
  }
  /// Violation when the hub, and the whole needle with it, has moved.
  VectorXd violation(const Vector3d& hub_now) const { return delta_free + directions.transpose() * (hub_now - hub); }
  /// Force of the tissue on the needle, N: what the hand feels.
  Vector3d force(const VectorXd& multipliers) const { return directions * multipliers; }
};

/// One tolerance of the peer.
struct Peer {
  std::string name;
  double tolerance = 0;
  VectorXd lambda;
  Samples time, sweeps, cold_sweeps, lambda_error, force_error;
  int capped = 0;
};

constexpr int kMostSweeps = 20000;

}  // namespace

Report paper_peer(const BenchOptions& options) {
  const reference::ReferenceInsertion insertion = reference::read_reference_insertion(options.reference_insertion);
  reference::ReferenceExperiment experiment(insertion, {});
  const double duration = options.quick ? 0.5 * insertion.duration : insertion.duration;
  const int every = options.quick ? 10 : 3;  // simulation steps: Gauss-Seidel is slow
  std::array<Peer, 2> peers;
  peers[0].name = "peer.gauss_seidel_1e-3";
  peers[0].tolerance = 1e-3;
  peers[1].name = "peer.gauss_seidel_1e-6";
  peers[1].tolerance = 1e-6;
  physics::ConstraintSolver direct(physics::kMaxRows);
  Samples direct_time, step_time, frozen_error;
  double largest_force = 0;

  for (int k = 0; experiment.time_s() < duration; ++k) {
    experiment.simulation_step();
    experiment.haptic_step();
    const int rows = static_cast<int>(experiment.haptic().delta_free().size());
    const bool compare = rows >= 12 && rows <= 16 && k % every == 0;
    const FrozenSystem frozen(experiment.haptic(), insertion.base(experiment.time_s()).position);
    for (Peer& peer : peers) peer.lambda = frozen.lambda;
    for (int i = 1; i < insertion.haptic_steps_per_simulation_step(); ++i) {
      const auto start = Clock::now();
      experiment.haptic_step();
      const auto ours = Clock::now() - start;
      if (!compare) continue;
      const VectorXd delta = frozen.violation(insertion.base(experiment.time_s()).position);
      VectorXd exact(rows);
      bool solved = false;
      const auto direct_start = Clock::now();
      solved = direct.solve(frozen.w, 0, delta, exact);
      const auto direct_end = Clock::now();
      if (!solved) continue;
      step_time.add(ours);
      direct_time.add(direct_end - direct_start);
      const Vector3d felt = experiment.needle().wrench.force;
      largest_force = std::max(largest_force, felt.norm());
      frozen_error.add((frozen.force(exact) - felt).norm());
      for (Peer& peer : peers) {
        const auto peer_start = Clock::now();
        const GaussSeidelResult result = gauss_seidel(frozen.w, delta, peer.tolerance, kMostSweeps, peer.lambda);
        peer.time.add(Clock::now() - peer_start);
        peer.sweeps.add(result.sweeps);
        if (!result.converged) ++peer.capped;
        VectorXd cold = VectorXd::Zero(rows);
        peer.cold_sweeps.add(gauss_seidel(frozen.w, delta, peer.tolerance, kMostSweeps, cold).sweeps);
        peer.lambda_error.add((peer.lambda - exact).norm() / exact.norm());
        peer.force_error.add((frozen.force(peer.lambda) - felt).norm());
      }
    }
  }

  Report report;
  report.add({"peer.problems", static_cast<double>(direct_time.count()), "1", {}, {}, {}});
  report.add({"peer.stylet.step.median", step_time.median(), "us", {}, {}, {}});
  report.add({"peer.stylet.step.p99", step_time.p99(), "us", {}, {}, {}});
  report.add({"peer.direct.solve.median", direct_time.median(), "us", {}, {}, {}});
  report.add({"peer.force.max", largest_force, "N", {}, {}, {}});
  // Error of freezing alone, however well solved: against the force of Stylet's step at the same time.
  report.add({"peer.frozen.force_error.median", frozen_error.median(), "N", {}, {}, {}});
  report.add({"peer.frozen.force_error.max", frozen_error.max(), "N", {}, {}, {}});
  for (const Peer& peer : peers) {
    report.add({peer.name + ".solve.median", peer.time.median(), "us", {}, {}, {}});
    report.add({peer.name + ".solve.p99", peer.time.p99(), "us", {}, {}, {}});
    report.add({peer.name + ".solve.over_direct", peer.time.median() / direct_time.median(), "1", {}, {}, {}});
    report.add({peer.name + ".sweeps.median", peer.sweeps.median(), "1", {}, {}, {}});
    report.add({peer.name + ".sweeps.max", peer.sweeps.max(), "1", {}, {}, {}});
    report.add({peer.name + ".cold_start.sweeps.median", peer.cold_sweeps.median(), "1", {}, {}, {}});
    report.add({peer.name + ".not_converged", static_cast<double>(peer.capped), "1", {}, {}, {}});
    report.add({peer.name + ".lambda_error.median", peer.lambda_error.median(), "1", {}, {}, {}});
    report.add({peer.name + ".lambda_error.max", peer.lambda_error.max(), "1", {}, {}, {}});
    report.add({peer.name + ".force_error.max", peer.force_error.max(), "N", {}, {}, {}});
  }
  return report;
}

}  // namespace stylet::bench
