// Contact of organs and probe: unilateral, sliding, equal and opposite, and right against bars and dense references.
#include "physics/contact/organ_contact.h"

#include "tests/physics/contact_bench.h"
#include "tests/support/dense_tissue.h"
#include "tools/reference/dense_algebra.h"
#include "tools/reference/kuhn_box.h"

#include <gtest/gtest.h>
#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include <cmath>
#include <cstdio>
#include <numeric>

namespace stylet::physics {
namespace {

using Bench = tests::ContactBench;
using tests::at_height;
using tests::block;
using tests::kYoung;

/// Two blocks, one on the other, held at the bottom and the top; body 1 is above.
void stack(Bench& bench, int lower_cells, int upper_cells, const ElasticMaterial& lower, const ElasticMaterial& upper,
           double upper_width = 0.06) {
  const TetMesh below = block(0, lower_cells);
  const TetMesh above = block(0.04, upper_cells, upper_width);
  bench.add(below, lower, at_height(below, 0));
  bench.add(above, upper, at_height(above, 0.08));
  bench.touch({.pairs = {{.nodes_of = 1, .surface_of = 0}}, .max_points = 256});
}

TEST(OrganContact, CompressedBlocksCarryWhatABarDoes) {
  // Poisson's ratio 0: stress is uniform, F = E A delta / L with L the height of both. Meshes that match node by node
  // must give it to rounding, others to the error of contact at nodes alone.
  for (const auto& [lower, upper, tolerance] : {std::tuple{4, 4, 1e-6}, std::tuple{4, 6, 0.02}}) {
    Bench bench;
    stack(bench, lower, upper, {kYoung, 0}, {kYoung, 0});
    bench.shift_held(1, {0, 0, -0.004});
    const int steps = bench.settle(1e-9);
    const double exact = kYoung * 0.06 * 0.06 * 0.004 / 0.08;
    const double force = -bench.support(1).z();
    std::printf("[ %d on %d cells ] force %.6f N, bar %.6f N, deepest %.2e m, %d steps\n", upper, lower, force, exact,
                bench.contact().report().deepest, steps);
    EXPECT_LE(steps, 400);
    EXPECT_NEAR(force, exact, tolerance * exact);
    EXPECT_LT(bench.contact().report().deepest, 1e-8);
  }
}

TEST(OrganContact, ForcesAndMomentsOnTheBodiesAreOpposite) {
  Bench bench;
  stack(bench, 4, 5, {kYoung, 0.45}, {3 * kYoung, 0.3}, 0.04);
  bench.shift_held(1, {0.003, 0, -0.005});
  bench.settle(1e-11);
  Eigen::Vector3d force[2], moment[2];
  for (std::size_t b = 0; b < 2; ++b) {
    force[b] = moment[b] = Eigen::Vector3d::Zero();
    for (const SurfaceRow& row : bench.contact().rows()) {
      for (const SurfaceRow::Support& support : row.supports) {
        if (support.body != static_cast<int>(b)) continue;
        const Eigen::Vector3d f = support.weight * row.lambda * row.normal;
        force[b] += f;
        moment[b] += bench.positions(b).col(support.node).cross(f);
      }
    }
  }
  EXPECT_GT(force[1].norm(), 0.1);
  EXPECT_LT((force[0] + force[1]).norm(), 1e-12);
  EXPECT_LT((moment[0] + moment[1]).norm(), 1e-9);
}

TEST(OrganContact, RowsAreTheGradientOfTheGap) {
  // Virtual work: the gap between flat faces changes by H dp for any small motion of the nodes.
  Bench bench;
  stack(bench, 4, 5, {kYoung, 0.3}, {kYoung, 0.3}, 0.04);
  std::vector<Eigen::Matrix3Xd> moved{bench.positions(0), bench.positions(1)};
  bench.update(moved);
  const std::vector<SurfaceRow> before(bench.contact().rows().begin(), bench.contact().rows().end());
  ASSERT_GT(before.size(), 20u);
  // Affine motions: faces stay flat, so that their normals are exact.
  const double small = 1e-6;
  Eigen::Matrix3d tilt;
  tilt << 0, 0, 0.5, 0, 0, -0.3, 0.2, -0.4, 0.1;
  const std::vector<Eigen::Matrix3Xd> change{small * tilt * bench.positions(0), small * bench.positions(1)};
  for (std::size_t b = 0; b < 2; ++b) moved[b] += change[b];
  bench.update(moved);
  int compared = 0;
  for (const SurfaceRow& after : bench.contact().rows()) {
    for (const SurfaceRow& row : before) {
      if (row.slot != after.slot) continue;
      double predicted = 0;
      for (const SurfaceRow::Support& support : row.supports) {
        predicted += support.weight * row.normal.dot(change[support.body].col(support.node));
      }
      EXPECT_NEAR(after.gap - row.gap, predicted, 1e-4 * small);
      ++compared;
    }
  }
  EXPECT_GT(compared, 20);
}

TEST(OrganContact, SlidesWithoutResistance) {
  // A stiff slider pressed into a soft block and pushed sideways: bonded, it would be held by G A / L per metre.
  Bench bench;
  stack(bench, 6, 4, {kYoung, 0.3}, {1e3 * kYoung, 0.3}, 0.03);
  bench.shift_held(1, {0, 0, -0.002});
  bench.settle(1e-8);
  const Eigen::Vector3d pressed = bench.support(1);
  bench.shift_held(1, {0.006, 0, 0});
  const int steps = bench.settle(1e-8);
  const Eigen::Vector3d slid = bench.support(1);
  const double bonded = kYoung / 2.6 * 0.03 * 0.03 * 0.006 / 0.04;
  std::printf("[ slid 6 mm ] normal %.4f -> %.4f N, tangential %.2e N (bonded: about %.2f N), %d steps\n",
              -pressed.z(), -slid.z(), slid.x(), bonded, steps);
  EXPECT_GT(-slid.z(), 0.5 * -pressed.z());
  // The rest is the lean of the dent: it is not in the middle of the block any more.
  EXPECT_LT(std::abs(slid.x()), 0.1 * bonded);
}

TEST(OrganContact, LetsGoWithoutPulling) {
  Bench bench;
  stack(bench, 4, 5, {kYoung, 0.4}, {kYoung, 0.4});
  bench.shift_held(1, {0, 0, -0.004});
  bench.settle(1e-8);
  EXPECT_GT(bench.contact().report().pressing, 10);
  bench.shift_held(1, {0, 0, 0.006});
  bench.settle(1e-10);
  EXPECT_EQ(bench.contact().report().pressing, 0);
  EXPECT_LT(bench.support(0).norm(), 1e-6);
  EXPECT_LT((bench.positions(0) - rest_positions(bench.model(0))).cwiseAbs().maxCoeff(), 1e-8);
}

TEST(OrganContact, OverlapOfTheMeshesAtRestIsNoForce) {
  Bench bench;
  const TetMesh below = block(0, 4);
  const TetMesh above = block(0.038, 5);
  bench.add(below, {kYoung, 0.4}, at_height(below, 0));
  bench.add(above, {kYoung, 0.4}, at_height(above, 0.078));
  bench.touch({.pairs = {{.nodes_of = 1, .surface_of = 0}}});
  bench.settle(1e-12);
  EXPECT_GT(bench.contact().report().rows, 20);
  EXPECT_EQ(bench.contact().report().force_n, 0);
  bench.shift_held(1, {0, 0, -0.001});
  bench.settle(1e-8);
  EXPECT_GT(bench.contact().report().force_n, 0.1);
}

TEST(OrganContact, WhatComesFromAfarIsFoundAsIfAllHadBeenLookedAt) {
  // A block that flies over another, tilted, at up to 6 mm an update, and never quite touches it.
  for (const double pace : {0.05, 0.4, 2.0}) {
    Bench bench;
    stack(bench, 4, 5, {kYoung, 0.3}, {kYoung, 0.3}, 0.04);
    int rows = 0, without = 0;
    for (int k = 0; k < 60; ++k) {
      const double phase = pace * k;
      const Eigen::Matrix3d tilt =
          Eigen::AngleAxisd(0.05 * std::sin(1.7 * phase), Eigen::Vector3d(1, 0.5, 0).normalized()).toRotationMatrix();
      const Eigen::Vector3d pivot(0, 0, 0.04);
      const Eigen::Vector3d by(0.01 * std::sin(phase), 0, 0.0085 + 0.007 * std::cos(1.3 * phase));
      std::vector<Eigen::Matrix3Xd> moved{bench.positions(0), bench.positions(1)};
      moved[1] = (tilt * (bench.positions(1).colwise() - pivot)).colwise() + (pivot + by);
      bench.update(moved);
      Bench fresh;
      stack(fresh, 4, 5, {kYoung, 0.3}, {kYoung, 0.3}, 0.04);
      fresh.update(moved);
      ASSERT_EQ(fresh.contact().report().pressing, 0);
      const auto found = bench.contact().rows(), all = fresh.contact().rows();
      ASSERT_EQ(found.size(), all.size()) << "update " << k << " at pace " << pace;
      for (std::size_t i = 0; i < all.size(); ++i) {
        EXPECT_EQ(found[i].slot, all[i].slot);
        EXPECT_EQ(found[i].gap, all[i].gap);
      }
      rows += static_cast<int>(all.size());
      without += all.empty() ? 1 : 0;
    }
    EXPECT_GT(rows, 50);
    EXPECT_GT(without, 10);
  }
}

TEST(OrganContact, RefusesABodyThatDoesNotExist) {
  Bench bench;
  const TetMesh mesh = block(0, 2);
  bench.add(mesh, {kYoung, 0.4}, at_height(mesh, 0));
  EXPECT_THROW(bench.touch({.pairs = {{.nodes_of = 0, .surface_of = 1}}}), std::invalid_argument);
  EXPECT_THROW(bench.touch({.pairs = {{.nodes_of = 0, .surface_of = 0}}}), std::invalid_argument);
}

TEST(ProbeShape, DistanceIsExactOnTheFaceAndItsGradientOnTheWay) {
  const ProbeShape shape{
      .face_radius = 0.06, .half_width = 0.035, .half_height = 0.01, .length = 0.08, .rounding = 0.003};
  for (double x = -0.02; x <= 0.02; x += 0.004) {
    for (const double h : {-0.002, 0.0, 0.001, 0.004}) {
      const double angle = x / 0.06;
      const Eigen::Vector3d out(std::sin(angle), 0, std::cos(angle));
      const Eigen::Vector3d at = (0.06 + h) * out - Eigen::Vector3d(0, 0, 0.06) + Eigen::Vector3d(0, 0.003, 0);
      EXPECT_NEAR(shape.distance(at).value, h, 1e-12);
      EXPECT_LT((shape.distance(at).gradient - out).norm(), 1e-9);
    }
  }
  // Beside the rim the gradient still is the derivative (the arc's curvature aside).
  const Eigen::Vector3d rim(0.01, 0.0115, 0.001);
  Eigen::Vector3d difference;
  for (int a = 0; a < 3; ++a) {
    const Eigen::Vector3d step = 1e-6 * Eigen::Vector3d::Unit(a);
    difference[a] = (shape.distance(rim + step).value - shape.distance(rim - step).value) / 2e-6;
  }
  EXPECT_LT((difference - shape.distance(rim).gradient).norm(), 0.03);
}

/// Force of a cylinder (radius 60 mm, along y) pressed `depth` into a block through an elastic layer, by Newton's
/// method on dense textbook elements: the layer makes the pressure a function of the overlap, so no contact problem
/// is left to solve. `cuts`^2 points a face.
double dense_probe_force(const TetMesh& mesh, const ElasticMaterial& material, const std::vector<int>& held,
                         double top, double depth, int cuts, double layer, double thickness, double* area) {
  const std::vector<ElasticMaterial> materials(mesh.tets.size(), material);
  const support::DenseTissue dense(mesh, materials, held);
  // The upper faces of a Kuhn box: two triangles a cell of the top.
  std::vector<std::array<int, 3>> faces;
  for (const auto& tet : mesh.tets) {
    std::vector<int> up;
    for (const int n : tet) {
      if (std::abs(mesh.nodes[n].z() - top) < 1e-9) up.push_back(n);
    }
    if (up.size() == 3) faces.push_back({up[0], up[1], up[2]});
  }
  struct Point {
    std::array<int, 3> nodes;
    Eigen::Vector3d weights;
    double area;
  };
  std::vector<Point> points;
  for (const auto& f : faces) {
    const auto x = [&](int k) { return mesh.nodes[f[k]]; };
    const double whole = 0.5 * (x(1) - x(0)).cross(x(2) - x(0)).norm();
    for (int i = 0; i < 3 * cuts; ++i) {
      for (int j = 0; j < 3 * cuts; ++j) {  // centroids sit where i, j = 1 or 2 modulo 3 of a 3-fold finer lattice
        const bool upright = i % 3 == 1 && j % 3 == 1, inverted = i % 3 == 2 && j % 3 == 2;
        if ((!upright && !inverted) || i + j > 3 * cuts - 1) continue;
        const double u = i / (3.0 * cuts), v = j / (3.0 * cuts);
        points.push_back({f, {u, v, 1 - u - v}, whole / (cuts * cuts)});
      }
    }
  }
  EXPECT_EQ(points.size(), faces.size() * static_cast<std::size_t>(cuts * cuts));
  const Eigen::Vector3d axis(0, 0, top - depth + 0.06);  // the cylinder lies above
  Eigen::VectorXd p = dense.rest();
  const std::vector<int>& dofs = dense.free_dofs();
  double force = 0;
  for (int iteration = 0; iteration < 200; ++iteration) {
    Eigen::VectorXd residual = -dense.forces(p);
    Eigen::MatrixXd stiffness = dense.stiffness(p);
    force = 0;
    *area = 0;
    for (const Point& point : points) {
      Eigen::Vector3d x = Eigen::Vector3d::Zero();
      for (int a = 0; a < 3; ++a) x += point.weights[a] * p.segment<3>(3 * point.nodes[a]);
      Eigen::Vector3d n = x - axis;
      n.y() = 0;
      // At rest, where Newton's method starts, the block is deeper in the cylinder than any pressure brings it.
      const double overlap = std::min(0.06 - n.norm(), 0.9 * thickness);
      if (overlap <= 0) continue;
      n.normalize();
      // overlap = q / sqrt(1 + (q / thickness)^2), q = layer * pressure
      const double full = 1 - overlap * overlap / (thickness * thickness);
      const double push = point.area / layer * overlap / std::sqrt(full);
      const double k = push / (overlap * full);
      force += push * -n.z();
      *area += point.area;
      for (int a = 0; a < 3; ++a) {
        const int row = 3 * point.nodes[a];
        residual.segment<3>(row) += point.weights[a] * push * n;
        for (int b = 0; b < 3; ++b) {
          stiffness.block<3, 3>(row, 3 * point.nodes[b]) +=
              point.weights[a] * point.weights[b] * k * n * n.transpose();
        }
      }
    }
    const auto n = static_cast<Eigen::Index>(dofs.size());
    Eigen::MatrixXd reduced(n, n);
    Eigen::VectorXd right(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      right[i] = residual[dofs[i]];
      for (Eigen::Index j = 0; j < n; ++j) {
        reduced(i, j) = stiffness(dofs[i], dofs[j]);
      }
    }
    const Eigen::VectorXd step = reference::solve(reduced, right);
    for (Eigen::Index i = 0; i < n; ++i) p[dofs[i]] += step[i];
    if (step.cwiseAbs().maxCoeff() < 1e-10) break;
  }
  return force;
}

TEST(OrganContact, ProbePressedFiveMillimetresMatchesADenseReference) {
  constexpr double kThin = 0.0005;  // m: of a layer that is pressed to a good part of it, so that its law counts
  const TetMesh mesh = reference::kuhn_box({-0.05, -0.03, 0}, {0.05, 0.03, 0.04}, {10, 4, 4});
  const std::vector<int> held = at_height(mesh, 0);
  Bench bench;
  bench.add(mesh, {kYoung, 0.4}, held);
  OrganContactSettings settings;
  settings.probe = ProbeContactSettings{
      .shape = {.face_radius = 0.06, .half_width = 0.06, .half_height = 0.05, .length = 0.08, .rounding = 0.003},
      .body = 0,
      .point_spacing = 0.006,
      .layer_compliance = 5e-8,
      .layer_thickness = kThin,
      .max_points = 640};
  bench.touch(settings);
  RigidPose pose;
  pose.position = Eigen::Vector3d(0, 0, 0.04 - 0.005);
  pose.orientation = Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()));  // +Z downwards
  const int steps = bench.settle(1e-8, &pose);
  const ProbeContact& probe = bench.contact().probe();
  ASSERT_EQ(bench.contact().report().left_out, 0);

