// Coupling `stylet` on the reference insertion where nothing resists: smooth, whatever mesh, spacing and rates.
#include "tests/physics/needle_track_runs.h"
#include "tools/reference/dense_algebra.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

namespace stylet::bench {
namespace {

using physics::Coupling;
using support::kSanitized;

struct Smoothness {
  double jump = 0, discontinuity = 0, roughness = 0, kink = 0;
};
Smoothness axial(const reference::ReferenceRun& settings, double simulation_hz) {
  reference::ReferenceInsertion insertion = r1();
  insertion.simulation_hz = simulation_hz;
  reference::ReferenceExperiment experiment(insertion, settings);
  while (experiment.time_s() < insertion.duration) experiment.advance();
  const auto& f = experiment.forces();
  Smoothness s{.jump = reference::jump(f, 0),
               .discontinuity = reference::discontinuity(f, 0),
               .roughness = reference::roughness(f, 0)};
  for (std::size_t k = 2; k < f.size(); ++k) {
    s.kink = std::max(s.kink, (f[k] - 2 * f[k - 1] + f[k - 2]).cwiseAbs().maxCoeff());
  }
  EXPECT_EQ(experiment.most_contacts(), kSanitized ? 6 : 8);
  EXPECT_EQ(experiment.needle_flags(), 0U);
  return s;
}

TEST(ReferenceInsertion, ADiscontinuityIsAStepWithoutTheSlopeItStandsOn) {
  std::vector<Eigen::Vector3d> forces;
  forces.reserve(100);
  const auto at = [](int k) { return 0.3 * k + 1e-4 * k * k; };  // a curve that no step stands out of by itself
  for (int k = 0; k < 100; ++k) forces.emplace_back(0, at(k), at(k) + (k > 40 ? 0.02 : 0.0));
  EXPECT_EQ(reference::discontinuity(forces, 0), 0);
  EXPECT_LT(reference::discontinuity(forces, 1), 1e-12);  // third differences of a parabola
  EXPECT_NEAR(reference::discontinuity(forces, 2), 0.02, 1e-12);
  EXPECT_GT(reference::jump(forces, 1), 0.3);
}

// The same coupling twice, but for what lies between the nodes. The slope of the force is the same in both, and the
// cubic shaft has little else.
TEST(NeedleTrack, CrossesBeamNodesWithoutAJumpOfTheAxialForce) {
  const Smoothness straight =
      axial({.coupling = Coupling::stylet, .track = {.straight_edges = true, .subgrid_compliance = false}}, 50);
  const Smoothness smooth = axial({.coupling = Coupling::stylet, .track = {.subgrid_compliance = false}}, 50);
  std::printf(
      "axial jump %.3f mN with straight edges, %.3f mN smooth; without slope %.4f and %.4f mN; "
      "roughness %.2e and %.2e N\n",
      1e3 * straight.jump, 1e3 * smooth.jump, 1e3 * straight.discontinuity, 1e3 * smooth.discontinuity,
      straight.roughness, smooth.roughness);
  EXPECT_LT(smooth.jump, 0.2e-3);
  EXPECT_LT(smooth.discontinuity, straight.discontinuity / 20);
  EXPECT_LT(smooth.roughness, straight.roughness / 20);
}

TEST(NeedleTrack, ASlowAndLateSimulationIsNotFelt) {
  const Smoothness s = axial({.coupling = Coupling::stylet, .latency_steps = 1}, 25);
  std::printf("largest second difference %.4f mN at 25 Hz, one step late\n", 1e3 * s.kink);
  EXPECT_LT(s.kink, 1e-3);
}

/// Largest over smallest eigenvalue of W + C of the last step.
double condition(const physics::HapticLoop& haptic) {
  const int rows = haptic.delassus().rows();
  Eigen::MatrixXd system = haptic.delassus().matrix();
  for (int r = 0; r < rows; ++r) system(r, r) += haptic.laws()[r].compliance;
  const Eigen::VectorXd eigenvalues = reference::symmetric_eigenvalues(system);
  return eigenvalues.maxCoeff() / eigenvalues.minCoeff();
}

// 78 mm of track every 1.25 mm are more points than there is room for: every second one makes room.
TEST(NeedleTrack, ContactsAtAnySpacingGiveTheSameForceAndAWellConditionedSystem) {
  double first = 0;
  for (const double spacing : kSanitized ? std::vector{0.005} : std::vector{0.010, 0.0025, 0.00125}) {
    reference::ReferenceInsertion insertion = r1();
    insertion.contact_spacing = spacing;
    reference::ReferenceExperiment experiment(insertion, {.coupling = Coupling::stylet});
    double worst = 1, peak = 0, kink = 0;
    for (int step = 0; experiment.time_s() < insertion.duration; ++step) {
      experiment.advance();
      if (experiment.haptic().delassus().rows() > 0) worst = std::max(worst, condition(experiment.haptic()));
    }
    const auto& f = experiment.forces();
    for (std::size_t k = 2; k < f.size(); ++k) {
      peak = std::max(peak, f[k].norm());
      kink = std::max(kink, (f[k] - 2 * f[k - 1] + f[k - 2]).cwiseAbs().maxCoeff());
    }
    std::printf("every %.2f mm: peak %.4f N, condition %.0f, largest second difference %.4f mN, %d contacts\n",
                1e3 * spacing, peak, worst, 1e3 * kink, experiment.most_contacts());
    EXPECT_LT(worst, 1e3);
    EXPECT_LT(kink, 0.2e-3);
    EXPECT_EQ(experiment.needle_flags(), 0U);
    if (first == 0) first = peak;
    EXPECT_NEAR(peak, first, 0.02 * first);
  }
}

TEST(NeedleTrack, DenseContactsWithoutAnyComplianceStayFiniteAndAreFlagged) {
  reference::ReferenceInsertion insertion = r1();
  insertion.contact_spacing = kSanitized ? 0.005 : 0.0025;
  reference::ReferenceExperiment experiment(insertion,
                                            {.coupling = Coupling::stylet, .track = {.subgrid_compliance = false}});
  double peak = 0;
  while (experiment.time_s() < insertion.duration) experiment.advance();
  for (const auto& force : experiment.forces()) {
    ASSERT_TRUE(force.allFinite());
    peak = std::max(peak, force.norm());
  }
  std::printf("peak %.4f N, flags %u\n", peak, experiment.needle_flags());
  EXPECT_LT(peak, 1);  // 0.84 N with contacts every 10 mm
  EXPECT_EQ(experiment.needle_flags(), physics::kNeedleRowsDependent);
}

TEST(NeedleTrack, PeakForceDoesNotDependOnTheMesh) {
  std::vector<double> peaks;
  for (const int nodes : kSanitized ? std::vector{7, 10} : std::vector{7, 10, 12, 14}) {
    reference::ReferenceInsertion insertion = r1();
    insertion.nodes_per_edge = nodes;
    reference::ReferenceExperiment experiment(insertion, {.coupling = Coupling::stylet});
    double peak = 0;
    while (experiment.time_s() < insertion.duration) experiment.advance();
    for (const auto& f : experiment.forces()) peak = std::max(peak, f.norm());
    peaks.push_back(peak);
    std::printf("%d nodes an edge: peak %.4f N\n", nodes, peak);
  }
  const auto [low, high] = std::minmax_element(peaks.begin(), peaks.end());
  double mean = 0;
  for (const double peak : peaks) mean += peak / static_cast<double>(peaks.size());
  EXPECT_LT((*high - *low) / mean, 0.03);
}

// What a patch lacks the haptic loop keeps as it was: nothing is felt of a patch that came too late. Lacked for
// longer it is let go of, for tissue moves; and it is not withdrawn from: the needle is in it still.
TEST(NeedleTrack, ATrackMissingFromPatchesIsKeptForSomeAndResumed) {
  const reference::ReferenceInsertion insertion = r1();
  reference::ReferenceExperiment experiment(insertion, {.coupling = Coupling::stylet});
  while (experiment.time_s() < 1.1) experiment.advance();
  const int contacts = experiment.needle().contact_count;
  const double force = experiment.needle().wrench.force.norm();
  ASSERT_GT(contacts, 3);
  const physics::TissuePatch patch = experiment.patch();
  physics::TissuePatch empty = patch;
  for (physics::BodyPatch& body : empty.bodies) body.tet_count = body.node_count = body.contact_count = 0;
  physics::HapticLoop& haptic = experiment.haptic();
  const physics::StylusPose base = insertion.base(experiment.time_s());
  const double dt = 1 / insertion.haptic_hz;
  for (int i = 0; i < 10; ++i) haptic.step(base, dt, patch);  // the hand rests
  const double resting = haptic.state().wrench.force.norm();
  Eigen::Vector3d on_nodes = Eigen::Vector3d::Zero();
  for (int i = 0; i < haptic.state().force_count; ++i) on_nodes += haptic.state().forces[i].force;
  for (int lacking = 1; lacking <= 10; ++lacking) {
    empty.epoch = patch.epoch + static_cast<std::uint64_t>(lacking);
    for (int i = 0; i < 5; ++i) haptic.step(base, dt, empty);
    ASSERT_EQ(haptic.state().contact_count, contacts);
    ASSERT_NEAR(haptic.state().wrench.force.norm(), resting, 1e-6 * resting);
    ASSERT_NE(haptic.state().flags & physics::kNeedlePatchLeft, 0U);
  }
  Eigen::Vector3d on_nodes_kept = Eigen::Vector3d::Zero();
  for (int i = 0; i < haptic.state().force_count; ++i) on_nodes_kept += haptic.state().forces[i].force;
  EXPECT_LT((on_nodes_kept - on_nodes).norm(), 1e-6 * on_nodes.norm()) << "the simulation still gets it";
  ++empty.epoch;
  for (int i = 0; i < 20; ++i) haptic.step(base, dt, empty);
  EXPECT_EQ(haptic.state().contact_count, 0);
  EXPECT_LT(haptic.state().wrench.force.norm(), 1e-3 * force) << "nothing holds the needle";
  physics::TissuePatch again = patch;
  again.epoch = empty.epoch + 1;
  for (int i = 0; i < 20; ++i) haptic.step(base, dt, again);
  std::printf("%d contacts and %.4f N; after the gap %d and %.4f N\n", contacts, force, haptic.state().contact_count,
              haptic.state().wrench.force.norm());
  EXPECT_EQ(haptic.state().contact_count, contacts);
  EXPECT_EQ(haptic.state().tip, physics::TipState::inside);
  EXPECT_NEAR(haptic.state().wrench.force.norm(), force, 0.01 * force);
}

}  // namespace
}  // namespace stylet::bench
