// The simulation loop with several bodies: contact, the probe, and supports that move (breathing).
#include "physics/loops/simulation_loop.h"

#include "tests/physics/contact_bench.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>

namespace stylet::physics {
namespace {

using tests::at_height;
using tests::kYoung;

/// A block 40 mm high standing on z, held at `held`.
SimulationBody held_block(double z, int cells, double held, double poisson = 0.4, double width = 0.06) {
  SimulationBody body;
  body.mesh = tests::block(z, cells, width);
  body.tet_materials.assign(body.mesh.tets.size(), {kYoung, poisson});
  body.fixed_nodes = at_height(body.mesh, held);
  return body;
}

/// Two blocks, the upper one's support moves by `motion` at amplitude 1. Where they are not alike the upper is
/// narrower: it stays on the lower one.
std::vector<SimulationBody> stack(const Eigen::Vector3d& motion, double poisson, int lower = 4, int upper = 4) {
  std::vector<SimulationBody> bodies;
  bodies.push_back(held_block(0, lower, 0, poisson));
  bodies.push_back(held_block(0.04, upper, 0.08, poisson, upper == lower ? 0.06 : 0.04));
  bodies.back().held_motion.assign(bodies.back().fixed_nodes.size(), motion);
  return bodies;
}

SimulationLoopSettings touching() {
  SimulationLoopSettings settings;
  settings.contact.pairs.push_back({.nodes_of = 1, .surface_of = 0});
  settings.contact.max_points = 256;
  return settings;
}

/// Steps the loop and its worker in lockstep.
SimulationReport run(SimulationLoop& loop, TissuePatch& patch, int steps, const SimulationInput& input) {
  SimulationReport report;
  for (int i = 0; i < steps; ++i) {
    report = loop.step(input, patch);
    loop.worker().step();
  }
  return report;
}

TEST(SimulationContact, BreathingPressesTheBlocksLikeABar) {
  SimulationLoop loop(stack({0, 0, -0.004}, 0), touching());
  TissuePatch patch = loop.make_patch();
  SimulationReport report;
  for (int i = 1; i <= 20; ++i) report = run(loop, patch, 1, {.held_amplitude = i / 20.0});
  report = run(loop, patch, 40, {.held_amplitude = 1});
  const double exact = kYoung * 0.06 * 0.06 * 0.004 / 0.08;
  std::printf("[ two blocks ] contact %.6f N, bar %.6f N, deepest %.1e m, residual %.1e N\n", report.organs.force_n,
              exact, report.organs.deepest, report.residual_n);
  EXPECT_NEAR(report.organs.force_n, exact, 1e-6 * exact);
  EXPECT_LT(report.organs.deepest, 1e-8);
  EXPECT_LT(report.residual_n, 1e-6);
  EXPECT_EQ(report.flags, 0u);

  report = run(loop, patch, 60, {.held_amplitude = -0.5});
  EXPECT_EQ(report.organs.pressing, 0);
  EXPECT_LT(report.residual_n, 1e-6);
}

TEST(SimulationContact, OverlapStaysSmallWhileTheSupportMoves) {
  // 4 mm of compression in a breath of 4 s at 50 Hz, on meshes that do not match: how far do nodes pass the surface?
  SimulationLoop loop(stack({0, 0, -0.004}, 0.4, 4, 5), touching());
  TissuePatch patch = loop.make_patch();
  double deepest = 0;
  double sharpest = 0;
  double before = 0;
  for (int i = 0; i < 400; ++i) {
    const double amplitude = (1 - std::cos(2 * M_PI * i / 200)) / 2;
    const SimulationReport report = run(loop, patch, 1, {.time_s = 0.02 * i, .held_amplitude = amplitude});
    deepest = std::max(deepest, report.organs.deepest);
    sharpest = std::max(sharpest, std::abs(report.organs.force_n - before));
    before = report.organs.force_n;
    EXPECT_EQ(report.flags & ~kSimulationStepLimited, 0u);
  }
  std::printf("[ breath of 4 mm ] deepest overlap %.3f mm, largest change of force a step %.3f N\n", 1e3 * deepest,
              sharpest);
  EXPECT_LT(deepest, 2e-4);  // three steps of the support at its fastest
}

TEST(SimulationContact, BodyFollowsARigidMotionOfItsSupportAndComesBack) {
  SimulationLoop loop(stack({0.004, 0.012, 0.005}, 0.4), touching());
  TissuePatch patch = loop.make_patch();
  run(loop, patch, 5, {.held_amplitude = 1});
  const Eigen::Matrix3Xd rest = rest_positions(loop.model(1));
  const Eigen::Matrix3Xd moved = loop.tissue().positions[1] - rest;
  EXPECT_LT((moved.colwise() - Eigen::Vector3d(0.004, 0.012, 0.005)).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT((loop.tissue().positions[0] - rest_positions(loop.model(0))).cwiseAbs().maxCoeff(), 1e-15);
  const SimulationReport report = run(loop, patch, 5, {.held_amplitude = 0});
  EXPECT_LT((loop.tissue().positions[1] - rest).cwiseAbs().maxCoeff(), 1e-12);
  EXPECT_LT(report.residual_n, 1e-9);
}

TEST(SimulationContact, ShearedSupportReachesTheEquilibriumOfItsPositionWhateverTheWay) {
  // Half the held nodes move: the body deforms. At once or in small steps, with renewed factors or without.
  std::vector<SimulationBody> bodies;
  bodies.push_back(held_block(0, 4, 0));
  for (const int n : at_height(bodies[0].mesh, 0.04)) bodies[0].fixed_nodes.push_back(n);
  const std::size_t below = bodies[0].fixed_nodes.size() / 2;
  bodies[0].held_motion.assign(bodies[0].fixed_nodes.size(), Eigen::Vector3d::Zero());
  for (std::size_t i = below; i < bodies[0].held_motion.size(); ++i) bodies[0].held_motion[i] = {0.012, 0, 0.004};
  SimulationLoop at_once(bodies, {});
  SimulationLoop slowly(bodies, {});
  TissuePatch patch = at_once.make_patch();
  run(at_once, patch, 200, {.request_factorisation = false, .held_amplitude = 1});
  for (int i = 1; i <= 50; ++i) run(slowly, patch, 1, {.held_amplitude = i / 50.0});
  const SimulationReport report = run(slowly, patch, 100, {.held_amplitude = 1});
  EXPECT_LT(report.residual_n, 1e-7);
  EXPECT_LT((at_once.tissue().positions[0] - slowly.tissue().positions[0]).cwiseAbs().maxCoeff(), 1e-9);
  // And it does deform: the middle layer is not half way everywhere.
  EXPECT_GT((slowly.tissue().positions[0] - rest_positions(slowly.model(0))).row(0).maxCoeff(), 0.0119);
}

TEST(SimulationContact, ProbePressesThroughTheUpperBlockIntoTheLower) {
  // The upper block stands loose on the lower but for its sides, so that the probe's force passes through the
  // contact.
  std::vector<SimulationBody> bodies;
  bodies.push_back(held_block(0, 4, 0));
  bodies.push_back(held_block(0.04, 5, 0.04, 0.4, 0.04));
  bodies[1].fixed_nodes =
      reference::nodes_where(bodies[1].mesh, [](const Eigen::Vector3d& x) { return std::abs(x.x()) > 0.02 - 1e-9; });
  SimulationLoopSettings settings = touching();
  settings.contact.probe.emplace();
  settings.contact.probe->body = 1;
  SimulationLoop loop(bodies, settings);
  TissuePatch patch = loop.make_patch();
  RigidPose pose;
  pose.orientation = Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitZ()) *
                     Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()));
  SimulationReport report;
  for (int i = 0; i <= 50; ++i) {
    pose.position = Eigen::Vector3d(0, 0, 0.08 - 1e-4 * i);
    report = run(loop, patch, 1, {.probe = &pose});
  }
  report = run(loop, patch, 100, {.probe = &pose});
  double below = 0;
  for (const SurfaceRow& row : loop.contact_rows()) {
    if (row.pair == 0) below += row.lambda * row.normal.z();
  }
  std::printf("[ probe 5 mm deep ] %.3f N on %.0f mm^2, of which %.3f N reach the lower block; residual %.1e N\n",
              report.probe.wrench.force.z(), 1e6 * report.probe.area, below, report.residual_n);
  EXPECT_GT(report.probe.wrench.force.z(), 0.5);
  EXPECT_GT(below, 0.1);
  EXPECT_LT(below, report.probe.wrench.force.z());
  EXPECT_GT(report.probe.area, 300e-6);
  EXPECT_LT(report.probe.area, 0.077 * 0.020);  // the head
  EXPECT_LT(report.organs.deepest, 1e-6);
  EXPECT_LT(report.residual_n, 1e-5);
}

