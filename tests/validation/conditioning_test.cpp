// Contacts denser than the mesh and the beams can tell apart: seen, softened, and felt no worse than a few sparse
// ones.
#include "physics/contact/delassus.h"
#include "physics/contact/shaft.h"
#include "tests/support/r1.h"
#include "tests/support/sanitized.h"
#include "tests/validation/residual.h"
#include "tools/reference/dense_algebra.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

namespace stylet::validation {
namespace {

using physics::Coupling;
using reference::ReferenceExperiment;
using reference::ReferenceInsertion;
using reference::ReferenceRun;
using support::kSanitized;

ReferenceInsertion r1(double contact_spacing) {
  ReferenceInsertion insertion = support::r1();
  insertion.contact_spacing = contact_spacing;
  if (kSanitized) {
    insertion.duration = 0.9;  // five rows of contacts deep
    insertion.haptic_hz = 250;
  }
  return insertion;
}

/// W at the state the loops are in: the needle's part by whole solves, one a row, so that its symmetry is earned.
Eigen::MatrixXd delassus_at(const ReferenceExperiment& experiment, physics::TissuePoints& points) {
  const physics::NeedleState& state = experiment.needle();
  physics::Needle needle(experiment.insertion().needle, {});
  physics::NeedleShape shape;
  shape.node_count = state.node_count;
  shape.positions.leftCols(state.node_count) = state.positions.leftCols(state.node_count);
  std::copy_n(state.orientations.begin(), state.node_count, shape.orientations.begin());
  EXPECT_TRUE(needle.linearise(shape, experiment.insertion().base(experiment.time_s()), 1e-3));

  points.load(experiment.patch_in_use());
  const Eigen::Index rows = 2 * state.contact_count;
  Eigen::MatrixXd h_n = Eigen::MatrixXd::Zero(rows, 6 * state.node_count);
  Eigen::MatrixXd h_v = Eigen::MatrixXd::Zero(rows, 3 * points.count());
  for (Eigen::Index c = 0; c < state.contact_count; ++c) {
    const physics::NeedleContact& contact = state.contacts[c];
    int point = 0;
    while (points.contact(point).id != contact.id) ++point;
    const Eigen::Vector3d edge = (shape.positions.col(contact.beam + 1) - shape.positions.col(contact.beam));
    const Eigen::Matrix<double, 2, 3> n =
        physics::lateral_directions(edge.normalized(), shape.orientation(contact.beam)).transpose();
    h_v.block<2, 3>(2 * c, 3 * point) = -n;
    h_n.block<2, 3>(2 * c, 6 * contact.beam) = (1 - contact.beam_fraction) * n;
    h_n.block<2, 3>(2 * c, 6 * contact.beam + 6) = contact.beam_fraction * n;
  }
  Eigen::MatrixXd compliance(3 * points.count(), 3 * points.count());
  for (int i = 0; i < points.count(); ++i) {
    for (int j = 0; j < points.count(); ++j) compliance.block<3, 3>(3 * i, 3 * j) = points.compliance(i, j);
  }
  Eigen::MatrixXd w = reference::product(h_v, reference::product(compliance, h_v.transpose()));
  Eigen::VectorXd free(h_n.cols());
  Eigen::VectorXd moved(h_n.cols());
  needle.solve(Eigen::VectorXd::Zero(h_n.cols()), free);
  for (Eigen::Index r = 0; r < rows; ++r) {
    needle.solve(h_n.row(r).transpose(), moved);
    w.col(r) += h_n * (moved - free);
  }
  return w;
}

TEST(Conditioning, DelassusOperatorIsSymmetricPositiveDefiniteAllAlongTheReferenceInsertion) {
  for (const Coupling coupling : {Coupling::paper_updated, Coupling::paper_frozen}) {
    ReferenceExperiment experiment(r1(0.010), {.coupling = coupling});
    physics::TissuePoints points;
    double asymmetry = 0;
    double smallest = 1;
    int checked = 0;
    while (experiment.time_s() < experiment.insertion().duration) {
      experiment.advance();
      if (experiment.needle().contact_count == 0) continue;
      const Eigen::MatrixXd w = delassus_at(experiment, points);
      asymmetry = std::max(asymmetry, (w - w.transpose()).norm() / w.norm());
      const Eigen::MatrixXd symmetric = 0.5 * (w + w.transpose());
      const Eigen::VectorXd eigenvalues = reference::symmetric_eigenvalues(symmetric);
      smallest = std::min(smallest, eigenvalues[0] / eigenvalues[eigenvalues.size() - 1]);
      ++checked;
    }
    EXPECT_GT(checked, experiment.insertion().duration * experiment.insertion().simulation_hz - 10);
    std::printf("  %s, %d steps: largest condition number %.1e\n",
                coupling == Coupling::paper_frozen ? "frozen" : "updated", checked, 1 / smallest);
    report_residual("asymmetry of W", asymmetry, 1e-10);
    EXPECT_GT(smallest, 1e-6);
  }
}

struct Felt {
  double peak = 0;     ///< largest force on the hand, N
  double jump = 0;     ///< largest change from one haptic step to the next, N
  double contact = 0;  ///< largest force of one contact, N
  std::uint32_t needle_flags = 0;
  std::uint32_t simulation_flags = 0;
  int dependent_steps = 0;  ///< simulation steps after which the flag was up
};

Felt feel(double spacing, const ReferenceRun& run) {
  ReferenceExperiment experiment(r1(spacing), run);
  Felt felt;
  while (experiment.time_s() < experiment.insertion().duration) {
    experiment.advance();
    felt.simulation_flags |= experiment.report().flags;
    felt.dependent_steps += (experiment.needle().flags & physics::kNeedleRowsDependent) != 0;
    for (int c = 0; c < experiment.needle().contact_count; ++c) {
      felt.contact = std::max(felt.contact, experiment.needle().contacts[c].force.norm());
    }
    EXPECT_TRUE(experiment.simulation().tissue().positions[0].allFinite());
  }
  felt.needle_flags = experiment.needle_flags();
  const auto& forces = experiment.forces();
  for (std::size_t k = 0; k < forces.size(); ++k) {
    if (!forces[k].allFinite()) {
      ADD_FAILURE() << "force is not finite at haptic step " << k;
      break;
    }
    felt.peak = std::max(felt.peak, forces[k].norm());
    if (k > 0) felt.jump = std::max(felt.jump, (forces[k] - forces[k - 1]).norm());
  }
  std::printf(
      "  %s, c %.0e, spacing %5.2f mm: peak %.3f N, jump %.2f mN/ms, one contact at most %.2f N, dependent "
      "after %d steps\n",
      run.coupling == Coupling::paper_frozen ? "frozen " : "updated", run.relative_compliance, 1e3 * spacing,
      felt.peak, 1e3 * felt.jump, felt.contact, felt.dependent_steps);
  return felt;
}

const std::vector<double> kDenseSpacings =  // m
    kSanitized ? std::vector{0.0025} : std::vector{0.005, 0.0025, 0.00125};

/// At 10 mm nothing is wrong on the 343-node cube. Denser contacts lock the tissue a little more, and with straight
/// edges each crossing of a beam node is felt (5 to 11 mN): bounded at 1.1 times the force and 15 mN a step, where
/// rows left to rounding give newtons.
void denser_is_felt_no_worse(const ReferenceRun& run) {
  const Felt sparse = feel(0.010, run);
  EXPECT_EQ(sparse.needle_flags, 0U);
  const std::string coupling = run.coupling == Coupling::paper_frozen ? "frozen, " : "updated, ";
  for (const double spacing : kDenseSpacings) {
    const Felt dense = feel(spacing, run);
    EXPECT_EQ(dense.needle_flags, physics::kNeedleRowsDependent);
    EXPECT_GT(dense.dependent_steps, 20);
    EXPECT_EQ(dense.simulation_flags, 0U);
    const std::string name = coupling + std::to_string(int(1e6 * spacing)) + " um: ";
    report_residual(name + "peak over that at 10 mm", dense.peak / sparse.peak, 1.1);
    report_residual(name + "jump, N/ms", dense.jump, 0.015);
  }
}

TEST(Conditioning, UpdatedDenseContactsAreSeenAndBoundedBySoftRows) {
  denser_is_felt_no_worse({.coupling = Coupling::paper_updated, .relative_compliance = 1e-3});
}

TEST(Conditioning, FrozenDenseContactsAreSeenAndBoundedBySoftRows) {
  denser_is_felt_no_worse({.coupling = Coupling::paper_frozen, .relative_compliance = 1e-3});
}

TEST(Conditioning, UpdatedDenseContactsOfTheExactSystemAreSeenAndSoftened) {
  denser_is_felt_no_worse({.coupling = Coupling::paper_updated, .relative_compliance = 0});
}

TEST(Conditioning, FrozenDenseContactsOfTheExactSystemAreSeenAndSoftened) {
  denser_is_felt_no_worse({.coupling = Coupling::paper_frozen, .relative_compliance = 0});
}

}  // namespace
}  // namespace stylet::validation
