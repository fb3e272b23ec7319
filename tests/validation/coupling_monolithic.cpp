#include "tests/validation/coupling_monolithic.h"
#include "tools/reference/dense_algebra.h"

#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>

namespace stylet::validation {

using physics::NeedleContact;

Monolithic::Monolithic(const reference::ReferenceInsertion& insertion, const physics::StylusPose& hub,
                       const physics::NeedleState& state, ShaftCurve curve)
    : curve_(curve),
      beam_length_(insertion.needle.length / insertion.needle.beams),
      hub_(hub),
      needle_(insertion.needle, {}),
      shape_(physics::straight_needle(insertion.needle, hub_)),
      body_(insertion.body()),
      dense_(body_.mesh, body_.tet_materials, body_.fixed_nodes),
      contacts_(state.contacts.begin(), state.contacts.begin() + state.contact_count),
      tissue_(dense_.rest()) {}

double Monolithic::solve() {
  double step = 1;
  for (int i = 0; i < 60 && step > 1e-13; ++i) step = newton();
  return step;
}

Eigen::Vector3d Monolithic::support_reaction() const {
  const Eigen::VectorXd forces = dense_.forces(tissue_);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const int n : body_.fixed_nodes) sum += forces.segment<3>(3 * n);
  return sum;
}

Monolithic::OnShaft Monolithic::nearest_edge(const Eigen::Vector3d& x) const {
  OnShaft at;
  double nearest = 1e300;
  for (int b = 0; b + 1 < shape_.node_count; ++b) {
    const Eigen::Vector3d p = shape_.positions.col(b);
    const Eigen::Vector3d e = shape_.positions.col(b + 1) - p;
    const double u = std::min(1.0, std::max(0.0, (x - p).dot(e) / e.squaredNorm()));
    if ((p + u * e - x).norm() >= nearest) continue;
    nearest = (p + u * e - x).norm();
    at.first = b;
    at.share = {1 - u, u};
    at.position = p + u * e;
    at.slope = e;
  }
  return at;
}

// Hermite's cubic by its definition: positions and slopes (the tangents times the rest length) at both ends.
Monolithic::OnShaft Monolithic::cubic_at(double s) const {
  OnShaft at;
  at.first = std::min(std::max(static_cast<int>(s), 0), shape_.node_count - 2);
  const double u = s - at.first;
  Eigen::Matrix<double, 3, 2> x;
  for (int end = 0; end < 2; ++end) {
    x.col(end) = shape_.positions.col(at.first + end);
    at.arm.col(end) = beam_length_ * (shape_.orientation(at.first + end) * Eigen::Vector3d::UnitZ());
  }
  const Eigen::Vector2d slope_share(6 * u * u - 6 * u, 6 * u - 6 * u * u);
  const Eigen::Vector2d slope_arm(3 * u * u - 4 * u + 1, 3 * u * u - 2 * u);
  at.slope = x * slope_share + at.arm * slope_arm;
  at.share = {2 * u * u * u - 3 * u * u + 1, 3 * u * u - 2 * u * u * u};
  at.arm.col(0) *= u * u * u - 2 * u * u + u;
  at.arm.col(1) *= u * u * u - u * u;
  at.position = x * at.share + at.arm.rowwise().sum();
  return at;
}

// The nearest of many points, then bisection of what lies ahead of the curve's normal plane.
Monolithic::OnShaft Monolithic::nearest_on_cubic(const Eigen::Vector3d& x) const {
  constexpr int kPointsPerBeam = 32;
  const double end = shape_.node_count - 1;
  double best = 0;
  for (int i = 1; i <= kPointsPerBeam * (shape_.node_count - 1); ++i) {
    const double s = double(i) / kPointsPerBeam;
    if ((cubic_at(s).position - x).norm() < (cubic_at(best).position - x).norm()) best = s;
  }
  double low = std::max(0.0, best - 1.0 / kPointsPerBeam);
  double high = std::min(end, best + 1.0 / kPointsPerBeam);
  for (int i = 0; i < 60; ++i) {
    const double middle = (low + high) / 2;
    const OnShaft at = cubic_at(middle);
    (at.slope.dot(x - at.position) > 0 ? low : high) = middle;
  }
  return cubic_at((low + high) / 2);
}

