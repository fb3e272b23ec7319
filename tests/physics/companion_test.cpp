// A second thread in the simulation step: the same bits with it and without.
#include "physics/tissue/companion.h"
#include "physics/loops/simulation_loop.h"
#include "physics/tissue/corotational.h"
#include "physics/tissue/factorisation.h"
#include "physics/tissue/refinement.h"
#include "tools/reference/kuhn_box.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <thread>
#include <utility>
#include <vector>

namespace stylet::physics {
namespace {

TEST(Companion, EachPartIsDoneOnce) {
  for (const bool thread : {false, true}) {
    Companion companion(thread);
    std::array<int, 8> done{};
    for (int loop = 0; loop < 3000; ++loop) {
      const int parts = loop % 9;
      companion.run(parts, [&](int part) { ++done[part]; });
      if (loop % 500 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(2));  // the helper is asleep then
    }
    for (int part = 0; part < 8; ++part) {
      int wanted = 0;
      for (int loop = 0; loop < 3000; ++loop) wanted += part < loop % 9;
      EXPECT_EQ(done[part], wanted);
    }
  }
}

TEST(Companion, TakesPartsWhereTheCallerIsBusy) {
  Companion companion;
  std::atomic<int> others{0};
  const std::thread::id caller = std::this_thread::get_id();
  // Part 0 ends when the other thread has done part 1: a companion that never wakes would wait here for ever.
  companion.run(2, [&](int part) {
    if (std::this_thread::get_id() != caller) {
      ++others;
      return;
    }
    if (part == 0) {
      while (others.load() == 0) std::this_thread::yield();
    }
  });
  EXPECT_GE(others.load(), 1);
}

SimulationBody cube(int cells) {
  SimulationBody body;
  body.mesh = reference::kuhn_box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.1), {cells, cells, cells});
  body.tet_materials.assign(body.mesh.tets.size(), {10e3, 0.45});
  body.fixed_nodes = reference::nodes_where(body.mesh, [](const Eigen::Vector3d& x) { return x.z() < 1e-9; });
  return body;
}

TEST(Companion, StepsHaveTheSameBitsWithOneThreadAndTwo) {
  const auto run = [](bool two_threads) {
    std::vector<SimulationBody> bodies;
    bodies.push_back(cube(19));  // large enough to be shared
    SimulationLoop loop(std::move(bodies), {.two_threads = two_threads});
    EXPECT_GT(loop.worker().latest().bodies[0].factor.compact().part_count(), 1);
    EXPECT_GT(loop.model(0).runs.size(), 1U);
    TissuePatch patch = loop.make_patch();
    std::vector<Eigen::Matrix3Xd> positions;
    for (int step = 0; step < 5; ++step) {
      NeedleState needle;
      needle.node_count = 3;
      for (int i = 0; i < 3; ++i)
        needle.positions.col(i) = Eigen::Vector3d(-0.18 + 0.006 * step + 0.1 * i, 0.047, 0.053);
      for (int i = 0; i < patch.bodies[0].node_count; ++i) {
        needle.forces[needle.force_count++] = {
            .body = 0, .node = patch.bodies[0].node_ids[i], .force = {0.01, 0.05 * step, 0.03}};
      }
      loop.step({.needle = &needle}, patch);
      if (step == 2) loop.worker().step();
      positions.push_back(loop.tissue().positions[0]);
    }
    return positions;
  };
  const auto alone = run(false);
  const auto together = run(true);
  EXPECT_GT((alone.back() - alone.front()).cwiseAbs().maxCoeff(), 1e-4);
  for (std::size_t i = 0; i < alone.size(); ++i) ASSERT_EQ(alone[i], together[i]) << "step " << i;
}

