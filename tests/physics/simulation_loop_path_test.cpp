// Contacts laid along the needle's path, and what the patch tells of them.
#include "physics/contact/insertion_path.h"
#include "physics/loops/simulation_loop.h"
#include "physics/needle/needle.h"
#include "tests/support/dense_tissue.h"
#include "tools/reference/dense_algebra.h"
#include "tools/reference/kuhn_box.h"

#include <gtest/gtest.h>
#include <Eigen/LU>

#include <cmath>
#include <cstdio>
#include <set>

namespace stylet::physics {
namespace {

SimulationBody box(const Eigen::Vector3d& low, const Eigen::Vector3d& high, const std::array<int, 3>& cells) {
  SimulationBody body;
  body.mesh = reference::kuhn_box(low, high, cells);
  body.tet_materials.assign(body.mesh.tets.size(), {10e3, 0.45});
  body.fixed_nodes =
      reference::nodes_where(body.mesh, [&](const Eigen::Vector3d& x) { return x.z() < low.z() + 1e-9; });
  return body;
}

/// A straight needle of four edges along +X that ends at `tip_x`; bent by `bow` in the middle.
NeedleState needle_to(double tip_x, double bow = 0) {
  NeedleState needle;
  needle.node_count = 5;
  for (int i = 0; i < 5; ++i) {
    needle.positions.col(i) = Eigen::Vector3d(tip_x - 0.15 + 0.0375 * i, 0.047 + bow * (i == 2), 0.053);
    needle.orientations[i] = orientation_along(Eigen::Vector3d::UnitX());
  }
  return needle;
}

struct Scene {
  explicit Scene(std::vector<SimulationBody> bodies, double spacing = 0.010)
      : loop(std::move(bodies), {.contact_spacing = spacing}), patch(loop.make_patch()) {}
  const BodyPatch& go_to(double tip_x, double bow = 0) {
    const NeedleState needle = needle_to(tip_x, bow);
    report = loop.step({.needle = &needle}, patch);
    return patch.bodies[0];
  }
  Eigen::Vector3d position(int body, const PatchContact& contact) const {
    return loop.model(body).topology.position(loop.tissue().positions[body], {contact.tet, contact.barycentric});
  }
  SimulationLoop loop;
  TissuePatch patch;
  SimulationReport report;
};

std::vector<SimulationBody> path_cube() {
  std::vector<SimulationBody> bodies;
  bodies.push_back(box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.1), {6, 6, 6}));
  return bodies;
}

TEST(InsertionPath, FirstContactIsAtTheEntryThenOneEverySpacing) {
  Scene scene(path_cube());
  EXPECT_EQ(scene.go_to(-0.001).contact_count, 0);
  int expected = 1;
  std::set<std::uint32_t> ids;
  for (double tip = 0.0005; tip < 0.095; tip += 0.0009) {
    const BodyPatch& body = scene.go_to(tip, 0.004);
    while (0.010 * expected <= tip * 1.02 && expected < body.contact_count) ++expected;
    ASSERT_EQ(body.contact_count, expected) << "tip at " << tip;
    const NeedleState needle = needle_to(tip, 0.004);
    for (int c = 0; c < body.contact_count; ++c) {
      const PatchContact& contact = body.contacts[c];
      if (!ids.insert(contact.id).second) continue;
      // At birth: exactly on the shaft.
      const Eigen::Vector3d on_shaft = needle.positions.col(contact.beam) * (1 - contact.beam_fraction) +
                                       needle.positions.col(contact.beam + 1) * contact.beam_fraction;
      EXPECT_LT((scene.position(0, contact) - on_shaft).norm(), 1e-15);
      if (c == 0) {
        EXPECT_NEAR(scene.position(0, contact).x(), 0, 1e-15);
      }
    }
    for (int c = 1; c < body.contact_count; ++c) {
      const double gap =
          (scene.position(0, body.contacts[c]) - scene.position(0, body.contacts[std::size_t(c) - 1])).norm();
      EXPECT_NEAR(gap, 0.010, 0.0006);  // along the shaft, which is bowed
    }
  }
  EXPECT_EQ(expected, 10);
  EXPECT_EQ(ids.size(), 10U);
}

