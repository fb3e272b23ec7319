// Two rates, one equilibrium: with all their freezing and lagging, the two loops come to the rest of needle and
// tissue solved as one system, and stay there.
#include "tests/support/r1.h"
#include "tests/support/sanitized.h"
#include "tests/validation/coupling_monolithic.h"
#include "tests/validation/residual.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <string>
#include <vector>

namespace stylet::validation {
namespace {

using bench::ReferenceExperiment;
using bench::ReferenceInsertion;
using bench::ReferenceRun;
using physics::Coupling;
using physics::NeedleContact;
using physics::NeedleState;
using support::kSanitized;

constexpr int kNodesPerEdge = kSanitized ? 4 : 7;  // of the cube, where a test has no mesh of its own
const std::vector<int> kOtherNodesPerEdge = kSanitized ? std::vector{5} : std::vector{5, 8};
constexpr double kRest = kSanitized ? 1 : 3;  // s, after the motion
constexpr int kHapticStepsWithoutDrift = kSanitized ? 1000 : 100000;

ReferenceInsertion r1(int nodes_per_edge = kNodesPerEdge) {
  ReferenceInsertion insertion = support::r1();
  insertion.nodes_per_edge = nodes_per_edge;
  if (kSanitized) insertion.haptic_hz = 250;  // the rest knows no rate
  // At least a tetrahedron's edge a contact, so that the exact rows are independent.
  insertion.contact_spacing = std::max(0.010, insertion.cube_edge / (nodes_per_edge - 1) * 0.6);
  return insertion;
}

void comes_to_rest_in_equilibrium(int nodes_per_edge, const ReferenceRun& run) {
  const ReferenceInsertion insertion = r1(nodes_per_edge);
  ReferenceExperiment experiment(insertion, run);
  while (experiment.time_s() < insertion.duration + kRest) experiment.advance();
  EXPECT_EQ(experiment.needle_flags(), 0U);
  const Distance off = distance_from_equilibrium(insertion, insertion.base(insertion.duration), experiment.needle(),
                                                 experiment.simulation().tissue().positions[0]);
  ASSERT_LT(off.newton, 1e-12);
  ASSERT_GT(off.newtons, 0.1);  // the needle is really bent
  const std::string name = std::string(run.coupling == Coupling::paper_frozen ? "frozen" : "updated") + ", " +
                           std::to_string(nodes_per_edge * nodes_per_edge * nodes_per_edge) + " nodes, latency " +
                           std::to_string(run.latency_steps);
  report_residual(name + ": needle off the equilibrium", off.needle, 1e-8);
  report_residual(name + ": tissue off the equilibrium", off.tissue, 1e-8);
  report_residual(name + ": felt against carried by the support", off.force, 1e-8);
}

TEST(Coupling, UpdatedComesToRestInTheEquilibriumOfTheMonolithicSystem) {
  for (const int latency : {0, 1}) {
    comes_to_rest_in_equilibrium(kNodesPerEdge, {.latency_steps = latency, .worker_period = 4});
  }
}

TEST(Coupling, FrozenComesToRestInTheEquilibriumOfTheMonolithicSystem) {
  for (const int latency : {0, 1}) {
    comes_to_rest_in_equilibrium(kNodesPerEdge,
                                 {.coupling = Coupling::paper_frozen, .latency_steps = latency, .worker_period = 4});
  }
}

TEST(Coupling, EquilibriumIsReachedOnOtherMeshesToo) {
  for (const Coupling coupling : {Coupling::paper_updated, Coupling::paper_frozen}) {
    for (const int nodes_per_edge : kOtherNodesPerEdge) {
      comes_to_rest_in_equilibrium(nodes_per_edge, {.coupling = coupling, .worker_period = 4});
    }
  }
}

TEST(Coupling, HandContactsAndTissueBalanceAtRest) {
  const ReferenceInsertion insertion = r1();
  ReferenceExperiment experiment(insertion, {.worker_period = 1});
  while (experiment.time_s() < insertion.duration + kRest) experiment.advance();
  const NeedleState& needle = experiment.needle();

  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();  // about the hub
  for (int c = 0; c < needle.contact_count; ++c) {
    const NeedleContact& contact = needle.contacts[std::size_t(c)];
    force += contact.force;
    moment += (contact.position - needle.positions.col(0)).cross(contact.force);
  }
  Eigen::Vector3d on_nodes = Eigen::Vector3d::Zero();
  for (int f = 0; f < needle.force_count; ++f) on_nodes += needle.forces[std::size_t(f)].force;
  const double size = needle.wrench.force.norm();
  ASSERT_GT(size, 0.1);
  report_residual("hand + forces on the tissue, by node", (needle.wrench.force + on_nodes).norm() / size, 1e-9);
  report_residual("hand + contacts: force", (needle.wrench.force + force).norm() / size, 1e-9);
  report_residual("hand + contacts: moment", (needle.wrench.moment + moment).norm() / needle.wrench.moment.norm(),
                  1e-7);
  report_residual("tissue: internal force - needle's", experiment.report().residual_n / experiment.report().force_n,
                  1e-9);
}

TEST(Coupling, RestingStylusDoesNotDriftOverManyStepsAndFactorisations) {
  const ReferenceInsertion insertion = r1(5);
  ReferenceExperiment experiment(insertion, {.worker_period = 2});
  while (experiment.time_s() < insertion.duration + kRest) experiment.advance();
  const Eigen::Vector3d force = experiment.needle().wrench.force;
  const Eigen::Matrix3Xd tissue = experiment.simulation().tissue().positions[0];
  const Eigen::MatrixXd needle = experiment.needle().positions.leftCols(experiment.needle().node_count);
  const std::uint64_t first = experiment.report().step;
  ASSERT_GT(force.norm(), 0.1);

  int factorisations = 0;
  double furthest = 0;
  const int steps = kHapticStepsWithoutDrift / insertion.haptic_steps_per_simulation_step();
  for (int i = 0; i < steps; ++i) {
    experiment.advance();
    factorisations += experiment.report().factorisation_taken;
    furthest = std::max(furthest, (experiment.needle().wrench.force - force).norm());
  }
  EXPECT_EQ(experiment.report().step - first, std::uint64_t(steps));
  EXPECT_GE(factorisations, steps / 2 - 1);
  std::printf("  %d haptic steps, %d factorisations swapped in\n",
              steps * insertion.haptic_steps_per_simulation_step(), factorisations);
  report_residual("force off where it was, at most", furthest / force.norm(), 1e-9);
  report_residual("tissue off where it was, m", (experiment.simulation().tissue().positions[0] - tissue).norm(),
                  1e-10);
  report_residual("needle off where it was, m",
                  (experiment.needle().positions.leftCols(needle.cols()) - needle).norm(), 1e-10);
}

}  // namespace
}  // namespace stylet::validation