double Monolithic::newton() {
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
  system.block(free_beam, free_beam, n_tissue, n_tissue) = dense_.free_stiffness(tissue_);
  right.segment(free_beam, n_tissue) = -dense_.forces(tissue_)(dense_.free_dofs());

  Eigen::MatrixXd h_n = Eigen::MatrixXd::Zero(rows, free_beam);
  Eigen::MatrixXd h_v = Eigen::MatrixXd::Zero(rows, tissue_.size());
  for (Eigen::Index c = 0; c < rows / 2; ++c) {
    const NeedleContact& contact = contacts_[c];
    const auto& tet = body_.mesh.tets[contact.tet];
    Eigen::Vector3d x = Eigen::Vector3d::Zero();
    for (int a = 0; a < 4; ++a) x += contact.barycentric[a] * tissue_.segment<3>(3 * tet[a]);
    const OnShaft at = curve_ == ShaftCurve::cubic ? nearest_on_cubic(x) : nearest_edge(x);
    const Eigen::Vector3d edge = at.slope.normalized();
    const Eigen::Vector3d n1 = edge.unitOrthogonal();
    const Eigen::Vector3d normals[2] = {n1, edge.cross(n1)};
    for (int d = 0; d < 2; ++d) {
      const Eigen::Index row = 2 * c + d;
      const Eigen::RowVector3d n = normals[d].transpose();
      for (int end = 0; end < 2; ++end) {
        if (at.first + end == 0) continue;  // prescribed
        const int dof = 6 * (at.first + end - 1);
        h_n.block<1, 3>(row, dof) = at.share[end] * n;
        h_n.block<1, 3>(row, dof + 3) = at.arm.col(end).cross(normals[d]).transpose();  // n . (w x arm)
      }
      for (int a = 0; a < 4; ++a) h_v.block<1, 3>(row, 3 * tet[a]) = -contact.barycentric[a] * n;
      right[free_beam + n_tissue + row] = -n.dot(at.position - x);
    }
  }
  const Eigen::MatrixXd h_free = h_v(Eigen::all, dense_.free_dofs());
  system.block(0, free_beam + n_tissue, free_beam, rows) = -flexibility * h_n.transpose();
  system.block(free_beam, free_beam + n_tissue, n_tissue, rows) = -h_free.transpose();
  system.block(free_beam + n_tissue, 0, rows, free_beam) = h_n;
  system.block(free_beam + n_tissue, free_beam, rows, n_tissue) = h_free;

  const Eigen::VectorXd x = reference::solve(system, right);
  Eigen::VectorXd step = Eigen::VectorXd::Zero(6 * needle_.node_count());
  step.tail(free_beam) = x.head(free_beam);
  const double largest = x.head(free_beam + n_tissue).cwiseAbs().maxCoeff();
  const double shorten = std::min(1.0, 0.05 / largest);  // from a straight needle: not all at once
  physics::move(shape_, shorten * step);
  tissue_(dense_.free_dofs()) += shorten * x.segment(free_beam, n_tissue);
  return largest;
}

Distance distance_from_equilibrium(const reference::ReferenceInsertion& insertion, const physics::StylusPose& hub,
                                   const physics::NeedleState& needle, const Eigen::Matrix3Xd& tissue,
                                   ShaftCurve curve) {
  Monolithic exact(insertion, hub, needle, curve);
  Distance distance;
  distance.newton = exact.solve();
  const Eigen::MatrixXd nodes = needle.positions.leftCols(needle.node_count);
  const Eigen::Vector3d support = exact.support_reaction();
  distance.needle = (nodes - exact.shape().nodes()).norm() / insertion.lateral_amplitude;
  distance.tissue = (tissue.reshaped() - exact.tissue()).norm() / (exact.tissue() - exact.dense().rest()).norm();
  distance.force = (needle.wrench.force - support).norm() / support.norm();
  distance.newtons = support.norm();
  return distance;
}

}  // namespace stylet::validation
