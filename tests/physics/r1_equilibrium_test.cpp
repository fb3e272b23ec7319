// Reference insertion R1 at rest: the two loops, with all their freezing and lagging, must come to the equilibrium of
// needle and tissue solved as one system.
#include "physics/needle/needle.h"
#include "tests/support/dense_tissue.h"
#include "tools/bench/reference_insertion.h"

#include <gtest/gtest.h>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include <cstdio>

namespace stylet::bench {
namespace {

using physics::NeedleContact;
using physics::NeedleState;

ReferenceInsertion r1() {
  return read_reference_insertion(std::filesystem::path(STYLET_SOURCE_DIR) / "content/reference/r1.json");
}

/// Needle, tissue and multipliers in one dense Newton iteration on the saddle-point system
///   [A_n  0  H_n^T; 0  K  H_v^T; H_n  H_v  0],
/// for the contact points of a NeedleState. The coupling and the tissue are written anew here; of the needle only its
/// linearisation is used (flexibility from unit loads), which has its own tests against beam theory.
class Monolithic {
public:
  Monolithic(const ReferenceInsertion& insertion, const NeedleState& state)
      : properties_(insertion.needle),
        hub_(insertion.base(insertion.duration)),
        needle_(properties_, {}),
        shape_(physics::straight_needle(properties_, hub_)),
        body_(insertion.body()),
        dense_(body_.mesh, body_.tet_materials, body_.fixed_nodes),
        contacts_(state.contacts.begin(), state.contacts.begin() + state.contact_count),
        tissue(dense_.rest()) {}

  /// @return residual, relative to the forces
  double solve() {
    double residual = 1;
    for (int i = 0; i < 60 && residual > 1e-14; ++i) residual = newton();
    return residual;
  }
  const physics::NeedleShape& shape() const { return shape_; }
  const support::DenseTissue& dense() const { return dense_; }

private:
  double newton() {
    const Eigen::Index free_beam = 6 * (needle_.node_count() - 1);  // node 0 is prescribed
    const auto n_tissue = static_cast<Eigen::Index>(dense_.free_dofs().size());
    const auto rows = static_cast<Eigen::Index>(2 * contacts_.size());
    needle_.linearise(shape_, hub_, 1e-3);
    Eigen::VectorXd load = Eigen::VectorXd::Zero(6 * needle_.node_count());
    Eigen::VectorXd free(load.size());
    Eigen::VectorXd moved(load.size());
    needle_.solve(load, free);
    Eigen::MatrixXd flexibility(free_beam, free_beam);
    for (Eigen::Index i = 0; i < free_beam; ++i) {
      load.setZero();
      load[6 + i] = 1;
      needle_.solve(load, moved);
      flexibility.col(i) = (moved - free).tail(free_beam);
    }

    const Eigen::Index size = free_beam + n_tissue + rows;
    Eigen::MatrixXd system = Eigen::MatrixXd::Zero(size, size);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(size);
    // First block row divided by A_n: x_n - flexibility H_n^T lambda = free.
    system.topLeftCorner(free_beam, free_beam).setIdentity();
    right.head(free_beam) = free.tail(free_beam);
    system.block(free_beam, free_beam, n_tissue, n_tissue) = dense_.free_stiffness(tissue);
    right.segment(free_beam, n_tissue) = -dense_.forces(tissue)(dense_.free_dofs());

    Eigen::MatrixXd h_n = Eigen::MatrixXd::Zero(rows, free_beam);
    Eigen::MatrixXd h_v = Eigen::MatrixXd::Zero(rows, tissue.size());
    for (Eigen::Index c = 0; c < rows / 2; ++c) {
      const NeedleContact& contact = contacts_[std::size_t(c)];
      const auto& tet = body_.mesh.tets[std::size_t(contact.tet)];
      Eigen::Vector3d x = Eigen::Vector3d::Zero();
      for (int a = 0; a < 4; ++a) x += contact.barycentric[a] * tissue.segment<3>(3 * tet[std::size_t(a)]);
      // Nearest edge of the needle.
      int beam = 0;
      double fraction = 0;
      double nearest = 1e300;
      for (int b = 0; b + 1 < shape_.node_count; ++b) {
        const Eigen::Vector3d p = shape_.positions.col(b);
        const Eigen::Vector3d e = shape_.positions.col(b + 1) - p;
        const double u = std::min(1.0, std::max(0.0, (x - p).dot(e) / e.squaredNorm()));
        if ((p + u * e - x).norm() < nearest) {
          nearest = (p + u * e - x).norm();
          beam = b;
          fraction = u;
        }
      }
      const Eigen::Vector3d on_shaft =
          (1 - fraction) * shape_.positions.col(beam) + fraction * shape_.positions.col(beam + 1);
      const Eigen::Vector3d edge = (shape_.positions.col(beam + 1) - shape_.positions.col(beam)).normalized();
      const Eigen::Vector3d n1 = edge.unitOrthogonal();
      const Eigen::Vector3d normals[2] = {n1, edge.cross(n1)};
      for (int d = 0; d < 2; ++d) {
        const Eigen::Index row = 2 * c + d;
        const Eigen::RowVector3d n = normals[d].transpose();
        if (beam > 0) h_n.block<1, 3>(row, 6 * (beam - 1)) = (1 - fraction) * n;
        h_n.block<1, 3>(row, 6 * beam) = fraction * n;
        for (int a = 0; a < 4; ++a) h_v.block<1, 3>(row, 3 * tet[std::size_t(a)]) = -contact.barycentric[a] * n;
        right[free_beam + n_tissue + row] = -n.dot(on_shaft - x);
      }
    }
    const Eigen::MatrixXd h_free = h_v(Eigen::all, dense_.free_dofs());
    system.block(0, free_beam + n_tissue, free_beam, rows) = -flexibility * h_n.transpose();
    system.block(free_beam, free_beam + n_tissue, n_tissue, rows) = -h_free.transpose();
    system.block(free_beam + n_tissue, 0, rows, free_beam) = h_n;
    system.block(free_beam + n_tissue, free_beam, rows, n_tissue) = h_free;

    const Eigen::VectorXd x = system.partialPivLu().solve(right);
    Eigen::VectorXd step = Eigen::VectorXd::Zero(6 * needle_.node_count());
    step.tail(free_beam) = x.head(free_beam);
    const double largest = x.head(free_beam + n_tissue).cwiseAbs().maxCoeff();
    const double shorten = std::min(1.0, 0.05 / largest);  // from a straight needle: not all at once
    physics::move(shape_, shorten * step);
    tissue(dense_.free_dofs()) += shorten * x.segment(free_beam, n_tissue);
    return largest;
  }

