// Friction of the probe on the skin: sticks, slides at its bound, drags the skin along, makes no energy.
#include "tests/physics/contact_bench.h"
#include "tests/support/sanitized.h"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

namespace stylet::physics {
namespace {

using tests::at_height;
using tests::block;
using tests::kYoung;
using Bench = tests::ContactBench;

/// Face downwards at a place.
RigidPose facing_down(const Eigen::Vector3d& at) {
  RigidPose pose;
  pose.position = at;
  pose.orientation = Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()));
  return pose;
}

/// A tetrahedron standing on its base with the tip free, under a flat face: one point of contact.
void one_point(Bench& bench, double friction) {
  TetMesh mesh;
  mesh.nodes = {{0, 0, 0}, {0.03, 0, 0}, {0.01, 0.03, -0.02}, {0.012, 0.01, 0.03}};
  mesh.tets = {{0, 1, 2, 3}};
  bench.add(mesh, {kYoung, 0.3}, {0, 1, 2});
  OrganContactSettings settings;
  settings.probe = ProbeContactSettings{.shape = {.face_radius = 0, .half_width = 0.1, .half_height = 0.1},
                                        .point_spacing = 1,
                                        .friction = friction,
                                        .max_points = 1};
  bench.touch(settings);
}

/// Pose over the single point of one_point(), 1 mm deep: the highest centroid of a face is at z = 10 mm.
RigidPose one_millimetre_deep() {
  return facing_down({0.01, 0.01, 0.009});
}

TEST(ProbeFriction, OnePointBelowTheBoundSticks) {
  Bench bench;
  one_point(bench, 2);
  RigidPose pose = one_millimetre_deep();
  ASSERT_LE(bench.settle(1e-13, &pose), 400);
  ASSERT_EQ(bench.contact().rows().size(), 1U);
  const SurfaceRow before = bench.contact().rows().front();
  const Eigen::Vector3d resting = bench.support(0);
  pose.position += Eigen::Vector3d(3e-4, -1e-4, 0);
  ASSERT_LE(bench.settle(1e-13, &pose), 400);
  const Eigen::Vector3d dragged = bench.support(0);
  // The support feels the friction, through the tip a third of it: the face's other corners are held. The point goes
  // with the probe but for the yield of the layer.
  EXPECT_GT(std::hypot(dragged.x(), dragged.y()), 2e-3);
  EXPECT_LT(std::hypot(dragged.x(), dragged.y()), 0.99 * 2 * dragged.z());
  EXPECT_EQ(bench.contact().probe().sliding, 0);
  const Eigen::Vector3d moved = bench.contact().rows().front().position - before.position;
  EXPECT_NEAR(moved.x(), 3e-4 + 3 * before.shear_compliance * (dragged - resting).x(), 1e-11);
  EXPECT_NEAR(moved.y(), -1e-4 + 3 * before.shear_compliance * (dragged - resting).y(), 1e-11);
}

TEST(ProbeFriction, OnePointSlidesAtTheBoundExactly) {
  constexpr double kFriction = 0.4;
  Bench bench;
  one_point(bench, kFriction);
  RigidPose pose = one_millimetre_deep();
  for (const Eigen::Vector3d& way : {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(-1, 0, 0), Eigen::Vector3d(0, 1, 0)}) {
    for (int i = 0; i < 40; ++i) {
      pose.position += 5e-4 * way;
      ASSERT_LE(bench.settle(1e-13, &pose), 400);
    }
    const Eigen::Vector3d slides = bench.support(0);
    std::printf("[ slides along %+.0f %+.0f ] friction %.9f N of %.9f N\n", way.x(), way.y(), slides.head<2>().norm(),
                kFriction * slides.z());
    EXPECT_EQ(bench.contact().probe().sliding, 1);
    EXPECT_NEAR(slides.head<2>().norm(), kFriction * slides.z(), 1e-9);
    EXPECT_NEAR(-slides.dot(way), kFriction * slides.z(), 1e-6) << "against the motion";
  }
}

TEST(ProbeFriction, AStuckPointRestsWhereItDoesWhateverTheFactor) {
  std::vector<Eigen::Vector3d> rest;
  for (const double pace : {1.0, 0.5, 0.25}) {
    Bench bench;
    one_point(bench, 10);
    RigidPose pose = facing_down({0.01, 0.01, 0.0095});
    bench.settle(1e-13, &pose);
    bench.pace = pace;
    pose.position += Eigen::Vector3d(4e-4, -3e-4, -1e-4);
    ASSERT_LE(bench.settle(1e-13, &pose), 400);
    rest.push_back(bench.support(0));
  }
  EXPECT_GT(rest[0].head<2>().norm(), 1e-3);
  EXPECT_LT((rest[1] - rest[0]).norm(), 1e-9);
  EXPECT_LT((rest[2] - rest[0]).norm(), 1e-9);
}

