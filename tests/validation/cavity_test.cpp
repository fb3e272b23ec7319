// Cavities of fluid against theory: a ball that shrinks in a large elastic body (Lame's hollow sphere).
#include "physics/loops/simulation_loop.h"
#include "physics/tissue/corotational.h"
#include "tests/validation/residual.h"
#include "tools/reference/kuhn_box.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <limits>
#include <numbers>
#include <random>

namespace stylet::physics {
namespace {

constexpr double kHalfEdge = 0.1;  // of the cube, m
constexpr double kRadius = 0.016;  // of the cavity
constexpr ElasticMaterial kTissue{.young_modulus = 15e3, .poisson_ratio = 0.3};
constexpr ElasticMaterial kFluid{.young_modulus = 1e3, .poisson_ratio = 0.45};

/// Cube held at its faces, four times finer in the middle, where a ball is fluid.
SimulationBody cube_with_cavity(int cells) {
  SimulationBody body;
  body.mesh = reference::kuhn_box(Eigen::Vector3d::Constant(-1), Eigen::Vector3d::Constant(1), {cells, cells, cells});
  body.fixed_nodes =
      reference::nodes_where(body.mesh, [](const Eigen::Vector3d& x) { return x.cwiseAbs().maxCoeff() > 1 - 1e-9; });
  for (Eigen::Vector3d& x : body.mesh.nodes) {
    x = kHalfEdge * (0.25 * x.array() + 0.75 * x.array().cube()).matrix();
  }
  body.tet_materials.assign(body.mesh.tets.size(), kTissue);
  body.cavities.emplace_back();
  for (std::size_t t = 0; t < body.mesh.tets.size(); ++t) {
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (const int n : body.mesh.tets[t]) centre += body.mesh.nodes[n] / 4;
    if (centre.norm() > kRadius) continue;
    body.cavities[0].push_back(static_cast<int>(t));
    body.tet_materials[t] = kFluid;
  }
  return body;
}

/// Brings a loop from the share it has to another, then lets it settle.
SimulationReport drain(SimulationLoop& loop, TissuePatch& patch, double from, double to, int settle = 80,
                       const NeedleState* needle = nullptr) {
  SimulationReport report;
  const int steps = static_cast<int>(std::ceil(std::abs(to - from) / 0.01));
  for (int i = 1; i <= steps + settle; ++i) {
    const double share = i < steps ? from + (to - from) * i / steps : to;
    report = loop.step({.needle = needle, .cavity_shares = {&share, 1}}, patch);
    loop.worker().step();
  }
  return report;
}

double rest_volume(const SimulationLoop& loop, const std::vector<int>& tets) {
  double volume = 0;
  for (const int t : tets) volume += loop.model(0).tets[t].volume;
  return volume;
}

TEST(Cavity, WallMovesAndPullsAsLameSays) {
  const double mu = kTissue.young_modulus / (2 * (1 + kTissue.poisson_ratio));
  std::vector<double> field;  // off theory, coarse mesh first
  std::vector<double> pressure;
  std::vector<double> mesh_size;
  for (const int cells : {8, 12, 16}) {
    const SimulationBody body = cube_with_cavity(cells);
    SimulationLoop loop({body}, {});
    TissuePatch patch = loop.make_patch();
    const double full = rest_volume(loop, body.cavities[0]);
    const double share = 0.97;
    const SimulationReport report = drain(loop, patch, 1, share, 30);
    EXPECT_EQ(report.flags & kSimulationInverted, 0u);
    const double a = std::cbrt(3 * full / (4 * std::numbers::pi));
    const double wall = a * (std::cbrt(share) - 1);
    // Around a ball u = u_a a^2 / r^2; the faces, 6 a away, are 0.5 % of it.
    double error = 0;
    double whole = 0;
    double along = 0;
    for (int n = 0; n < loop.model(0).node_count(); ++n) {
      const Eigen::Vector3d x = loop.model(0).mesh.nodes[n];
      const double r = x.norm();
      if (r < 1.25 * a || r > 2.5 * a) continue;
      const Eigen::Vector3d theory = wall * a * a / (r * r) * x / r;
      const Eigen::Vector3d moved = loop.tissue().positions[0].col(n) - x;
      error += (moved - theory).squaredNorm();
      along += moved.dot(theory);
      whole += theory.squaredNorm();
    }
    field.push_back(std::sqrt(error / whole));
    pressure.push_back(report.cavities[0].pressure / (4 * mu * wall / a) - 1);
    mesh_size.push_back(std::cbrt(1.0 / static_cast<double>(body.cavities[0].size())));
    std::printf(
        "  %2d cells, %zu tetrahedra in the cavity: wall moves %.3f mm, pressure %.1f Pa, off theory: "
        "pressure %.0f %%, displacement %.0f %%, its amplitude %.1f %%\n",
        cells, body.cavities[0].size(), wall * 1e3, report.cavities[0].pressure, 100 * pressure.back(),
        100 * field.back(), 100 * (along / whole - 1));
    validation::report_residual("volume", std::abs(report.cavities[0].volume / (share * full) - 1),
                                1e-4);  // of 3 %, 30 steps after
    validation::report_residual("displacement, amplitude", std::abs(along / whole - 1), 0.15);
  }
  EXPECT_LT(field[2], field[1]);
  EXPECT_LT(field[1], field[0]);
  validation::report_residual("displacement, finest mesh", field[2], 0.12);
  // The ball is one of steps: first order. The line through the outer two meshes ends at theory.
  EXPECT_LT(pressure[2], 0.5 * pressure[0]);
  const double limit = pressure[2] - (pressure[0] - pressure[2]) / (mesh_size[0] - mesh_size[2]) * mesh_size[2];
  validation::report_residual("pressure, extrapolated to a mesh of size 0", std::abs(limit), 0.08);
}

TEST(Cavity, ForceIsTheGradientOfTheEnergy) {
  const SimulationBody body = cube_with_cavity(4);
  const TissueModel model(body.mesh, body.tet_materials, body.fixed_nodes);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  Eigen::Matrix3Xd p = rest_positions(model);
  p += Eigen::Matrix3Xd::NullaryExpr(3, p.cols(), [&] { return 2e-3 * uniform(random); });
  std::vector<double> size(model.tets.size());
  for (double& g : size) g = 0.8 + 0.3 * uniform(random);
  std::vector<Eigen::Quaterniond> rotations(model.tets.size(), Eigen::Quaterniond::Identity());
  const auto energy = [&](const Eigen::Matrix3Xd& at) {
    update_rotations(model, at, rotations);
    return elastic_energy(model, at, rotations, size);
  };
  update_rotations(model, p, rotations);
  Eigen::Matrix3Xd forces(3, p.cols());
  internal_forces(model, p, rotations, forces, size);
  double worst = 0;
  for (int trial = 0; trial < 20; ++trial) {
    const Eigen::Matrix3Xd way = Eigen::Matrix3Xd::NullaryExpr(3, p.cols(), [&] { return uniform(random); });
    const double h = 1e-6;
    const double difference = (energy(p + h * way) - energy(p - h * way)) / (2 * h);
    worst = std::max(worst, std::abs(difference - forces.cwiseProduct(way).sum()) / forces.norm());
  }
  validation::report_residual("gradient, relative", worst, 1e-6);
}

TEST(Cavity, FullItChangesNoBit) {
  SimulationBody body = cube_with_cavity(6);
  body.load = Eigen::Matrix3Xd::Constant(3, static_cast<Eigen::Index>(body.mesh.nodes.size()), 1e-3);
  SimulationLoop with({body}, {});
  body.cavities.clear();
  SimulationLoop without({body}, {});
  TissuePatch patch = with.make_patch();
  const double share = 1;
  for (int i = 0; i < 10; ++i) {
    with.step({.cavity_shares = {&share, 1}}, patch);
    without.step({}, patch);
    const Eigen::Matrix3Xd& p = with.tissue().positions[0];
    ASSERT_EQ(std::memcmp(p.data(), without.tissue().positions[0].data(),
                          static_cast<std::size_t>(p.size()) * sizeof(double)),
              0)
        << "step " << i;
    with.worker().step();
    without.worker().step();
  }
}

TEST(Cavity, EmptiedAndFilledAgainItIsAsBefore) {
  const SimulationBody body = cube_with_cavity(10);
  SimulationLoop loop({body}, {});
  TissuePatch patch = loop.make_patch();
  const double full = rest_volume(loop, body.cavities[0]);
  const Eigen::Matrix3Xd rest = loop.tissue().positions[0];
  double last_pressure = 0;
  double from = 1;
  for (const double share : {0.7, 0.4, 0.25}) {
    const SimulationReport report = drain(loop, patch, from, share, 150);
    from = share;
    std::printf("  share %.2f: volume %.6f, pressure %.0f Pa, residual %.1e N\n", share,
                report.cavities[0].volume / full, report.cavities[0].pressure, report.residual_n);
    validation::report_residual("volume", std::abs(report.cavities[0].volume / full - share), 1e-4);
    EXPECT_EQ(report.inverted_tets, 0) << share;
    EXPECT_LT(report.cavities[0].pressure, last_pressure);
    last_pressure = report.cavities[0].pressure;
  }
  drain(loop, patch, from, 1, 300);
  validation::report_residual("left over, m", (loop.tissue().positions[0] - rest).cwiseAbs().maxCoeff(), 1e-9);
}

TEST(Cavity, HapticLoopSeesTheWallMove) {
  const SimulationBody body = cube_with_cavity(10);
  SimulationLoop loop({body}, {.lay_contacts = false});
  TissuePatch patch = loop.make_patch();
  NeedleState needle;  // rests in the cavity without a force
  needle.node_count = 2;
  needle.positions.col(0) = Eigen::Vector3d(0, 0, 0.15);
  needle.positions.col(1) = Eigen::Vector3d(0, 0, 0.005);
  needle.tip = TipState::inside;
  needle.tip_body = 0;
  needle.tip_depth = 0.095;
  needle.track_count = 1;
  needle.contacts[0] = {.id = 0, .body = 0, .tet = body.cavities[0].front(), .position = needle.positions.col(1)};
  drain(loop, patch, 1, 0.7, 100, &needle);
  const BodyPatch& seen = patch.bodies[0];
  ASSERT_GT(seen.node_count, 4);
  double gap = 0;
  double moved = 0;
  for (int i = 0; i < seen.node_count; ++i) {
    const int node = seen.node_ids[i];
    gap = std::max(gap, (seen.free_positions.col(i) - loop.tissue().positions[0].col(node)).norm());
    moved = std::max(moved, (seen.free_positions.col(i) - seen.rest_positions.col(i)).norm());
  }
  validation::report_residual("free positions off the tissue, m", gap, 1e-8);
  EXPECT_GT(moved, 0.08 * kRadius);
}

TEST(Cavity, MadSharesAreRefused) {
  SimulationBody body = cube_with_cavity(4);
  SimulationLoop loop({body}, {});
  TissuePatch patch = loop.make_patch();
  const double nan = std::numeric_limits<double>::quiet_NaN();
  EXPECT_NE(loop.step({.cavity_shares = {&nan, 1}}, patch).flags & kSimulationNonFinite, 0u);
  EXPECT_EQ((loop.tissue().positions[0] - rest_positions(loop.model(0))).cwiseAbs().maxCoeff(), 0);
  const double mad = -1e300;
  SimulationReport report;
  for (int i = 0; i < 300; ++i) report = loop.step({.cavity_shares = {&mad, 1}}, patch);
  EXPECT_TRUE(loop.tissue().positions[0].allFinite());
  EXPECT_GT(report.cavities[0].volume, 0);
  body.cavities[0].push_back(body.cavities[0].front());
  EXPECT_THROW(SimulationLoop({body}, {}), std::invalid_argument);
}

}  // namespace
}  // namespace stylet::physics