TEST(InsertionPath, WithdrawalRemovesContactsPassedByTheTip) {
  Scene scene(path_cube());
  scene.go_to(0.0451);
  ASSERT_EQ(scene.patch.bodies[0].contact_count, 5);
  const std::uint32_t first = scene.patch.bodies[0].contacts[0].id;
  const std::uint32_t last = scene.patch.bodies[0].contacts[4].id;
  EXPECT_EQ(scene.go_to(0.0399).contact_count, 5);  // 0.1 mm past the last one: within the hysteresis
  EXPECT_EQ(scene.patch.bodies[0].contacts[4].id, last);
  EXPECT_EQ(scene.patch.bodies[0].contacts[4].beam_fraction, 1);
  EXPECT_EQ(scene.go_to(0.0397).contact_count, 4);
  EXPECT_EQ(scene.go_to(0.0402).contact_count, 5);  // laid again, a new one
  EXPECT_GT(scene.patch.bodies[0].contacts[4].id, last);
  EXPECT_EQ(scene.go_to(0.005).contact_count, 1);
  EXPECT_EQ(scene.patch.bodies[0].contacts[0].id, first);
  EXPECT_EQ(scene.go_to(-0.01).contact_count, 0);
  EXPECT_EQ(scene.patch.bodies[0].node_count, 0);
}

TEST(InsertionPath, PassesThroughOneBodyIntoTheNext) {
  std::vector<SimulationBody> bodies;
  bodies.push_back(box({0, 0, 0}, {0.025, 0.1, 0.1}, {3, 6, 6}));
  bodies.push_back(box({0.03, 0, 0}, {0.12, 0.1, 0.1}, {5, 6, 6}));
  Scene scene(std::move(bodies));
  scene.go_to(-0.002);
  scene.go_to(0.010);
  for (double tip = 0.011; tip < 0.0651; tip += 0.003) scene.go_to(tip);
  EXPECT_EQ(scene.patch.bodies[0].contact_count, 3);  // at 0, 10 and 20 mm
  EXPECT_EQ(scene.patch.bodies[1].contact_count, 4);  // at 30, 40, 50 and 60 mm
  EXPECT_NEAR(scene.position(1, scene.patch.bodies[1].contacts[0]).x(), 0.03, 1e-12);
  EXPECT_EQ(scene.report.contact_count, 7);
}

TEST(InsertionPath, DirectionsAreOrthogonalToTheShaft) {
  Scene scene(path_cube());
  const BodyPatch& body = scene.go_to(0.09, 0.005);
  const NeedleState needle = needle_to(0.09, 0.005);
  ASSERT_GT(body.contact_count, 6);
  for (int c = 0; c < body.contact_count; ++c) {
    const PatchContact& contact = body.contacts[c];
    const Eigen::Vector3d edge =
        (needle.positions.col(contact.beam + 1) - needle.positions.col(contact.beam)).normalized();
    EXPECT_LT((contact.directions.transpose() * edge).norm(), 1e-14);
    EXPECT_LT((contact.directions.transpose() * contact.directions - Eigen::Matrix2d::Identity()).norm(), 1e-14);
    // Continuous along the path: no flip from one contact to the next.
    if (c > 0) {
      EXPECT_GT((contact.directions.transpose() * body.contacts[std::size_t(c) - 1].directions).trace(), 1.9);
    }
  }
}