/// A block 40 mm high on the floor, to be pressed by the curved face of a probe.
void skin(Bench& bench, double friction, int cells = support::kSanitized ? 4 : 6) {
  const TetMesh mesh = block(0, cells, 0.08);
  bench.add(mesh, {kYoung, 0.4}, at_height(mesh, 0));
  OrganContactSettings settings;
  settings.probe = ProbeContactSettings{.shape = {}, .point_spacing = 0.006, .friction = friction, .max_points = 400};
  bench.touch(settings);
}

/// Moves the pose by `way` in `steps`, at rest after each. @return work of the hand, J
double move(Bench& bench, RigidPose& pose, const Eigen::Vector3d& way, int steps, double tolerance = 1e-7) {
  double work = 0;
  for (int i = 0; i < steps; ++i) {
    const Eigen::Vector3d before = bench.contact().probe().wrench.force;
    pose.position += way / steps;
    EXPECT_LE(bench.settle(tolerance, &pose), 400);
    work -= 0.5 * (before + bench.contact().probe().wrench.force).dot(way / steps);
  }
  return work;
}

/// How far the top of the block under the face has moved along y, m.
double dragged(const Bench& bench) {
  const TetMesh& mesh = bench.model(0).mesh;
  double sum = 0;
  int count = 0;
  for (int n = 0; n < bench.model(0).node_count(); ++n) {
    const Eigen::Vector3d& x = mesh.nodes[n];
    if (std::abs(x.z() - 0.04) > 1e-9 || std::hypot(x.x(), x.y()) > 0.015) continue;
    sum += bench.positions(0)(1, n) - x.y();
    ++count;
  }
  return sum / count;
}

TEST(ProbeFriction, DryDragsTheSkinAlongGelHardly) {
  struct Drag {
    double skin = 0, friction = 0, normal = 0;
  };
  const auto drag = [](double friction) {
    Bench bench;
    skin(bench, friction, 6);
    RigidPose pose = facing_down({0, 0, 0.0405});
    move(bench, pose, {0, 0, -0.0045}, 9);
    const double before = dragged(bench);
    move(bench, pose, {0, 0.004, 0}, 20);
    const Eigen::Vector3d on_skin = -bench.contact().probe().wrench.force;
    double rubs = 0;  // what of it is friction: the dent leans against the face, too
    for (const SurfaceRow& row : bench.contact().rows()) {
      if (row.lambda > 0 && row.limit > 0) rubs += row.force().y() - row.lambda * row.normal.y();
    }
    std::printf(
        "[ mu %.2f ] dragged %.2f mm of 4, %.3f N sideways, %.3f N of it friction, %.3f N down, %d of %d points "
        "slide\n",
        friction, 1e3 * (dragged(bench) - before), on_skin.y(), rubs, -on_skin.z(), bench.contact().probe().sliding,
        bench.contact().probe().points);
    return Drag{dragged(bench) - before, rubs, -on_skin.z()};
  };
  const Drag none = drag(0);
  const Drag gel = drag(0.05);
  const Drag dry = drag(0.5);
  EXPECT_GT(dry.skin, 0.4 * 0.004);
  EXPECT_LT(gel.skin, 0.15 * 0.004);
  EXPECT_LT(none.skin, gel.skin);
  EXPECT_GT(dry.friction, 4 * gel.friction);
  EXPECT_EQ(none.friction, 0);
  // Most of it slides: mu of what presses, which is a little more than its part downwards.
  EXPECT_GT(gel.friction, 0.045 * gel.normal);
  EXPECT_LT(gel.friction, 0.06 * gel.normal);
}

TEST(ProbeFriction, ActionIsReactionInForceAndInMomentAboutTheFace) {
  // The body at rest needs from its support what the probe does to it: the support knows nothing of the contact.
  Bench bench;
  skin(bench, 0.5);
  RigidPose pose = facing_down({0.004, -0.003, 0.0405});
  move(bench, pose, {0, 0, -0.0035}, 5, 1e-9);
  move(bench, pose, {0.002, 0.003, 0}, 5, 1e-9);
  pose.orientation = Eigen::AngleAxisd(0.05, Eigen::Vector3d(0, 0.6, 0.8)) * pose.orientation;
  EXPECT_LE(bench.settle(1e-9, &pose), 400);
  const Eigen::Matrix3Xd forces = bench.internal(0);
  Eigen::Vector3d force = Eigen::Vector3d::Zero(), moment = Eigen::Vector3d::Zero();
  for (const int n : at_height(bench.model(0).mesh, 0)) {
    force += forces.col(n);
    moment += (bench.positions(0).col(n) - pose.position).cross(forces.col(n));
  }
  const Wrench& felt = bench.contact().probe().wrench;
  std::printf("[ wrench ] %.4f %.4f %.4f N, %.5f %.5f %.5f N m\n", felt.force.x(), felt.force.y(), felt.force.z(),
              felt.moment.x(), felt.moment.y(), felt.moment.z());
  EXPECT_GT(felt.force.head<2>().norm(), 0.1);
  EXPECT_GT(std::abs(felt.moment.z()), 1e-4) << "the turn about its axis is resisted";
  EXPECT_LT((force - felt.force).norm(), 1e-5);
  EXPECT_LT((moment - felt.moment).norm(), 1e-6);
}

