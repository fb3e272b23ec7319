#include "physics/needle/beam.h"

#include "physics/needle/rotation_vector.h"

namespace stylet::physics {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

/// Element frame and the seven local deformations.
struct LocalState {
  double length;              // current, m
  double extension;           // m
  Matrix3d frame;             // R_r, columns e1 (along the chord), e2, e3
  Vector3d theta_a, theta_b;  // local rotations of the ends, element frame, rad
  Vector3d p_a, p_b;          // the ends' own y axes, element frame; e3 is normal to their mean
};

LocalState local_state(const Beam& beam, const BeamEnd& a, const BeamEnd& b) {
  LocalState s;
  const Vector3d chord = b.position - a.position;
  s.length = chord.norm();
  // ln - l0 through the difference of squares: no cancellation of the two lengths' own rounding
  s.extension = (chord.squaredNorm() - beam.length * beam.length) / (s.length + beam.length);
  const Matrix3d frame_a = a.orientation * beam.rest_frame;
  const Matrix3d frame_b = b.orientation * beam.rest_frame;
  const Vector3d e1 = chord / s.length;
  const Vector3d mean_y = 0.5 * (frame_a.col(1) + frame_b.col(1));
  const Vector3d e3 = e1.cross(mean_y).normalized();
  s.frame << e1, e3.cross(e1), e3;
  const Matrix3d local_a = s.frame.transpose() * frame_a;
  const Matrix3d local_b = s.frame.transpose() * frame_b;
  s.theta_a = logarithm(Eigen::Quaterniond(local_a));
  s.theta_b = logarithm(Eigen::Quaterniond(local_b));
  s.p_a = local_a.col(1);
  s.p_b = local_b.col(1);
  return s;
}

/// Local stiffness, Timoshenko with the exact (locking-free) shear parameter phi = 12 EI / (kGA l^2).
struct LocalStiffness {
  double axial, torsion, near, far;  // bending: `near` couples an end to itself, `far` to the other end
  explicit LocalStiffness(const Beam& beam) {
    const SectionStiffness& k = beam.section;
    const double l = beam.length;
    const double phi = 12 * k.bending / (k.shear * l * l);
    axial = k.axial / l;
    torsion = k.torsion / l;
    near = k.bending / (l * (1 + phi)) * (4 + phi);
    far = k.bending / (l * (1 + phi)) * (2 - phi);
  }
  Vector3d moment(const Vector3d& here, const Vector3d& there) const {
    return {torsion * (here.x() - there.x()), near * here.y() + far * there.y(), near * here.z() + far * there.z()};
  }
  Matrix3d self() const { return Vector3d(torsion, near, near).asDiagonal(); }
  Matrix3d other() const { return Vector3d(-torsion, far, far).asDiagonal(); }
};

/// Local rotations less what stays of them: those that make the moments.
void take_bend(const PlasticBend& bend, Vector3d& theta_a, Vector3d& theta_b) {
  theta_a.tail<2>() -= bend.turn[0];
  theta_b.tail<2>() -= bend.turn[1];
}

using Matrix3x12 = Eigen::Matrix<double, 3, 12>;
using Matrix6x12 = Eigen::Matrix<double, 6, 12>;

/// G^T: spin of the element frame per unit motion of the ends, all in element axes.
Matrix3x12 frame_spin(const LocalState& s, double eta) {
  const double mean_y = 0.5 * (s.p_a.y() + s.p_b.y());
  const double l = s.length;
  Matrix3x12 g = Matrix3x12::Zero();
  g(0, 2) = eta / l;
  g(0, 3) = 0.5 * s.p_a.y() / mean_y;
  g(0, 4) = -0.5 * s.p_a.x() / mean_y;
  g(0, 8) = -eta / l;
  g(0, 9) = 0.5 * s.p_b.y() / mean_y;
  g(0, 10) = -0.5 * s.p_b.x() / mean_y;
  g(1, 2) = 1 / l;
  g(1, 8) = -1 / l;
  g(2, 1) = -1 / l;
  g(2, 7) = 1 / l;
  return g;
}

/// Turns the 3x3 blocks of a 12-wide matrix from element axes to patient axes.
template <typename Derived>
void rotate_columns(Eigen::MatrixBase<Derived>& m, const Matrix3d& frame) {
  for (int k = 0; k < 12; k += 3) {
    m.template middleCols<3>(k) = (m.template middleCols<3>(k).lazyProduct(frame.transpose())).eval();
  }
}

}  // namespace

double beam_energy(const Beam& beam, const BeamEnd& a, const BeamEnd& b) {
  const LocalState s = local_state(beam, a, b);
  const LocalStiffness k(beam);
  Vector3d theta_a = s.theta_a, theta_b = s.theta_b;
  take_bend(beam.bend, theta_a, theta_b);
  return 0.5 * (k.axial * s.extension * s.extension + theta_a.dot(k.moment(theta_a, theta_b)) +
                theta_b.dot(k.moment(theta_b, theta_a)));
}

