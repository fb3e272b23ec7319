// Contact geometry, the Delassus operator and the constraint solver, against dense references.
#include "physics/contact/constraint_solver.h"
#include "physics/contact/delassus.h"
#include "physics/contact/shaft.h"
#include "physics/contact/tissue_points.h"
#include "tests/physics/haptic_loop_synthetic_patch.h"
#include "tools/reference/dense_algebra.h"

#include <gtest/gtest.h>

#include <cstdio>
#include <numbers>

namespace stylet::physics {
namespace {

using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

// A quarter circle in the xz plane: as bent as a needle never gets.
Eigen::Matrix3Xd quarter_circle(int beams) {
  Eigen::Matrix3Xd nodes(3, beams + 1);
  for (int i = 0; i <= beams; ++i) {
    const double a = std::numbers::pi / 2 * i / beams;
    nodes.col(i) = 0.1 * Vector3d(1 - std::cos(a), 0, std::sin(a));
  }
  return nodes;
}

TEST(Shaft, ProjectionIsTheNearestPointOfAFineSampling) {
  const Eigen::Matrix3Xd nodes = quarter_circle(8);
  std::srand(1);
  for (int trial = 0; trial < 200; ++trial) {
    const Vector3d point = Vector3d(0.03, 0, 0.07) + 0.05 * Vector3d::Random();
    const ShaftPoint p = project_on_shaft(nodes, point);
    double nearest = 1;
    for (int s = 0; s <= 8000; ++s) {
      const int beam = std::min(s / 1000, 7);
      const double f = s / 1000.0 - beam;
      nearest = std::min(nearest, ((1 - f) * nodes.col(beam) + f * nodes.col(beam + 1) - point).norm());
    }
    EXPECT_NEAR(p.distance, nearest, 1e-6);
    EXPECT_NEAR((p.position - point).norm(), p.distance, 1e-15);
    EXPECT_TRUE(p.beam_fraction >= 0 && p.beam_fraction <= 1);
  }
}

TEST(Shaft, ReportsPointsBeyondItsEnds) {
  const Eigen::Matrix3Xd nodes = quarter_circle(8);
  const Vector3d end = (nodes.col(8) - nodes.col(7)).normalized();
  const Vector3d start = (nodes.col(1) - nodes.col(0)).normalized();
  EXPECT_TRUE(project_on_shaft(nodes, nodes.col(8) + 1e-6 * end).ahead_of_tip);
  EXPECT_FALSE(project_on_shaft(nodes, nodes.col(8) - 1e-6 * end).ahead_of_tip);
  EXPECT_TRUE(project_on_shaft(nodes, nodes.col(0) - 1e-6 * start).behind_hub);
  EXPECT_FALSE(project_on_shaft(nodes, nodes.col(0) + 1e-6 * start).behind_hub);
}

// The hub turns through every orientation, z up and down included, where a fixed global axis would flip the frame.
TEST(Shaft, DirectionsNeverFlipWhateverWayTheNeedleTurns) {
  for (const Vector3d& axis : {Vector3d(1, 0, 0), Vector3d(0, 1, 0), Vector3d(0.6, 0.48, 0.64)}) {
    Eigen::Matrix<double, 3, 2> previous;
    for (int i = 0; i <= 360; ++i) {
      const Eigen::Quaterniond q(Eigen::AngleAxisd(i * std::numbers::pi / 180, axis));
      const Vector3d tangent = q * Vector3d(0.05, -0.03, 1).normalized();  // edge and node differ by bending
      const auto d = lateral_directions(tangent, q);
      EXPECT_LT((d.transpose() * d - Eigen::Matrix2d::Identity()).norm(), 1e-14);
      EXPECT_LT((d.transpose() * tangent).norm(), 1e-15);
      EXPECT_GT(d.col(0).cross(d.col(1)).dot(tangent), 0.999);
      if (i > 0) {
        EXPECT_LT((d - previous).norm(), 1.5 * std::numbers::pi / 180);
      }
      previous = d;
    }
  }
}

struct Scene {
  NeedleProperties properties;
  NeedleBase base;
  StylusPose hub{Vector3d(0.01, 0.02, -0.03),
                 Eigen::Quaterniond(Eigen::AngleAxisd(0.7, Vector3d(1, -1, 0.3).normalized()))};
  NeedleShape shape = straight_needle(properties, hub);
  NeedleState state;
  TissuePatch patch;
  TissuePoints tissue;
  std::vector<ActiveContact> contacts;