  physics::NeedleProperties properties_;
  physics::StylusPose hub_;
  physics::Needle needle_;
  physics::NeedleShape shape_;
  physics::SimulationBody body_;
  support::DenseTissue dense_;
  std::vector<NeedleContact> contacts_;

public:
  Eigen::VectorXd tissue;  ///< [3 nodes] positions
};

TEST(ReferenceInsertion, ComesToRestInTheEquilibriumOfTheMonolithicSystem) {
  const ReferenceInsertion insertion = r1();
  for (const int latency : {0, 1}) {
    ReferenceExperiment experiment(insertion, {.latency_steps = latency, .worker_period = 4});
    while (experiment.time_s() < insertion.duration + 3) experiment.advance();

    Monolithic exact(insertion, experiment.needle());
    const double last_step = exact.solve();
    ASSERT_LT(last_step, 1e-12);

    const Eigen::MatrixXd needle = experiment.needle().positions.leftCols(experiment.needle().node_count);
    const Eigen::VectorXd tissue = experiment.simulation().tissue().positions[0].reshaped();
    const Eigen::VectorXd rest = exact.dense().rest();
    const double needle_error = (needle - exact.shape().nodes()).norm() / insertion.lateral_amplitude;
    const double tissue_error = (tissue - exact.tissue).norm() / (exact.tissue - rest).norm();
    // The support carries what the hand feels.
    const Eigen::VectorXd reactions = exact.dense().forces(exact.tissue);
    Eigen::Vector3d support = Eigen::Vector3d::Zero();
    for (const int n : insertion.body().fixed_nodes) support += reactions.segment<3>(3 * n);
    const Eigen::Vector3d felt = experiment.needle().wrench.force;
    const double force_error = (felt - support).norm() / support.norm();
    std::printf(
        "  latency %d: off the monolithic equilibrium by %.1e (needle), %.1e (tissue), %.1e (force, of %.3f N)\n",
        latency, needle_error, tissue_error, force_error, support.norm());
    EXPECT_LT(needle_error, 1e-8);
    EXPECT_LT(tissue_error, 1e-8);
    EXPECT_LT(force_error, 1e-8);
  }
}

TEST(ReferenceInsertion, ForcesBalanceAtRestAndDoNotDrift) {
  const ReferenceInsertion insertion = r1();
  ReferenceExperiment experiment(insertion, {.worker_period = 1});
  while (experiment.time_s() < insertion.duration + 2) experiment.advance();
  const NeedleState& needle = experiment.needle();

  // Force and moment about the hub: hand, contacts.
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  for (int c = 0; c < needle.contact_count; ++c) {
    const NeedleContact& contact = needle.contacts[std::size_t(c)];
    force += contact.force;
    moment += (contact.position - needle.positions.col(0)).cross(contact.force);
  }
  const double size = needle.wrench.force.norm();
  std::printf("  hand + contacts: %.1e N of %.3f N, %.1e N m of %.4f N m; tissue residual %.1e N\n",
              (needle.wrench.force + force).norm(), size, (needle.wrench.moment + moment).norm(),
              needle.wrench.moment.norm(), experiment.report().residual_n);
  EXPECT_LT((needle.wrench.force + force).norm(), 1e-9 * size);
  EXPECT_LT((needle.wrench.moment + moment).norm(), 1e-7 * needle.wrench.moment.norm());
  EXPECT_LT(experiment.report().residual_n, 1e-9 * experiment.report().force_n);

  // 300 more simulation steps, each with a new factorisation.
  const Eigen::Vector3d before = needle.wrench.force;
  const Eigen::Matrix3Xd tissue = experiment.simulation().tissue().positions[0];
  const std::uint64_t epoch = experiment.report().factor_epoch;
  for (int i = 0; i < 300; ++i) experiment.advance();
  std::printf("  after 300 more steps: force moved by %.1e N, tissue by %.1e m\n",
              (experiment.needle().wrench.force - before).norm(),
              (experiment.simulation().tissue().positions[0] - tissue).norm());
  EXPECT_EQ(experiment.report().factor_epoch, epoch + 300);
  EXPECT_LT((experiment.needle().wrench.force - before).norm(), 1e-9 * size);
  EXPECT_LT((experiment.simulation().tissue().positions[0] - tissue).norm(), 1e-10);
}

}  // namespace
}  // namespace stylet::bench
