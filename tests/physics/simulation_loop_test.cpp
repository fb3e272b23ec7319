// The simulation loop's motion of the tissue: exact equilibrium, damping, and never a bad number.
#include "physics/loops/simulation_loop.h"

#include "physics/tissue/corotational.h"
#include "tests/support/dense_tissue.h"
#include "tests/support/sanitized.h"
#include "tools/reference/dense_algebra.h"
#include "tools/reference/kuhn_box.h"

#include <gtest/gtest.h>
#include <Eigen/Cholesky>
#include <Eigen/SVD>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <numbers>
#include <vector>

namespace stylet::physics {
namespace {

constexpr double kEdge = 0.1;

SimulationBody cube(int cells = 4) {
  SimulationBody body;
  body.mesh = reference::kuhn_box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(kEdge), {cells, cells, cells});
  body.tet_materials.assign(body.mesh.tets.size(), {10e3, 0.45});
  body.fixed_nodes = reference::nodes_where(body.mesh, [](const Eigen::Vector3d& x) { return x.z() < 1e-9; });
  return body;
}

SimulationLoop one_cube(double damping_time_s = 0, int cells = 4) {
  std::vector<SimulationBody> bodies;
  bodies.push_back(cube(cells));
  bodies.back().damping_time_s = damping_time_s;
  return SimulationLoop(std::move(bodies), {.dt = 0.02});
}

/// A needle far away that pulls on the corner nodes of the top face.
NeedleState pull(const SimulationBody& body, const Eigen::Vector3d& force) {
  NeedleState needle;
  needle.node_count = 2;
  needle.positions.col(0) = Eigen::Vector3d(-2, 0, 0);
  needle.positions.col(1) = Eigen::Vector3d(-1, 0, 0);
  for (const int n : reference::nodes_where(body.mesh, [](const Eigen::Vector3d& x) {
         return x.z() > kEdge - 1e-9 && std::abs(x.x() - kEdge / 2) > 0.04 && std::abs(x.y() - kEdge / 2) > 0.04;
       })) {
    needle.forces[needle.force_count++] = {.body = 0, .node = n, .force = force / 4};
  }
  return needle;
}

TEST(SimulationLoop, FixedPointIsTheExactEquilibriumWhateverTheFactor) {
  // A load that turns parts of the cube by some 30 degrees. Once the factor stays the one at rest, once it is renewed
  // at every step: both must end where Newton's method on textbook elements ends.
  const SimulationBody body = cube();
  const NeedleState needle = pull(body, Eigen::Vector3d(1.5, 0.3, 0.5));
  const support::DenseTissue dense(body.mesh, body.tet_materials, body.fixed_nodes);
  Eigen::VectorXd load = Eigen::VectorXd::Zero(3 * Eigen::Index(body.mesh.nodes.size()));
  for (int i = 0; i < needle.force_count; ++i) {
    load.segment<3>(3 * needle.forces[i].node) = needle.forces[i].force;
  }
  Eigen::VectorXd exact = dense.rest();
  double residual = 1;
  for (int i = 0; i < 60 && residual > 2e-12; ++i) {
    const Eigen::VectorXd r = (load - dense.forces(exact))(dense.free_dofs());
    residual = r.norm() / load.norm();
    exact(dense.free_dofs()) += reference::solve(dense.free_stiffness(exact), r);
  }
  ASSERT_LE(residual, 1e-11);
  const double motion = (exact - dense.rest()).norm();

  for (const bool refactorise : {false, true}) {
    SimulationLoop loop = one_cube();
    TissuePatch patch = loop.make_patch();
    SimulationReport report;
    int steps = 0;
    do {
      report = loop.step({.needle = &needle, .request_factorisation = refactorise}, patch);
      loop.worker().step();
      ASSERT_EQ(report.flags & ~kSimulationStepLimited, 0U);
    } while (report.residual_n > 1e-12 * report.force_n && ++steps < 2000);
    const double error = (loop.tissue().positions[0].reshaped() - exact).norm() / motion;
    std::printf(
        "  factor %s: %d steps, residual %.1e N of %.1f N, off the dense solution by %.1e; largest move %.1f mm\n",
        refactorise ? "renewed" : "at rest", steps, report.residual_n, report.force_n, error,
        1e3 * (exact - dense.rest()).cwiseAbs().maxCoeff());
    EXPECT_LT(report.residual_n, 1e-12 * report.force_n);
    EXPECT_LT(error, 1e-9);
    EXPECT_EQ(report.factor_epoch > 0, refactorise);
  }
}

TEST(SimulationLoop, StillTissueIsNotFactorisedAnew) {
  const SimulationBody body = cube();
  const NeedleState needle = pull(body, Eigen::Vector3d(0.5, 0.1, 0.2));
  SimulationLoop loop = one_cube();
  TissuePatch patch = loop.make_patch();
  const auto requests = [&](int steps, double stale_turn, double* residual = nullptr) {
    int count = 0;
    for (int step = 0; step < steps; ++step) {
      const SimulationReport report = loop.step({.needle = &needle, .stale_turn = stale_turn}, patch);
      count += report.factorisation_requested;
      loop.worker().step();
      if (residual != nullptr) *residual = report.residual_n;
    }
    return count;
  };
  const int settling = requests(60, 0.01);
  double residual = 1;
  const int still = requests(100, 0.01, &residual);
  std::printf("  %d factorisations until the cube has come to rest, %d in 100 steps after; residual %.1e N\n",
              settling, still, residual);
  EXPECT_GE(settling, 1);
  EXPECT_LE(settling, 10);
  EXPECT_EQ(still, 0);
  EXPECT_LT(residual, 1e-11);
  EXPECT_EQ(requests(10, 0), 10) << "asked for whatever has moved";
}

TEST(SimulationLoop, AFactorIsOfTetrahedraThatHaveTurnedByNoMoreThanAskedAndItsComplianceAccordingly) {
  // The cube is bent to and fro. Whether a step asks for a factor, against rotations by SVD of its own positions;
  // the compliance of the factor it keeps, against the inverse of the textbook matrix of the state it is in.
  constexpr double kTurn = 0.0087;
  const SimulationBody body = cube(3);
  const support::DenseTissue dense(body.mesh, body.tet_materials, body.fixed_nodes);
  SimulationLoop loop = one_cube(0, 3);
  TissuePatch patch = loop.make_patch();
  const TissueModel& model = loop.model(0);
  const auto rotations_now = [&] {
    std::vector<Eigen::Matrix3d> rotations;
    for (int t = 0; t < model.tet_count(); ++t) {
      const Eigen::JacobiSVD<Eigen::Matrix3d> svd(deformation_gradient(model, loop.tissue().positions[0], t),
                                                  Eigen::ComputeFullU | Eigen::ComputeFullV);
      rotations.emplace_back(svd.matrixU() * svd.matrixV().transpose());
    }
    return rotations;
  };
  std::vector<std::vector<Eigen::Matrix3d>> history{rotations_now()};  // by step; 0: rest
  int asked = 0;
  double off = 0;  // of the compliance of all nodes
  for (int step = 1; step <= 200; ++step) {
    const NeedleState needle =
        pull(body, Eigen::Vector3d(0.5 * std::sin(2 * std::numbers::pi * step / 100), 0.1, 0.1));
    const SimulationReport report = loop.step({.needle = &needle, .stale_turn = kTurn}, patch);
    history.push_back(rotations_now());
    double turned = 0;
    for (std::size_t t = 0; t < history.back().size(); ++t) {
      turned = std::max(turned,
                        Eigen::AngleAxisd(history.back()[t].transpose() * history[report.factor_epoch][t]).angle());
    }
    ASSERT_EQ(report.factorisation_requested, turned > kTurn) << "step " << step << ", turned by " << turned;
    asked += report.factorisation_requested;
    if (step % 5 == 0 && !report.factorisation_requested) {
      const Eigen::MatrixXd exact = reference::inverse(dense.free_stiffness(loop.tissue().positions[0].reshaped()));
      Eigen::MatrixXd w = Eigen::MatrixXd::Identity(exact.rows(), exact.cols());
      SolveWorkspace workspace;
      loop.worker().latest().bodies[0].factor.solve(w, w, workspace);
      off = std::max(off, (w - exact).norm() / exact.norm());
    }
    loop.worker().step();
  }
  std::printf("  %d factorisations in 200 steps of bending; compliance off by at most %.2f %%\n", asked, 100 * off);
  EXPECT_GT(asked, 20);
  EXPECT_LT(asked, 190);
  EXPECT_GT(off, 0);
  EXPECT_LT(off, kTurn);
}

TEST(SimulationLoop, FreePositionsAndComplianceGiveTheCorrectedStateBack) {
  // What the haptic loop computes from the patch, p_free + W_bar f, is where the next simulation step puts the nodes.
  SimulationBody body = cube();
  SimulationLoop loop = one_cube();
  TissuePatch patch = loop.make_patch();
  NeedleState needle = pull(body, Eigen::Vector3d::Zero());
  needle.positions.col(0) = Eigen::Vector3d(-0.1, 0.043, 0.061);
  needle.positions.col(1) = Eigen::Vector3d(0.047, 0.043, 0.061);  // through the cube, so that nodes are isolated
  for (int step = 0; step < 20; ++step) {
    loop.step({.needle = &needle}, patch);
    if (step % 3 == 0) loop.worker().step();
    const BodyPatch& isolated = patch.bodies[0];
    const int n = isolated.node_count;
    ASSERT_GE(n, 8);
    Eigen::VectorXd f(3 * n);
    needle.force_count = n;
    for (int i = 0; i < n; ++i) {
      const Eigen::Vector3d force = 0.02 * Eigen::Vector3d(std::sin(i + step), std::cos(3 * i), 0.3 * step / 20.0);
      needle.forces[i] = {.body = 0, .node = isolated.node_ids[i], .force = force};
      f.segment<3>(3 * i) = force;
    }
    const Eigen::VectorXd moved = isolated.w_bar() * f;
    const Eigen::Matrix3Xd expected = isolated.free_positions.leftCols(n) + moved.reshaped(3, n);
    const std::vector<int> ids(isolated.node_ids.begin(), isolated.node_ids.begin() + n);
    TissuePatch next = loop.make_patch();
    loop.step({.needle = &needle, .take_factorisation = step % 2 == 0, .request_factorisation = step % 5 == 0}, next);
    const double error = (loop.tissue().positions[0](Eigen::all, ids) - expected).norm();
    EXPECT_LT(error, 1e-13) << "step " << step;
  }
}

TEST(SimulationLoop, ReturnsToRestWhenTheNeedleIsGone) {
  const SimulationBody body = cube();
  SimulationLoop loop = one_cube();
  TissuePatch patch = loop.make_patch();
  const Eigen::Matrix3Xd rest = loop.tissue().positions[0];
  const NeedleState needle = pull(body, Eigen::Vector3d(2, 0, 0));
  for (int i = 0; i < 50; ++i) {
    loop.step({.needle = &needle}, patch);
    loop.worker().step();
  }
  EXPECT_GT((loop.tissue().positions[0] - rest).norm(), 0.01);
  for (int i = 0; i < 50; ++i) {
    loop.step({}, patch);
    loop.worker().step();
  }
  EXPECT_LT((loop.tissue().positions[0] - rest).norm(), 1e-13);
}

TEST(SimulationLoop, DampedTissueApproachesEquilibriumAtItsTimeConstant) {
  // Small loads: backward Euler of B x' + K x = f with B = tau K leaves (tau/h) / (1 + tau/h) of the error each step.
  const double tau = 0.1;
  const SimulationBody body = cube();
  const NeedleState needle = pull(body, Eigen::Vector3d(1e-6, 0, 0));
  const auto deflection = [&](double damping, int steps) {
    SimulationLoop loop = one_cube(damping);
    TissuePatch patch = loop.make_patch();
    const Eigen::Matrix3Xd rest = loop.tissue().positions[0];
    for (int i = 0; i < steps; ++i) loop.step({.needle = &needle, .request_factorisation = false}, patch);
    return (loop.tissue().positions[0] - rest).norm();
  };
  const double final = deflection(0, 5);
  for (const int steps : {1, 5, 20}) {
    EXPECT_NEAR(deflection(tau, steps) / final, 1 - std::pow(tau / 0.02 / (1 + tau / 0.02), steps), 1e-6);
  }
}

// A column that does not bulge stands under its weight: u(z) = rho g (H z - z^2 / 2) / E. Nodes at the corners have
// less weight for their stiffness than those next to them; means over a layer of nodes are exact.
TEST(SimulationLoop, AColumnSettlesUnderItsWeightAsFarAsTheorySays) {
  constexpr double kWeight = 1000 * 9.81;  // N/m^3
  SimulationBody body = cube(6);
  body.tet_materials.assign(body.mesh.tets.size(), {10e3, 0.0});
  body.load = Eigen::Matrix3Xd::Zero(3, Eigen::Index(body.mesh.nodes.size()));
  for (const auto& tet : body.mesh.tets) {
    for (const int node : tet) body.load(2, node) -= kWeight * kEdge * kEdge * kEdge / 1296 / 4;  // 6^4 tetrahedra
  }
  const TetMesh mesh = body.mesh;
  SimulationLoop loop({std::move(body)}, {.dt = 0.02});
  TissuePatch patch = loop.make_patch();
  for (int step = 0; step < 100; ++step) {
    EXPECT_EQ(loop.step({.time_s = 0.02 * step}, patch).flags & kSimulationInverted, 0U);
    loop.worker().step();
  }
  double worst = 0;
  for (int layer = 1; layer <= 6; ++layer) {
    const double z = layer * kEdge / 6;
    const double exact = -kWeight * (kEdge * z - z * z / 2) / 10e3;
    double mean = 0;
    const auto nodes =
        reference::nodes_where(mesh, [&](const Eigen::Vector3d& x) { return std::abs(x.z() - z) < 1e-9; });
    for (const int n : nodes) mean += (loop.tissue().positions[0](2, n) - z) / static_cast<double>(nodes.size());
    std::printf("z %.1f mm: %.4f mm, exact %.4f mm\n", 1e3 * z, 1e3 * mean, 1e3 * exact);
    worst = std::max(worst, std::abs(mean - exact));
  }
  const double top = kWeight * kEdge * kEdge / 2 / 10e3;
  std::printf("top settles by %.3f mm, off by at most %.4f mm\n", 1e3 * top, 1e3 * worst);
  EXPECT_LT(worst, 0.01 * top);
}

TEST(SimulationLoop, SettledItHasGivenWayBeforeItsFirstStep) {
  const SimulationBody body = cube();
  const auto loaded = [] {
    std::vector<SimulationBody> bodies;
    bodies.push_back(cube());
    bodies.back().load = Eigen::Matrix3Xd::Zero(3, Eigen::Index(bodies.back().mesh.nodes.size()));
    bodies.back().load.row(2).setConstant(-0.01);
    return SimulationLoop(std::move(bodies), {.dt = 0.02});
  };
  SimulationLoop stepped = loaded();
  TissuePatch patch = stepped.make_patch();
  const Eigen::Matrix3Xd rest = stepped.tissue().positions[0];
  for (int i = 0; i < 60; ++i) {
    stepped.step({.take_factorisation = false, .request_factorisation = false}, patch);
  }
  SimulationLoop loop = loaded();
  const NeedleState needle = pull(body, Eigen::Vector3d(1, 0, 0));
  loop.settle({.needle = &needle}, 60);  // the needle is not there yet
  const Eigen::Matrix3Xd settled = loop.tissue().positions[0];
  EXPECT_GT((settled - rest).norm(), 1e-3);
  EXPECT_EQ(settled, stepped.tissue().positions[0]);
  const SimulationReport report = loop.step({}, patch);
  EXPECT_EQ(report.step, 1U);
  EXPECT_EQ(patch.epoch, 1U);
  EXPECT_LT((loop.tissue().positions[0] - settled).norm(), 1e-9);
}

TEST(SimulationLoop, NonFiniteNeedleIsRefused) {
  const SimulationBody body = cube();
  SimulationLoop loop = one_cube();
  TissuePatch patch = loop.make_patch();
  NeedleState needle = pull(body, Eigen::Vector3d(1, 0, 0));
  for (int i = 0; i < 30; ++i) loop.step({.needle = &needle}, patch);
  const Eigen::Matrix3Xd before = loop.tissue().positions[0];
  NeedleState bad = needle;
  bad.forces[1].force.y() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(loop.step({.needle = &bad}, patch).flags, kSimulationNonFinite);
  bad = needle;
  bad.positions(0, 1) = std::numeric_limits<double>::infinity();
  EXPECT_EQ(loop.step({.needle = &bad}, patch).flags, kSimulationNonFinite);
  EXPECT_LT((loop.tissue().positions[0] - before).norm(), 1e-6);  // it holds the last good forces
  EXPECT_EQ(loop.step({.needle = &needle}, patch).flags, 0U);
}

TEST(SimulationLoop, SurvivesForcesThatWouldTurnTheMeshInsideOut) {
  constexpr int kCells = support::kSanitized ? 2 : 4;
  const SimulationBody body = cube(kCells);
  std::uint32_t flags = 0;
  for (const double size : {30.0, 1e6, 1e300}) {
    SimulationLoop loop = one_cube(0, kCells);
    TissuePatch patch = loop.make_patch();
    const Eigen::Matrix3Xd rest = loop.tissue().positions[0];
    const NeedleState needle = pull(body, Eigen::Vector3d(0.3, 0.1, -1) * size);
    SimulationReport report;
    for (int i = 0; i < 430; ++i) {
      report = loop.step({.needle = i < 30 ? &needle : nullptr}, patch);
      loop.worker().step();
      flags |= report.flags;
      ASSERT_TRUE(loop.tissue().positions[0].allFinite()) << size << " N, step " << i;
      ASSERT_TRUE(std::isfinite(report.residual_n)) << size << " N, step " << i;
    }
    std::printf("  %.0e N, then released: %d inverted, %.1e m from rest, residual %.1e N\n", size,
                report.inverted_tets, (loop.tissue().positions[0] - rest).norm(), report.residual_n);
    EXPECT_LT((loop.tissue().positions[0] - rest).norm(), 1e-9);
  }
  EXPECT_EQ(flags & kSimulationInverted, 0U);
  EXPECT_NE(flags & kSimulationStepLimited, 0U);
}

TEST(SimulationLoop, RefusesBodiesItCannotHold) {
  const auto make = [](SimulationBody body) {
    std::vector<SimulationBody> bodies;
    bodies.push_back(std::move(body));
    SimulationLoop loop(std::move(bodies), {});
  };
  SimulationBody hinged = cube();  // held along one edge only: free to turn about it
  hinged.fixed_nodes =
      reference::nodes_where(hinged.mesh, [](const Eigen::Vector3d& x) { return x.z() < 1e-9 && x.y() < 1e-9; });
  EXPECT_THROW(make(std::move(hinged)), std::invalid_argument);
  EXPECT_NO_THROW(make(cube()));
  EXPECT_THROW(SimulationLoop({}, {}), std::invalid_argument);
}

}  // namespace
}  // namespace stylet::physics
