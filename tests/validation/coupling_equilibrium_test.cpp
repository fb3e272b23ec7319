// Two rates, one equilibrium: with all their freezing and lagging, the two loops come to the rest of needle and
// tissue solved as one system, and stay there. Of coupling `stylet` that system has the cubic shaft; friction,
// cutting and sub-grid compliance are off there, because where friction holds depends on the way that led to rest:
// what can be asked with them on is that forces balance and that nothing drifts.
#include "tests/support/r1.h"
#include "tests/support/sanitized.h"
#include "tests/validation/coupling_monolithic.h"
#include "tests/validation/residual.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace stylet::validation {
namespace {

using physics::Coupling;
using physics::NeedleContact;
using physics::NeedleState;
using reference::ReferenceExperiment;
using reference::ReferenceInsertion;
using reference::ReferenceRun;
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

struct NamedRun {
  const char* name;
  ReferenceRun run;
};

/// Contacts laid by the haptic loop on the cubic shaft; nothing resists, nothing is softened.
ReferenceRun stylet_alone() {
  return {.coupling = Coupling::stylet, .track = {.subgrid_compliance = false}};
}

/// With all there is: liver and its capsule after Okamura et al. 2004, sub-grid compliance.
ReferenceRun stylet_with_friction() {
  auto map = std::make_shared<physics::TissueMap>();
  map->tissues[1] = {.puncture_force = 1.8, .cutting_force = 0.94, .cutting_viscosity = 2, .friction_per_length = 18};
  return {.coupling = Coupling::stylet, .tissues = std::move(map)};
}

const char* name_of(Coupling coupling) {
  switch (coupling) {
    case Coupling::paper_frozen:
      return "frozen";
    case Coupling::paper_updated:
      return "updated";
    case Coupling::paper_trajectory:
      return "trajectory";
    case Coupling::stylet:
      return "stylet";
  }
  return "?";
}

void comes_to_rest_in_equilibrium(int nodes_per_edge, const ReferenceRun& run) {
  const ReferenceInsertion insertion = r1(nodes_per_edge);
  ReferenceExperiment experiment(insertion, run);
  while (experiment.time_s() < insertion.duration + kRest) experiment.advance();
  EXPECT_EQ(experiment.needle_flags(), 0U);
  const Distance off =
      distance_from_equilibrium(insertion, insertion.base(insertion.duration), experiment.needle(),
                                experiment.simulation().tissue().positions[0],
                                run.coupling == Coupling::stylet ? ShaftCurve::cubic : ShaftCurve::straight);
  ASSERT_LT(off.newton, 1e-12);
  ASSERT_GT(off.newtons, 0.1);  // the needle is really bent
  const std::string name = std::string(name_of(run.coupling)) + ", " +
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

TEST(Coupling, StyletComesToRestInTheEquilibriumOfTheMonolithicSystem) {
  for (const int latency : {0, 1}) {
    ReferenceRun run = stylet_alone();
    run.latency_steps = latency;
    run.worker_period = 4;
    comes_to_rest_in_equilibrium(kNodesPerEdge, run);
  }
  for (const int nodes_per_edge : kOtherNodesPerEdge) comes_to_rest_in_equilibrium(nodes_per_edge, stylet_alone());
}

TEST(Coupling, EquilibriumIsReachedOnOtherMeshesToo) {
  for (const Coupling coupling : {Coupling::paper_updated, Coupling::paper_frozen}) {
    for (const int nodes_per_edge : kOtherNodesPerEdge) {
      comes_to_rest_in_equilibrium(nodes_per_edge, {.coupling = coupling, .worker_period = 4});
    }
  }
}

void balances_at_rest(const NamedRun& named) {
  const ReferenceInsertion insertion = r1();
  ReferenceExperiment experiment(insertion, named.run);
  while (experiment.time_s() < insertion.duration + kRest) experiment.advance();
  const NeedleState& needle = experiment.needle();

  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();  // about the hub
  for (int c = 0; c < needle.track_count; ++c) {     // in `stylet` with the tip's own
    const NeedleContact& contact = needle.contacts[c];
    force += contact.force;
    moment += (contact.position - needle.positions.col(0)).cross(contact.force);
  }
  Eigen::Vector3d on_nodes = Eigen::Vector3d::Zero();
  for (int f = 0; f < needle.force_count; ++f) on_nodes += needle.forces[f].force;
  const std::string name = named.name;
  const double size = needle.wrench.force.norm();
  ASSERT_GT(size, 0.1);
  report_residual(name + ": hand + forces on the tissue, by node", (needle.wrench.force + on_nodes).norm() / size,
                  1e-9);
  report_residual(name + ": hand + contacts: force", (needle.wrench.force + force).norm() / size, 1e-9);
  report_residual(name + ": tissue: internal force - needle's",
                  experiment.report().residual_n / experiment.report().force_n, 1e-9);
  if (named.run.coupling == Coupling::stylet && named.run.track.subgrid_compliance) {
    return;  // a tissue point is then off the shaft, where its force acts, by what the tissue between gives way
  }
  report_residual(name + ": hand + contacts: moment",
                  (needle.wrench.moment + moment).norm() / needle.wrench.moment.norm(), 1e-7);
}

TEST(Coupling, HandContactsAndTissueBalanceAtRest) {
  balances_at_rest({"updated", {}});
  balances_at_rest({"stylet", stylet_alone()});
  ReferenceRun on_the_shaft = stylet_with_friction();
  on_the_shaft.track.subgrid_compliance = false;
  balances_at_rest({"stylet with friction", on_the_shaft});
  balances_at_rest({"stylet with friction and sub-grid compliance", stylet_with_friction()});
}

void does_not_drift(const NamedRun& named) {
  const ReferenceInsertion insertion = r1(5);
  ReferenceRun run = named.run;
  run.worker_period = 2;
  ReferenceExperiment experiment(insertion, run);
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
  const std::string name = named.name;
  EXPECT_EQ(experiment.report().step - first, std::uint64_t(steps));
  EXPECT_GE(factorisations, steps / 2 - 1);
  std::printf("  %d haptic steps, %d factorisations swapped in\n",
              steps * insertion.haptic_steps_per_simulation_step(), factorisations);
  report_residual(name + ": force off where it was, at most", furthest / force.norm(), 1e-9);
  report_residual(name + ": tissue off where it was, m",
                  (experiment.simulation().tissue().positions[0] - tissue).norm(), 1e-10);
  report_residual(name + ": needle off where it was, m",
                  (experiment.needle().positions.leftCols(needle.cols()) - needle).norm(), 1e-10);
}

TEST(Coupling, RestingStylusDoesNotDriftOverManyStepsAndFactorisations) {
  does_not_drift({"updated", {}});
}

TEST(Coupling, RestingStyletDoesNotDriftOverManyStepsAndFactorisations) {
  does_not_drift({"stylet", stylet_alone()});
  does_not_drift({"stylet with friction", stylet_with_friction()});
}

}  // namespace
}  // namespace stylet::validation