TEST(SimulationLoop, PatchHoldsTheComplianceOfTheDenseInverse) {
  Scene scene(path_cube());
  const SimulationBody body = path_cube()[0];
  const support::DenseTissue dense(body.mesh, body.tet_materials, body.fixed_nodes);
  const Eigen::MatrixXd inverse = reference::inverse(dense.free_stiffness(dense.rest()));
  double worst = 0;
  int computed = 0;
  for (double tip = 0.001; tip < 0.09; tip += 0.004) {
    const BodyPatch& patch = scene.go_to(tip);
    computed += scene.report.new_isolated_nodes;
    ASSERT_EQ(scene.report.factor_epoch, 0U);  // the worker never ran
    for (int a = 0; a < patch.node_count; ++a) {
      for (int b = 0; b < patch.node_count; ++b) {
        const int i = scene.loop.model(0).free_index[patch.node_ids[a]];
        const int j = scene.loop.model(0).free_index[patch.node_ids[b]];
        Eigen::Matrix3d exact = Eigen::Matrix3d::Zero();
        if (i >= 0 && j >= 0) exact = inverse.block<3, 3>(3 * i, 3 * j);
        worst = std::max(worst, (patch.w_bar(a, b) - exact).norm());
      }
    }
    for (int c = 0; c < patch.contact_count; ++c) {  // contacts name their nodes rightly
      const PatchContact& contact = patch.contacts[c];
      for (std::size_t k = 0; k < 4; ++k) {
        ASSERT_EQ(patch.node_ids[contact.patch_nodes[k]], body.mesh.tets[contact.tet][k]);
      }
    }
    std::set<int> tets(patch.tet_ids.begin(), patch.tet_ids.begin() + patch.tet_count);
    EXPECT_EQ(int(tets.size()), patch.tet_count);
    for (int c = 0; c < patch.contact_count; ++c) EXPECT_EQ(tets.count(patch.contacts[c].tet), 1U);
    for (int t = 0; t < patch.tet_count; ++t) {
      for (std::size_t k = 0; k < 4; ++k) {
        const int place = patch.tet_nodes[t][k];
        EXPECT_EQ(patch.node_ids[place], body.mesh.tets[patch.tet_ids[t]][k]);
      }
    }
  }
  std::printf("  W_bar off the dense inverse by %.1e of %.1e m/N; %d nodes computed, each once\n", worst,
              inverse.cwiseAbs().maxCoeff(), computed);
  EXPECT_LT(worst, 1e-12 * inverse.cwiseAbs().maxCoeff());
  EXPECT_EQ(computed, scene.report.isolated_nodes);
}

TEST(InsertionPath, ContactsBeyondCapacityAreMergedIntoTheLast) {
  Scene scene(path_cube(), 0.0005);
  scene.go_to(0.0402);
  EXPECT_EQ(scene.patch.flags, 0U);
  EXPECT_EQ(scene.patch.bodies[0].contact_count, 81);
  scene.go_to(0.06);
  EXPECT_EQ(scene.patch.flags, kPatchContactOverflow);
  const BodyPatch& body = scene.patch.bodies[0];
  EXPECT_EQ(body.contact_count, kMaxContacts);
  EXPECT_NEAR(scene.position(0, body.contacts[kMaxContacts - 1]).x(), 0.06, 0.0005);  // the last one is at the tip
  EXPECT_NEAR(scene.position(0, body.contacts[0]).x(), 0, 1e-12);
}

TEST(InsertionPath, NodesBeyondCapacityDropTheOldestContacts) {
  std::vector<SimulationBody> bodies;
  bodies.push_back(box({0, 0.046, 0.052}, {0.1, 0.048, 0.0545}, {280, 3, 2}));  // finer than the contacts are apart
  Scene scene(std::move(bodies), 0.0011);
  scene.go_to(0.05);
  EXPECT_EQ(scene.patch.flags, 0U);
  EXPECT_NEAR(scene.position(0, scene.patch.bodies[0].contacts[0]).x(), 0, 1e-12);
  scene.go_to(0.099);
  EXPECT_NE(scene.patch.flags & kPatchNodeOverflow, 0U);
  EXPECT_LE(scene.patch.bodies[0].node_count, kMaxPatchNodes);
  EXPECT_GT(scene.position(0, scene.patch.bodies[0].contacts[0]).x(), 0.005);
}

}  // namespace
}  // namespace stylet::physics