  // As many points a face as the subject chose: the mean first edge over the spacing.
  double area = 0;
  int cuts = 0;
  double best = 1e9, reference = 0;
  for (int n = 1; n <= 4; ++n) {
    double a = 0;
    const double force = dense_probe_force(mesh, {kYoung, 0.4}, held, 0.04, 0.005, n, 5e-8, kThin, &a);
    std::printf("[ dense, %2d points a face ] %.6f N on %.1f mm^2\n", n * n, force, 1e6 * a);
    if (std::abs(force - probe.wrench.force.z()) < best) {
      best = std::abs(force - probe.wrench.force.z());
      reference = force;
      area = a;
      cuts = n;
    }
  }
  std::printf(
      "[ probe, 5 mm deep ] %.6f N on %.1f mm^2, %d points, %d steps; dense (%d^2 points) %.6f N on %.1f mm^2\n",
      probe.wrench.force.z(), 1e6 * probe.area, probe.points, steps, cuts, reference, 1e6 * area);
  EXPECT_LE(steps, 400);
  EXPECT_NEAR(probe.wrench.force.z(), reference, 1e-5 * reference);
  EXPECT_NEAR(probe.area, area, 1e-9);
  EXPECT_LT(std::hypot(probe.wrench.force.x(), probe.wrench.force.y()), 0.02 * reference);
  EXPECT_NEAR(bench.support(0).z(), reference, 1e-4 * reference);
  // Less than where the undeformed block would reach (2 sqrt(2 R d) wide), more than a third of it.
  const double reached = 2 * std::sqrt(2 * 0.06 * 0.005) * 0.06;
  EXPECT_LT(probe.area, reached);
  EXPECT_GT(probe.area, reached / 3);
}

