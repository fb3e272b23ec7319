// A second thread in the simulation step: the same bits with it and without.
#include "physics/tissue/companion.h"
#include "physics/contact/surface_compliance.h"
#include "physics/loops/simulation_loop.h"
#include "physics/tissue/corotational.h"
#include "physics/tissue/factorisation.h"
#include "physics/tissue/inversion.h"
#include "physics/tissue/isolated_dofs.h"
#include "physics/tissue/quadratic.h"
#include "physics/tissue/refinement.h"
#include "physics/tissue/stiffness.h"
#include "physics/tissue/strain_memory.h"
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

TEST(Companion, ALoopOfManyPartsFollowsOneOfTwo) {
  // Its helper, just done with the last of the two, must not take a third: there are more only of the next loop.
  for (int companions = 0; companions < 30; ++companions) {  // one whose helper sleeps on would show nothing
    Companion companion;
    std::array<int, 8> done{};
    for (int loop = 0; loop < 30'000; ++loop) {
      const int parts = loop % 2 == 0 ? 2 : 8;
      done.fill(0);
      companion.run(parts, [&](int part) { ++done[part]; });
      for (int part = 0; part < 8; ++part) ASSERT_EQ(done[part], part < parts ? 1 : 0) << "loop " << loop;
    }
  }
}

TEST(Companion, MorePartsThanItCountsAreTheCallers) {
  Companion companion;
  const int parts = 3 << 20;
  int done = 0;
  companion.run(parts, [&](int part) { done += part == done ? 1 : 0; });
  EXPECT_EQ(done, parts);
}