TEST(SimulationContact, PatchHoldsTheContactForcesInItsFreePositions) {
  // No needle: the free positions that the haptic loop sees are the equilibrium under contact.
  SimulationLoop loop(stack({0, 0, -0.004}, 0.4, 4, 5), touching());
  TissuePatch patch = loop.make_patch();
  NeedleState needle;  // in the lower block, without force
  needle.node_count = 2;
  needle.positions.col(0) = Eigen::Vector3d(-0.08, 0.001, 0.03);
  needle.positions.col(1) = Eigen::Vector3d(0.01, 0.001, 0.03);
  run(loop, patch, 80, {.needle = &needle, .held_amplitude = 1});
  const BodyPatch& lower = patch.bodies[0];
  ASSERT_GT(lower.node_count, 8);
  const Eigen::Matrix3Xd rest = rest_positions(loop.model(0));
  double moved = 0;
  for (int i = 0; i < lower.node_count; ++i) {
    const int node = lower.node_ids[i];
    EXPECT_LT((lower.free_positions.col(i) - loop.tissue().positions[0].col(node)).norm(), 1e-7);
    moved = std::max(moved, (lower.free_positions.col(i) - rest.col(node)).norm());
  }
  EXPECT_GT(moved, 1e-3);
}

TEST(SimulationContact, SurvivesInvalidInput) {
  SimulationLoopSettings settings = touching();
  settings.contact.probe.emplace();
  SimulationLoop loop(stack({0, 0, -0.004}, 0.4), settings);
  TissuePatch patch = loop.make_patch();
  RigidPose pose;
  pose.position.x() = std::numeric_limits<double>::quiet_NaN();
  const SimulationReport report =
      run(loop, patch, 2, {.probe = &pose, .held_amplitude = std::numeric_limits<double>::infinity()});
  EXPECT_NE(report.flags & kSimulationNonFinite, 0u);
  EXPECT_TRUE(loop.tissue().positions[0].allFinite());
  pose.position = Eigen::Vector3d(0, 0, 0.02);  // the probe in the middle of the body, at once
  run(loop, patch, 50, {.probe = &pose, .held_amplitude = 3});
  EXPECT_TRUE(loop.tissue().positions[0].allFinite());
  EXPECT_TRUE(loop.tissue().positions[1].allFinite());
  std::vector<SimulationBody> wrong = stack({0, 0, 0}, 0.4);
  wrong[1].held_motion.pop_back();
  EXPECT_THROW(SimulationLoop(wrong, touching()), std::invalid_argument);
}

TEST(SimulationContact, SameInputsGiveTheSameBits) {
  const auto positions = [] {
    SimulationLoop loop(stack({0.002, 0, -0.004}, 0.4, 4, 5), touching());
    TissuePatch patch = loop.make_patch();
    for (int i = 0; i < 30; ++i) run(loop, patch, 1, {.held_amplitude = std::sin(0.1 * i)});
    return loop.tissue().positions[1];
  };
  EXPECT_EQ((positions() - positions()).cwiseAbs().maxCoeff(), 0);
}

}  // namespace
}  // namespace stylet::physics