TEST(ProbeFriction, EveryPointObeysCoulombAtRestWhateverTheFactor) {
  std::vector<Eigen::Vector3d> wrench;
  for (const double pace : {1.0, 0.5}) {
    Bench bench;
    skin(bench, 0.5);
    bench.pace = pace;
    RigidPose pose = facing_down({0, 0, 0.0405});
    move(bench, pose, {0, 0, -0.0045}, 9);
    move(bench, pose, {0.001, 0.003, 0}, 8, 1e-9);
    for (const SurfaceRow& row : bench.contact().rows()) {
      if (row.lambda <= 0) continue;
      EXPECT_LE(row.tangential.norm(), 0.5 * row.lambda * (1 + 1e-9));
      EXPECT_NEAR(row.gap + row.compliance * row.lambda, 0, 1e-7);
      if (row.tangential.norm() > 0.499 * row.lambda) continue;  // it slides
      EXPECT_LT((row.offset + row.shear_compliance * row.tangential).norm(), 1e-7);
    }
    wrench.push_back(bench.contact().probe().wrench.force);
  }
  // The way to rest is another, and with it which points slipped a little when they were first pressed.
  EXPECT_LT((wrench[1] - wrench[0]).norm(), 0.02 * wrench[0].norm());
}

TEST(ProbeFriction, NoEnergyIsGainedOverAClosedPath) {
  for (const double friction : {0.0, 0.05, 0.5}) {
    if (support::kSanitized && friction == 0.05) continue;
    Bench bench;
    skin(bench, friction, support::kSanitized ? 3 : 5);
    RigidPose pose = facing_down({0, 0, 0.0401});
    double work = 0, least = 0;
    const auto go = [&](const Eigen::Vector3d& way, int steps) {
      work += move(bench, pose, way, steps, 1e-6);
      least = std::min(least, work);
    };
    const double pressed = [&] {
      go({0, 0, -0.004}, 20);
      return work;
    }();
    for (int turn = 0; turn < (support::kSanitized ? 1 : 2); ++turn) {
      go({0, 0.003, 0}, 12);
      go({0.003, 0, 0}, 12);
      go({0, -0.003, 0}, 12);
      go({-0.003, 0, 0}, 12);
    }
    go({0, 0, 0.004}, 20);
    std::printf("[ mu %.2f ] pressed in with %.3f mJ, round and out again: %.4f mJ spent\n", friction, 1e3 * pressed,
                1e3 * work);
    // Trapezoids of steps of 0.25 mm: a hundredth of what was put in.
    EXPECT_GT(least, -0.01 * pressed);
    EXPECT_GT(work, friction > 0 ? 0.0 : -0.01 * pressed);
    if (friction == 0) {
      EXPECT_LT(work, 0.01 * pressed);
    } else if (friction > 0.4) {
      EXPECT_GT(work, (support::kSanitized ? 0.02 : 0.05) * pressed);
    }
  }
}

TEST(ProbeFriction, StaysFiniteFromNoneToTen) {
  for (const double friction : {0.0, 1e-6, 0.3, 1.0, 3.0, 10.0}) {
    if (support::kSanitized && friction > 0 && friction < 10) continue;
    Bench bench;
    skin(bench, friction, 4);
    RigidPose pose = facing_down({0, 0, 0.038});
    for (int i = 0; i < 120; ++i) {  // far too fast to come to rest: jerks, turns, tilts and jumps
      pose.position +=
          Eigen::Vector3d(0.002 * std::sin(0.9 * i), 0.003 * std::cos(1.7 * i), 0.001 * std::sin(0.5 * i));
      pose.orientation = Eigen::AngleAxisd(0.08 * std::sin(0.3 * i), Eigen::Vector3d(0.6, 0, 0.8)) * pose.orientation;
      bench.settle(1e-12, &pose, 1);
      const Wrench& felt = bench.contact().probe().wrench;
      ASSERT_TRUE(felt.force.allFinite() && felt.moment.allFinite());
      ASSERT_LT(felt.force.norm(), 200) << friction;
      ASSERT_TRUE(bench.positions(0).allFinite());
    }
    // And it comes to rest when it is taken away.
    pose.position.z() += 0.1;
    EXPECT_LE(bench.settle(1e-9, &pose), 100) << friction;
    EXPECT_EQ(bench.contact().probe().wrench.force.norm(), 0);
    EXPECT_LT((bench.positions(0) - rest_positions(bench.model(0))).cwiseAbs().maxCoeff(), 1e-8);
  }
}

}  // namespace
}  // namespace stylet::physics