  explicit Scene(BaseKind kind) {
    base.kind = kind;
    state.node_count = shape.node_count;
    state.positions.leftCols(shape.node_count) = shape.nodes();
    for (int i = 0; i < shape.node_count; ++i) state.orientations[i] = shape.orientation(i);
    patch.epoch = 1;
    patch.body_count = 2;  // one over the first beam, where the base matters; one deeper
    testing::lay_synthetic_body(patch.bodies[0], state, 5, 0.05, 0.5, 1);
    testing::lay_synthetic_body(patch.bodies[1], state, 4, 0.6, 0.95, 2);
    EXPECT_TRUE(tissue.load(patch));
    for (int i = 0; i < tissue.count(); ++i) {
      const ShaftPoint p = project_on_shaft(shape.nodes(), tissue.position(i));
      contacts.push_back(lateral_contact(i, 2 * i, p, lateral_directions(p.tangent, shape.orientation(p.beam))));
    }
  }
};

// The reference writes H out in full, one column a degree of freedom, and inverts dense matrices.
TEST(Delassus, MatchesDenseProductsWithInverses) {
  for (const BaseKind kind : {BaseKind::prescribed, BaseKind::spring_damper}) {
    Scene scene(kind);
    Needle needle(scene.properties, scene.base);
    ASSERT_TRUE(needle.linearise(scene.shape, scene.hub, 1e-3));
    Delassus delassus(needle.node_count(), kMaxRows);
    const int count = static_cast<int>(scene.contacts.size());
    delassus.assemble(needle, scene.tissue, scene.contacts, count);

    const int dofs = 6 * needle.node_count(), rows = 2 * count;
    MatrixXd a = MatrixXd::Zero(dofs, dofs);
    Beam beam;
    beam.length = needle.beam_length();
    beam.rest_frame << Vector3d::UnitZ(), Vector3d::UnitX(), Vector3d::UnitY();
    beam.section = tube_section(1.27e-3, 0.838e-3, 200e9, 0.3);
    for (int i = 0; i + 1 < needle.node_count(); ++i) {
      a.block<12, 12>(6 * i, 6 * i) +=
          beam_response(beam, {scene.shape.positions.col(i), scene.shape.orientation(i).toRotationMatrix()},
                        {scene.shape.positions.col(i + 1), scene.shape.orientation(i + 1).toRotationMatrix()})
              .tangent;
    }
    const int first = kind == BaseKind::prescribed ? 6 : 0;
    if (first == 0) {
      a.diagonal().head<3>().array() += scene.base.stiffness;
      a.diagonal().segment<3>(3).array() += scene.base.rotational_stiffness;
    }
    MatrixXd hn = MatrixXd::Zero(rows, dofs);
    MatrixXd w = MatrixXd::Zero(rows, rows);
    MatrixXd hv[2];
    for (int b = 0; b < 2; ++b) hv[b] = MatrixXd::Zero(rows, 3 * scene.patch.bodies[b].node_count);
    int c = 0;
    for (int b = 0; b < 2; ++b) {
      for (int k = 0; k < scene.patch.bodies[b].contact_count; ++k, ++c) {
        const PatchContact& laid = scene.patch.bodies[b].contacts[k];
        for (int d = 0; d < 2; ++d) {
          const Eigen::RowVector3d n = laid.directions.col(d).transpose();
          hn.block<1, 3>(2 * c + d, 6 * laid.beam) += (1 - laid.beam_fraction) * n;
          hn.block<1, 3>(2 * c + d, 6 * (laid.beam + 1)) += laid.beam_fraction * n;
          for (int v = 0; v < 4; ++v)
            hv[b].block<1, 3>(2 * c + d, 3 * laid.patch_nodes[v]) -= laid.barycentric[v] * n;
        }
      }
    }
    double tissue_trace = 0;
    for (int b = 0; b < 2; ++b) {
      w += reference::product(hv[b], reference::product(scene.patch.bodies[b].w_bar(), hv[b].transpose()));
      tissue_trace = w.trace();
    }
    const MatrixXd free = hn.rightCols(dofs - first);
    w +=
        reference::product(free, reference::solve(a.bottomRightCorner(dofs - first, dofs - first), free.transpose()));
    const MatrixXd lower = MatrixXd(delassus.matrix()).triangularView<Eigen::Lower>();
    const double error = (lower - MatrixXd(w.triangularView<Eigen::Lower>())).norm() / w.norm();
    const VectorXd eigenvalues = reference::symmetric_eigenvalues(w);
    std::printf("relative difference %.1e, condition %.1e\n", error, eigenvalues[rows - 1] / eigenvalues[0]);
    EXPECT_LT(error, 1e-10);
    EXPECT_NEAR(delassus.mean_tissue_compliance() * rows / tissue_trace, 1, 1e-12);

    // forces go where violations are measured: load = H_n^T lambda
    const VectorXd lambda = VectorXd::Random(rows);
    VectorXd load(dofs);
    needle_load(scene.contacts, count, lambda, load);
    EXPECT_LT((load - hn.transpose() * lambda).norm(), 1e-14);
  }
}

TEST(TissuePoints, MoveAsTheIsolatedNodesUnderThem) {
  Scene scene(BaseKind::prescribed);
  const int count = static_cast<int>(scene.contacts.size());
  const VectorXd lambda = VectorXd::Random(2 * count);
  scene.tissue.apply(scene.contacts, count, lambda);
  int point = 0;
  double worst = 0;
  for (int b = 0; b < 2; ++b) {  // x_iso = x_free + W_bar H_v^T lambda, then barycentric
    const BodyPatch& body = scene.patch.bodies[b];
    const int n = body.node_count;
    VectorXd f = VectorXd::Zero(3 * n);
    for (int k = 0; k < body.contact_count; ++k) {
      const int row = 2 * (point + k);
      const Vector3d force = -(scene.contacts[point + k].rows() * lambda.segment<2>(row));
      for (int v = 0; v < 4; ++v) {
        f.segment<3>(3 * body.contacts[k].patch_nodes[v]) += body.contacts[k].barycentric[v] * force;
      }
    }
    const VectorXd moved = body.w_bar() * f;
    for (int k = 0; k < body.contact_count; ++k, ++point) {
      Vector3d x = Vector3d::Zero();
      for (int v = 0; v < 4; ++v) {
        const int node = body.contacts[k].patch_nodes[v];
        x += body.contacts[k].barycentric[v] * (body.free_positions.col(node) + moved.segment<3>(3 * node));
      }
      worst = std::max(worst, (x - scene.tissue.position(point)).norm());
    }
  }
  std::printf("worst difference %.1e m\n", worst);
  EXPECT_LT(worst, 1e-15);
}

TEST(TissuePoints, KeepDisplacedPositionsOverANewPatch) {
  Scene scene(BaseKind::prescribed);
  const int count = static_cast<int>(scene.contacts.size());
  scene.tissue.apply(scene.contacts, count, VectorXd::Random(2 * count));
  Eigen::Matrix3Xd before(3, count);
  for (int i = 0; i < count; ++i) before.col(i) = scene.tissue.position(i);
  scene.patch.epoch = 2;
  EXPECT_TRUE(scene.tissue.load(scene.patch));
  for (int i = 0; i < count; ++i) EXPECT_LT((scene.tissue.position(i) - before.col(i)).norm(), 1e-15);
}

TEST(TissuePoints, LeaveOutTheShallowestBeyondCapacity) {
  Scene scene(BaseKind::prescribed);
  TissuePatch patch;
  patch.epoch = 1;
  patch.body_count = 2;
  testing::lay_synthetic_body(patch.bodies[0], scene.state, 80, 0.1, 0.5, 1);
  testing::lay_synthetic_body(patch.bodies[1], scene.state, 40, 0.6, 0.9, 2);
  EXPECT_FALSE(scene.tissue.load(patch));
  ASSERT_EQ(scene.tissue.count(), kMaxContacts);
  EXPECT_EQ(scene.tissue.contact(0).id, patch.bodies[0].contacts[24].id);
  EXPECT_EQ(scene.tissue.contact(kMaxContacts - 1).id, patch.bodies[1].contacts[39].id);
}

TEST(ConstraintSolver, MatchesPivotedSolve) {
  ConstraintSolver solver(kMaxRows);
  for (int m : {1, 2, 16, 64, 192}) {
    const MatrixXd q = MatrixXd::Random(m, m + 3);
    const MatrixXd w = reference::product(q, q.transpose()) + MatrixXd::Identity(m, m);
    const VectorXd delta = VectorXd::Random(m);
    VectorXd lambda = VectorXd::Zero(m);
    ASSERT_TRUE(solver.solve(w.triangularView<Eigen::Lower>().toDenseMatrix(), 0.25, delta, lambda));
    const VectorXd exact = reference::solve(w + 0.25 * MatrixXd::Identity(m, m), -delta);
    EXPECT_LT((lambda - exact).norm(), 1e-12 * exact.norm()) << m << " rows";
  }
}

TEST(ConstraintSolver, RefusesDependentRowsUnlessTheyAreSoftened) {
  ConstraintSolver solver(kMaxRows);
  const MatrixXd q = MatrixXd::Random(6, 4);  // rank 4
  const MatrixXd w = reference::product(q, q.transpose());
  const VectorXd delta = VectorXd::Random(6);
  VectorXd lambda = VectorXd::Constant(6, 42);
  EXPECT_FALSE(solver.solve(w, 0, delta, lambda));
  EXPECT_EQ(lambda, VectorXd::Constant(6, 42)) << "untouched on failure";
  EXPECT_TRUE(solver.solve(w, 1e-3, delta, lambda));
  EXPECT_LT(((w + 1e-3 * MatrixXd::Identity(6, 6)) * lambda + delta).norm(), 1e-12 * lambda.norm());
  MatrixXd bad = w + MatrixXd::Identity(6, 6);
  bad(4, 2) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(solver.solve(bad, 0, delta, lambda));
}

// A pivot is by how much a row yields with the rows before it held: one over the last diagonal entry of the inverse
// of the leading block.
TEST(ConstraintSolver, SmallestPivotMeasuresTheDependenceOfRows) {
  ConstraintSolver solver(kMaxRows);
  VectorXd lambda(12);
  const VectorXd delta = VectorXd::Random(12);
  const MatrixXd q = MatrixXd::Random(12, 15);
  const MatrixXd w = reference::product(q, q.transpose());
  double smallest = 1e300;
  for (int m = 1; m <= 12; ++m) {
    smallest = std::min(smallest, 1 / reference::inverse(w.topLeftCorner(m, m))(m - 1, m - 1));
    ASSERT_TRUE(solver.solve(w.topLeftCorner(m, m), 0, delta.head(m), lambda));
    EXPECT_NEAR(solver.smallest_pivot(), smallest, 1e-10 * smallest) << m << " rows";
  }
  MatrixXd near = q;  // row 7 is row 2 but for one part in a million
  near.row(7) = q.row(2) + 1e-6 * q.row(7);
  ASSERT_TRUE(solver.solve(reference::product(near, near.transpose()), 0, delta, lambda));
  EXPECT_LT(solver.smallest_pivot(), 1e-10 * w.diagonal().mean());
  ASSERT_TRUE(solver.solve(reference::product(near, near.transpose()), 0.5, delta, lambda));
  EXPECT_GE(solver.smallest_pivot(), 0.5);
}

}  // namespace
}  // namespace stylet::physics