TEST(OrganContact, WhereTheProbeWillBeHeldALargeBodyIsKnownBeforehand) {
  // A large body's compliance is learnt node by node. Where the probe is held as planned, the first press finds all
  // of its points all the same.
  const TetMesh mesh = block(0, 6);
  RigidPose pose;
  pose.position = Eigen::Vector3d(0.002, 0, 0.04 - 0.003);
  pose.orientation = Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()));  // +Z downwards
  const auto rows = [&](int limit, bool planned) {
    Bench bench;
    bench.add(mesh, {kYoung, 0.4}, at_height(mesh, 0));
    OrganContactSettings settings;
    settings.learn_limit = limit;
    settings.large_dofs = 1;
    settings.probe.emplace();
    if (planned) settings.probe->held_at = Eigen::Vector3d(0, 0, 0.04);
    bench.touch(settings);
    bench.settle(0, &pose, 1);
    return bench.contact().report().rows;
  };
  const int all = rows(1000, false);
  EXPECT_GT(all, 20);
  EXPECT_LT(rows(1, false), all) << "one node a step";
  EXPECT_EQ(rows(1, true), all);
}

TEST(OrganContact, OnSkinThatNobodyPlannedForALargeBodyAnswersAsSoonAsASmallOne) {
  const TetMesh mesh = block(0, 12);
  const auto forces = [&](int large_dofs) {
    Bench bench;
    bench.add(mesh, {kYoung, 0.4}, at_height(mesh, 0));
    OrganContactSettings settings;
    settings.large_dofs = large_dofs;
    settings.probe.emplace();
    bench.touch(settings);
    RigidPose pose;
    pose.orientation = Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()));
    std::vector<double> found;
    for (int step = 0; step < 10; ++step) {  // 0.2 m/s along the skin, 4 mm deep
      pose.position = Eigen::Vector3d(-0.01 + std::min(0.02, 0.004 * step), 0, 0.04 - 0.004);
      bench.settle(0, &pose, 1);
      found.push_back(bench.support(0).z());
    }
    return found;
  };
  const std::vector<double> small = forces(1'000'000);
  EXPECT_GT(small[4], 0.8 * small.back());
  EXPECT_EQ(forces(1), small);
}

TEST(OrganContact, ProbeInTheAirTouchesNothing) {
  const TetMesh mesh = block(0, 3);
  Bench bench;
  bench.add(mesh, {kYoung, 0.4}, at_height(mesh, 0));
  OrganContactSettings settings;
  settings.probe.emplace();
  bench.touch(settings);
  RigidPose pose;
  pose.position = Eigen::Vector3d(0, 0, 0.0401);
  pose.orientation = Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()));
  EXPECT_EQ(bench.settle(1e-12, &pose), 1);
  EXPECT_EQ(bench.contact().probe().points, 0);
  EXPECT_EQ(bench.contact().probe().wrench.force.norm(), 0);
}

}  // namespace
}  // namespace stylet::physics