namespace {

BeamResponse response_of(const Beam& beam, const LocalState& s, Tangent tangent) {
  const LocalStiffness k(beam);
  const double l = s.length;
  const double eta = (s.p_a.x() + s.p_b.x()) / (s.p_a.y() + s.p_b.y());
  const Matrix3x12 g = frame_spin(s, eta);

  const double normal_force = k.axial * s.extension;
  Vector3d elastic_a = s.theta_a, elastic_b = s.theta_b;
  take_bend(beam.bend, elastic_a, elastic_b);
  const Vector3d local_a = k.moment(elastic_a, elastic_b);
  const Vector3d local_b = k.moment(elastic_b, elastic_a);
  const Matrix3d ta = inverse_tangent(s.theta_a);
  const Matrix3d tb = inverse_tangent(s.theta_b);
  Vector6d moment;  // of the ends, element axes, conjugate to spins
  moment.head<3>() = ta.transpose().lazyProduct(local_a);
  moment.tail<3>() = tb.transpose().lazyProduct(local_b);

  // P: spins of the ends seen from the element frame
  Matrix6x12 p = Matrix6x12::Zero();
  p.block<3, 3>(0, 3).setIdentity();
  p.block<3, 3>(3, 9).setIdentity();
  p.topRows<3>() -= g;
  p.bottomRows<3>() -= g;

  const Vector12d p_moment = p.transpose().lazyProduct(moment);
  BeamResponse response;
  for (int i = 0; i < 12; i += 3) response.force.segment<3>(i) = s.frame * p_moment.segment<3>(i);
  const Vector3d e1 = s.frame.col(0);
  response.force.segment<3>(0) -= normal_force * e1;
  response.force.segment<3>(6) += normal_force * e1;

  // Tangent in element axes, rotated at the end. Material part: local stiffness seen through P and T^-1.
  Matrix3d k_aa = k.self(), k_bb = k.self(), k_ab = k.other();
  if (beam.bend.yielding()) {
    const Eigen::Matrix4d bending = yielding_stiffness(beam.bend, k.near, k.far);
    k_aa.bottomRightCorner<2, 2>() = bending.topLeftCorner<2, 2>();
    k_ab.bottomRightCorner<2, 2>() = bending.topRightCorner<2, 2>();
    k_bb.bottomRightCorner<2, 2>() = bending.bottomRightCorner<2, 2>();
  }
  Matrix6d local;
  local.block<3, 3>(0, 0) = ta.transpose() * k_aa * ta;
  local.block<3, 3>(0, 3) = ta.transpose() * k_ab * tb;
  local.block<3, 3>(3, 0) = tb.transpose() * k_ab.transpose() * ta;
  local.block<3, 3>(3, 3) = tb.transpose() * k_bb * tb;
  if (tangent == Tangent::full) {
    local.block<3, 3>(0, 0) += inverse_tangent_transpose_derivative(s.theta_a, local_a) * ta;
    local.block<3, 3>(3, 3) += inverse_tangent_transpose_derivative(s.theta_b, local_b) * tb;
  }
  const Matrix6x12 local_p = local.lazyProduct(p);
  Matrix12d& t = response.tangent;
  t = p.transpose().lazyProduct(local_p);
  t(0, 0) += k.axial;
  t(6, 6) += k.axial;
  t(0, 6) -= k.axial;
  t(6, 0) -= k.axial;

  if (tangent == Tangent::full) {
    for (int i = 1; i < 3; ++i) {  // the axial force turns with the chord
      t(i, i) += normal_force / l;
      t(i + 6, i + 6) += normal_force / l;
      t(i, i + 6) -= normal_force / l;
      t(i + 6, i) -= normal_force / l;
    }
    for (int i = 0; i < 12; i += 3) {  // nodal forces and moments turn with the element frame
      t.middleRows<3>(i) -= skew(p_moment.segment<3>(i)).lazyProduct(g);
    }
    // change of the frame's spin with the length: - d(1/l) terms
    const Vector3d sum = moment.head<3>() + moment.tail<3>();
    const Vector12d change = g.transpose().lazyProduct(Vector3d(0, (eta * sum.x() + sum.y()) / l, sum.z() / l));
    t.col(0) -= change;
    t.col(6) += change;
  }

  t = (0.5 * (t + t.transpose())).eval();
  rotate_columns(t, s.frame);
  Matrix12d transposed = t.transpose();
  rotate_columns(transposed, s.frame);
  t = transposed.transpose();
  return response;
}

}  // namespace

BeamResponse beam_response(const Beam& beam, const BeamEnd& a, const BeamEnd& b, Tangent tangent) {
  return response_of(beam, local_state(beam, a, b), tangent);
}

BeamResponse yielding_response(Beam& beam, const BeamEnd& a, const BeamEnd& b, Tangent tangent) {
  const LocalState s = local_state(beam, a, b);
  if (beam.strength.limited()) {
    const LocalStiffness k(beam);
    flow(beam.strength, {s.theta_a.tail<2>(), s.theta_b.tail<2>()}, k.near, k.far, beam.length, beam.bend);
  }
  return response_of(beam, s, tangent);
}

}  // namespace stylet::physics