TEST(Companion, QuadraticElementsAreSharedToo) {
  SimulationBody body = cube(6);
  const TetMesh mesh = refined(body.mesh);
  const TissueModel model(mesh, std::vector<ElasticMaterial>(mesh.tets.size(), {10e3, 0.49}),
                          reference::nodes_where(mesh, [](const Eigen::Vector3d& x) { return x.z() < 1e-9; }), 0,
                          Element::quadratic);
  ASSERT_GT(model.runs.size(), 1U);
  Eigen::Matrix3Xd positions = rest_positions(model);
  for (int n = 0; n < model.node_count(); ++n) positions(0, n) += 6 * positions(2, n) * positions(2, n);
  const std::vector<Eigen::Quaterniond> rest(model.point_count(), Eigen::Quaterniond::Identity());
  std::vector<Eigen::Quaterniond> exact_rotations = rest;
  Eigen::Matrix3Xd exact(3, model.node_count());
  update_rotations(model, positions, exact_rotations);
  internal_forces(model, positions, exact_rotations, exact);
  Companion companion;
  std::array<Eigen::Matrix3Xd, 2> forces;
  for (const bool two : {false, true}) {
    ElementScratch scratch{.companion = two ? &companion : nullptr, .sums = {}};
    std::vector<Eigen::Quaterniond> rotations = rest;
    forces[two].resize(3, model.node_count());
    update_rotations_and_forces(model, positions, rotations, forces[two], {}, {}, scratch);
    for (std::size_t p = 0; p < rotations.size(); ++p) EXPECT_EQ(rotations[p].coeffs(), exact_rotations[p].coeffs());
  }
  EXPECT_LT((forces[0] - exact).cwiseAbs().maxCoeff(), 1e-13 * exact.cwiseAbs().maxCoeff());
  EXPECT_EQ(forces[0], forces[1]);
}

TEST(Companion, RotationsAndForcesInOnePassAreThoseOfTwo) {
  const SimulationBody body = cube(12);
  const TissueModel model(body.mesh, body.tet_materials, body.fixed_nodes);
  Eigen::Matrix3Xd positions = rest_positions(model);
  for (int n = 0; n < model.node_count(); ++n) {
    const Eigen::Vector3d x = positions.col(n);
    positions.col(n) += Eigen::Vector3d(6 * x.z() * x.z(), 0.3 * x.x() * x.z(), -0.5 * x.z() * x.x() / 0.1);
  }
  positions.col(model.node_count() / 2) += Eigen::Vector3d(0.02, 0, 0);  // some are squeezed, some inside out
  std::vector<double> rest_size(model.tets.size(), 1.0);
  for (std::size_t t = 100; t < 130; ++t) rest_size[t] = 0.8;
  const std::vector<Eigen::Quaterniond> rest(model.tets.size(), Eigen::Quaterniond::Identity());
  for (const bool cavity : {false, true}) {
    const std::vector<double> sizes = cavity ? rest_size : std::vector<double>();
    std::vector<Eigen::Quaterniond> exact_rotations = rest;
    Eigen::Matrix3Xd exact(3, model.node_count());
    const int inverted = update_rotations(model, positions, exact_rotations);
    const int squeezed = internal_forces(model, positions, exact_rotations, exact, sizes);
    ASSERT_GT(inverted, 0);
    ASSERT_GT(squeezed, inverted);
    Companion companion;
    std::array<Eigen::Matrix3Xd, 2> forces;
    for (const bool two : {false, true}) {
      ElementScratch scratch{.companion = two ? &companion : nullptr, .sums = {}};
      std::vector<Eigen::Quaterniond> rotations = rest;
      forces[two].resize(3, model.node_count());
      const ElementCount count =
          update_rotations_and_forces(model, positions, rotations, forces[two], sizes, {}, scratch);
      EXPECT_EQ(count.inverted, inverted);
      EXPECT_EQ(count.squeezed, squeezed);
      double turned = 0;
      for (std::size_t t = 0; t < rotations.size(); ++t) {
        turned = std::max(turned, rotations[t].angularDistance(exact_rotations[t]));
      }
      EXPECT_LT(turned, 1e-7);
    }
    EXPECT_LT((forces[0] - exact).cwiseAbs().maxCoeff(), 1e-12 * exact.cwiseAbs().maxCoeff());
    EXPECT_EQ(forces[0], forces[1]);
  }
}

}  // namespace
}  // namespace stylet::physics