/// A loop whose part 0 ends when the other thread has done part 1: one that stays away would be waited for for ever.
void run_with_both_threads(Companion& companion) {
  std::atomic<int> others{0};
  const std::thread::id caller = std::this_thread::get_id();
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

TEST(Companion, TakesPartsWhereTheCallerIsBusy) {
  Companion companion;
  run_with_both_threads(companion);
}

TEST(Companion, EachTaskIsDoneOnceWithAllOfItsLoops) {
  for (const bool thread : {false, true}) {
    Companion companion(thread);
    std::array<int, 4> done{};
    std::array<std::array<int, 8>, 4> parts{};
    std::atomic<int> strangers{0};
    for (int run = 0; run < 3000; ++run) {
      companion.run_tasks(run % 5, [&](int task, int side) {
        ++done[static_cast<std::size_t>(task)];
        if (side != 0 && !thread) ++strangers;
        for (int loop = 0; loop < 5; ++loop) {
          companion.of(side).run(8, [&](int part) { ++parts[static_cast<std::size_t>(task)][part]; });
        }
      });
      companion.run(8, [&](int part) { ++parts[0][part]; });  // a late helper takes nothing of what is over
      if (run % 500 == 0) std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    EXPECT_EQ(strangers, 0);
    for (int task = 0; task < 4; ++task) {
      EXPECT_EQ(done[task], 600 * (4 - task));
      for (const int of_part : parts[task]) EXPECT_EQ(of_part, 5 * 600 * (4 - task) + (task == 0 ? 3000 : 0));
    }
  }
}

TEST(Companion, WhoIsDoneWithItsTaskTakesPartInTheOthers) {
  for (const int longer : {0, 1}) {
    Companion companion;
    std::atomic<bool> both_taken{false};
    companion.run_tasks(2, [&](int task, int side) {
      EXPECT_EQ(task, side);
      if (task == 1) both_taken = true;
      while (!both_taken.load()) std::this_thread::yield();  // else the caller has both
      if (task == longer) run_with_both_threads(companion.of(side));
    });
  }
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

TEST(Companion, StepsOfSeveralBodiesHaveTheSameBitsWithOneThreadAndTwo) {
  struct Found {
    std::vector<Eigen::Matrix3Xd> positions;
    std::vector<Eigen::MatrixXd> w_bar;
    std::vector<std::array<double, 3>> sums;  // of all bodies: residual, force, new isolated nodes
    std::uint32_t flags = 0;
  };
  const auto run = [](bool two_threads) {
    std::vector<SimulationBody> bodies;
    for (const int cells : {4, 13, 15}) {  // the largest comes last
      bodies.push_back(cube(cells));
      for (ElasticMaterial& material : bodies.back().tet_materials) {
        material.stiffening = 8;
        material.relaxation = {{{.share = 0.2, .time_s = 0.3}, {.share = 0.25, .time_s = 4}}};
      }
    }
    SimulationLoop loop(std::move(bodies), {.lay_contacts = false, .two_threads = two_threads});
    EXPECT_GT(loop.model(1).runs.size(), 1U);
    TissuePatch patch = loop.make_patch();
    Found found;
    for (int step = 0; step < 4; ++step) {
      NeedleState needle;
      needle.node_count = 3;
      for (int i = 0; i < 3; ++i)
        needle.positions.col(i) = Eigen::Vector3d(-0.18 + 0.006 * step + 0.1 * i, 0.047, 0.053);
      for (int b = 0; b < 3; ++b) {
        for (int i = 0; i < patch.bodies[b].node_count && i < 8; ++i) {
          needle.forces[needle.force_count++] = {
              .body = b, .node = patch.bodies[b].node_ids[i], .force = {0.01, 0.05 * step, 0.03}};
        }
      }
      const SimulationReport report = loop.step({.needle = &needle}, patch);
      if (step % 2 == 1) loop.worker().step();
      for (int b = 0; b < 3; ++b) {
        found.positions.push_back(loop.tissue().positions[b]);
        found.w_bar.push_back(patch.bodies[b].w_bar());
      }
      found.sums.push_back({report.residual_n, report.force_n, static_cast<double>(report.new_isolated_nodes)});
      found.flags |= report.flags;
    }
    return found;
  };
  const Found alone = run(false);
  const Found together = run(true);
  EXPECT_EQ(alone.flags, together.flags);
  EXPECT_EQ(alone.sums, together.sums);
  EXPECT_GT(alone.sums.back()[1], 0);
  for (std::size_t i = 0; i < alone.positions.size(); ++i) {
    ASSERT_EQ(alone.positions[i], together.positions[i]) << "body " << i % 3 << " of step " << i / 3;
    ASSERT_EQ(alone.w_bar[i], together.w_bar[i]) << "body " << i % 3 << " of step " << i / 3;
  }
  for (std::size_t b = 0; b < 3; ++b) {
    const std::size_t last = alone.positions.size() - 3 + b;
    EXPECT_GT((alone.positions[last] - alone.positions[b]).cwiseAbs().maxCoeff(), 1e-6) << "body " << b;
  }
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

TEST(Companion, WhatStiffensAndRelaxesHasTheSameBitsWithOneThreadAndTwo) {
  const TetMesh mesh = refined(cube(6).mesh);
  std::vector<ElasticMaterial> materials(
      mesh.tets.size(), {.young_modulus = 10e3,
                         .poisson_ratio = 0.49,
                         .stiffening = 8,
                         .relaxation = {{{.share = 0.2, .time_s = 0.3}, {.share = 0.25, .time_s = 4}}}});
  for (std::size_t t = 0; t < 8 * (mesh.tets.size() / 24); ++t) materials[t] = {10e3, 0.45};  // linear elements, too
  const TissueModel model(mesh, materials,
                          reference::nodes_where(mesh, [](const Eigen::Vector3d& x) { return x.z() < 1e-9; }), 0,
                          Element::quadratic, 100);
  ASSERT_GT(model.runs.size(), 1U);
  Eigen::Matrix3Xd positions = rest_positions(model);
  for (int n = 0; n < model.node_count(); ++n) positions(0, n) += 6 * positions(2, n) * positions(2, n);
  positions.col(model.node_count() / 2) += Eigen::Vector3d(0.006, 0, 0);  // some are squeezed
  std::vector<Eigen::Quaterniond> rotations(model.point_count(), Eigen::Quaterniond::Identity());
  update_rotations(model, positions, rotations);

  Companion companion;
  struct Found {
    std::vector<StrainMemory> memory;
    std::vector<PointStiffness> stiffness;
    std::vector<Eigen::Matrix3d> cofactors;
    Eigen::Matrix3Xd forces;
    int squeezed = 0;
  };
  std::array<Found, 3> found;  // one loop, in parts by one thread, by two
  for (std::size_t i = 0; i < found.size(); ++i) {
    Found& of = found[i];
    of.memory.resize(model.quadratics.size());
    of.stiffness.resize(model.point_count());
    of.cofactors.resize(model.point_count());
    of.forces.resize(3, model.node_count());
    ElementScratch scratch{.companion = i == 2 ? &companion : nullptr, .sums = {}};
    relax_strain(model, positions, rotations, {}, 0.02, of.memory, scratch.companion);
    find_stiffening(model, positions, rotations, {}, of.stiffness, scratch.companion);
    find_cofactors(model, positions, of.cofactors, scratch.companion);
    std::vector<PointStiffness> around(model.point_count());
    const std::array<int, 2> nodes{3, model.node_count() / 2};
    find_stiffening_around(nodes, model, positions, rotations, {}, around);
    for (const int node : nodes) {
      for (int k = model.incident_start[node]; k < model.incident_start[node + 1]; ++k) {
        const auto point = static_cast<std::size_t>(model.incident_tets[k] / 8 * 4 + model.incident_tets[k] % 4);
        EXPECT_EQ(around[point].ratio, of.stiffness[point].ratio);
        EXPECT_EQ(around[point].along, of.stiffness[point].along);
      }
    }
    of.squeezed = i == 0 ? internal_forces(model, positions, rotations, of.forces, {}, true, of.memory)
                         : internal_forces(model, positions, rotations, of.forces, {}, of.memory, scratch);
  }
  Eigen::Matrix3Xd flat = rest_positions(model);
  flat.row(2) *= 0.2;  // three tenths are left after seven eighths of the way
  const double fraction = uninverted_fraction(model, rest_positions(model), flat);
  EXPECT_NEAR(fraction, 0.875, 1e-5);
  EXPECT_EQ(uninverted_fraction(model, rest_positions(model), flat, &companion), fraction);
  EXPECT_GT(found[0].squeezed, 0);
  EXPECT_EQ(found[1].forces, found[2].forces);
  for (const Found& of : {found[1], found[2]}) {
    EXPECT_LT((of.forces - found[0].forces).norm(), 1e-13 * found[0].forces.norm());  // parts are summed, then added
    EXPECT_EQ(of.squeezed, found[0].squeezed);
    EXPECT_EQ(of.cofactors, found[0].cofactors);
    for (std::size_t e = 0; e < of.memory.size(); ++e) {
      for (std::size_t term = 0; term < 2; ++term) {
        for (std::size_t c = 0; c < 6; ++c) {
          ASSERT_TRUE((of.memory[e].alpha[term][c] == found[0].memory[e].alpha[term][c]).all());
        }
      }
    }
    for (std::size_t p = 0; p < of.stiffness.size(); ++p) {
      ASSERT_EQ(of.stiffness[p].ratio, found[0].stiffness[p].ratio);
      ASSERT_EQ(of.stiffness[p].along, found[0].stiffness[p].along);
    }
  }
}

TEST(Companion, ElementsTurnRelaxAndAreSummedInOnePassWithTheSameBits) {
  for (const Element element : {Element::linear, Element::quadratic}) {
    const int cells = element == Element::quadratic ? 6 : 12;
    TetMesh mesh = reference::kuhn_box({0, 0, 0}, {0.06, 0.06, 0.06}, {cells, cells, cells});
    if (element == Element::quadratic) mesh = refined(mesh);
    std::vector<ElasticMaterial> materials(
        mesh.tets.size(), {.young_modulus = 10e3,
                           .poisson_ratio = 0.45,
                           .stiffening = 8,
                           .relaxation = {{{.share = 0.2, .time_s = 0.3}, {.share = 0.25, .time_s = 4}}}});
    for (std::size_t t = 0; t < 8 * (mesh.tets.size() / 24); ++t) materials[t] = {10e3, 0.45};
    const TissueModel model(mesh, materials,
                            reference::nodes_where(mesh, [](const Eigen::Vector3d& x) { return x.z() < 1e-9; }), 0,
                            element, 100);
    ASSERT_GT(model.runs.size(), 1U);
    const Eigen::Matrix3Xd rest = rest_positions(model);
    const auto positions_at = [&](int step) {
      Eigen::Matrix3Xd positions = rest;
      for (int n = 0; n < model.node_count(); ++n) positions(0, n) += 2 * step * rest(2, n) * rest(2, n);
      positions.col(model.node_count() / 2) += Eigen::Vector3d(0.004, 0, 0);  // some are squeezed
      return positions;
    };

    std::vector<Eigen::Quaterniond> rotations(model.point_count(), Eigen::Quaterniond::Identity());
    std::vector<StrainMemory> memory(model.memory_count());
    Eigen::Matrix3Xd forces(3, model.node_count());
    int squeezed = 0;
    for (int step = 1; step <= 3; ++step) {
      update_rotations(model, positions_at(step), rotations);
      relax_strain(model, positions_at(step), rotations, {}, 0.02, memory);
      squeezed = internal_forces(model, positions_at(step), rotations, forces, {}, true, memory);
    }
    EXPECT_GT(squeezed, 0);
    Companion companion;
    std::array<Eigen::Matrix3Xd, 2> found;
    for (std::size_t i = 0; i < found.size(); ++i) {
      std::vector<Eigen::Quaterniond> turned(model.point_count(), Eigen::Quaterniond::Identity());
      std::vector<StrainMemory> of(model.memory_count());
      std::vector<StrainMemory> later(model.memory_count());
      found[i].resize(3, model.node_count());
      ElementScratch scratch{.companion = i == 1 ? &companion : nullptr, .sums = {}};
      ElementCount count;
      for (int step = 1; step <= 3; ++step) {
        for (const int tried : {step + 1, step}) {  // a step that is taken again leaves nothing behind
          count = update_rotations_and_forces(model, positions_at(tried), turned, found[i], {}, of, scratch,
                                              {.dt = 0.02, .after = later});
        }
        of.swap(later);
      }
      EXPECT_EQ(count.squeezed, squeezed);
      EXPECT_LT((found[i] - forces).norm(), 1e-12 * forces.norm());
      for (std::size_t e = 0; e < of.size(); ++e) {
        for (std::size_t term = 0; term < 2; ++term) {
          for (std::size_t c = 0; c < 6; ++c) {
            ASSERT_LT((of[e].alpha[term][c] - memory[e].alpha[term][c]).abs().maxCoeff(), 1e-14);
          }
        }
      }
    }
    EXPECT_EQ(found[0], found[1]);
  }
}

TEST(Companion, ComplianceHasTheSameBitsWithOneThreadAndTwo) {
  const SimulationBody body = cube(19);  // large enough to be shared
  const TissueModel model(body.mesh, body.tet_materials, body.fixed_nodes);
  const StiffnessPattern pattern(model);
  std::vector<double> values(pattern.nonzeros());
  pattern.assemble(model, std::vector<Eigen::Quaterniond>(model.tets.size(), Eigen::Quaterniond::Identity()), 1,
                   values);
  Companion companion;
  SolveWorkspace workspace;
  Factorisation factor(pattern, workspace);
  ASSERT_TRUE(factor.factorise(pattern, values, workspace));
  EXPECT_GT(factor.factor_nonzeros(), 9U << 20);
  std::vector<int> nodes;
  for (int k = 0; k < 20; ++k) nodes.push_back(model.node_count() - 1 - 37 * k);
  std::array<Eigen::MatrixXd, 2> w_bar;
  std::array<std::vector<Eigen::Matrix3d>, 2> of_surface;
  for (const bool two : {false, true}) {
    workspace.companion = two ? &companion : nullptr;
    IsolatedDofs isolated(model.node_count(), 64);
    isolated.isolate(nodes, model, factor, workspace);
    w_bar[two].resize(60, 60);
    isolated.gather(nodes, w_bar[two]);
    SurfaceCompliance surface(model, factor, nodes);
    surface.learn_all(nodes, workspace.companion);
    for (const int a : nodes) {
      ASSERT_TRUE(surface.known(a));
      for (const int b : nodes) of_surface[two].push_back(surface.block(a, b));
    }
  }
  EXPECT_EQ(w_bar[0], w_bar[1]);
  EXPECT_EQ(of_surface[0], of_surface[1]);
  // Both are blocks of one inverse, the surface's in single precision.
  for (std::size_t a = 0; a < nodes.size(); ++a) {
    for (std::size_t b = 0; b < nodes.size(); ++b) {
      const Eigen::Matrix3d exact =
          w_bar[0].block<3, 3>(static_cast<Eigen::Index>(3 * a), static_cast<Eigen::Index>(3 * b));
      EXPECT_LT((of_surface[0][nodes.size() * a + b] - exact).cwiseAbs().maxCoeff(), 1e-6 * w_bar[0].maxCoeff());
    }
  }
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
