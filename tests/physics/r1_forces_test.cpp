// Reference insertion R1: what the hand feels, with directions and locations frozen between simulation steps
// (Peterlik 2011) and updated at every haptic step (the paper).
#include "tests/support/r1.h"
#include "tests/support/sanitized.h"
#include "tools/reference/reference_insertion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

namespace stylet::bench {
namespace {

using support::kSanitized;

constexpr int kContacts = kSanitized ? 6 : 8;

reference::ReferenceInsertion r1() {
  reference::ReferenceInsertion insertion = support::r1();
  if (kSanitized) insertion.duration = 1.2;  // past the way aside, before the first withdrawal
  return insertion;
}

struct Felt {
  double lateral_jump = 0;
  double lateral_roughness = 0;
  double axial_jump = 0;
  double peak = 0;
};

Felt feel(const reference::ReferenceInsertion& insertion, const reference::ReferenceRun& run) {
  reference::ReferenceExperiment experiment(insertion, run);
  while (experiment.time_s() < insertion.duration) {
    experiment.advance();
    EXPECT_EQ(experiment.report().flags, 0U);
    EXPECT_EQ(experiment.patch().flags, 0U);
  }
  EXPECT_EQ(experiment.most_contacts(), kContacts);
  EXPECT_EQ(experiment.needle_flags(), 0U);
  Felt felt;
  felt.lateral_jump = reference::jump(experiment.forces(), 1);
  felt.lateral_roughness = reference::roughness(experiment.forces(), 1);
  felt.axial_jump = reference::jump(experiment.forces(), 0);
  for (const auto& f : experiment.forces()) felt.peak = std::max(felt.peak, std::abs(f.y()));
  std::printf("  %s, latency %d: lateral jump %.3f mN/ms, roughness %.3e N, axial jump %.3f mN/ms, peak %.4f N\n",
              run.coupling == physics::Coupling::paper_frozen    ? "frozen"
              : run.coupling == physics::Coupling::paper_updated ? "updated"
                                                                 : "trajectory",
              run.latency_steps, 1e3 * felt.lateral_jump, felt.lateral_roughness, 1e3 * felt.axial_jump, felt.peak);
  return felt;
}

TEST(ReferenceInsertion, UpdatedDirectionsFeelSmootherThanFrozenOnes) {
  const Felt frozen = feel(r1(), {.coupling = physics::Coupling::paper_frozen});
  const Felt updated = feel(r1(), {.coupling = physics::Coupling::paper_updated});
  EXPECT_GT(updated.peak, 0.1);  // the needle is really bent
  EXPECT_LT(updated.lateral_jump, frozen.lateral_jump / 4);
  EXPECT_LT(updated.lateral_roughness, frozen.lateral_roughness / 4);
}

TEST(ReferenceInsertion, UpdatedDirectionsAreSmootherWithLatencyToo) {
  const Felt frozen = feel(r1(), {.coupling = physics::Coupling::paper_frozen, .latency_steps = 1});
  const Felt updated = feel(r1(), {.coupling = physics::Coupling::paper_updated, .latency_steps = 1});
  EXPECT_LT(updated.lateral_jump, frozen.lateral_jump);
  EXPECT_LT(updated.lateral_roughness, frozen.lateral_roughness / 2);
}

TEST(ReferenceInsertion, DirectionsOfTheTrajectoryFeelSmootherToo) {
  const Felt frozen = feel(r1(), {.coupling = physics::Coupling::paper_frozen});
  const Felt trajectory = feel(r1(), {.coupling = physics::Coupling::paper_trajectory});
  EXPECT_GT(trajectory.peak, 0.1);
  EXPECT_LT(trajectory.lateral_jump, frozen.lateral_jump / 4);
  EXPECT_LT(trajectory.lateral_roughness, frozen.lateral_roughness / 4);
}

/// Largest cosine between the directions of a haptic step and the line of the contact points (paper III-C), between
/// the neighbours of each, and the needle's edges: a needle bent by 10 mm, 8 contacts.
struct OffNormal {
  double trajectory = 0;
  double edges = 0;
};

OffNormal off_normal(physics::Coupling coupling) {
  reference::ReferenceExperiment experiment(r1(), {.coupling = coupling});
  while (experiment.time_s() < 1.2) experiment.advance();
  experiment.simulation_step();
  experiment.haptic_step();
  std::vector<Eigen::Vector3d> points;  // as the next step finds them: no new patch comes between
  const physics::NeedleState& needle = experiment.needle();
  for (int c = 0; c < needle.contact_count; ++c) points.push_back(needle.contacts[c].position);
  experiment.haptic_step();
  const Eigen::Matrix3Xd directions = experiment.haptic().directions();
  EXPECT_EQ(directions.cols(), 2 * static_cast<Eigen::Index>(points.size()));
  EXPECT_GE(points.size(), 3U);
  OffNormal off;
  for (std::size_t c = 0; c < points.size(); ++c) {
    const Eigen::Vector3d line = points[std::min(c + 1, points.size() - 1)] - points[c > 0 ? c - 1 : 0];
    const int beam = needle.contacts[c].beam;
    const Eigen::Vector3d edge = needle.positions.col(beam + 1) - needle.positions.col(beam);
    const auto cosine = [&](const Eigen::Vector3d& v) {
      return (v.normalized().transpose() * directions.middleCols<2>(2 * static_cast<Eigen::Index>(c)))
          .cwiseAbs()
          .maxCoeff();
    };
    off.trajectory = std::max(off.trajectory, cosine(line));
    off.edges = std::max(off.edges, cosine(edge));
  }
  return off;
}

TEST(ReferenceInsertion, DirectionsAreNormalToTheTrajectoryOrToTheEdges) {
  const OffNormal trajectory = off_normal(physics::Coupling::paper_trajectory);
  const OffNormal updated = off_normal(physics::Coupling::paper_updated);
  std::printf("  off the normal of the trajectory %.1e, of the edges %.1e; updated: %.1e and %.1e\n",
              trajectory.trajectory, trajectory.edges, updated.trajectory, updated.edges);
  EXPECT_LT(trajectory.trajectory, 1e-12);
  EXPECT_GT(trajectory.edges, 10 * updated.edges);
  EXPECT_LT(updated.edges, 1e-4) << "of the shape that the step began with";
  EXPECT_GT(updated.trajectory, 10 * updated.edges);
}

TEST(ReferenceInsertion, TwoRunsGiveTheSameBits) {
  reference::ReferenceInsertion insertion = r1();
  reference::ReferenceExperiment one(insertion, {.worker_period = 3});
  reference::ReferenceExperiment two(insertion, {.worker_period = 3});
  for (int step = 0; step < (kSanitized ? 30 : 60); ++step) {
    one.advance();
    two.advance();
  }
  ASSERT_EQ(one.forces().size(), two.forces().size());
  for (std::size_t k = 0; k < one.forces().size(); ++k) ASSERT_EQ(one.forces()[k], two.forces()[k]) << "step " << k;
  EXPECT_EQ(one.simulation().tissue().positions[0], two.simulation().tissue().positions[0]);
}

}  // namespace
}  // namespace stylet::bench
