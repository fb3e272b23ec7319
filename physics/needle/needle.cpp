#include "physics/needle/needle.h"

#include "physics/needle/rotation_vector.h"

#include <fmt/core.h>

#include <cmath>
#include <stdexcept>

namespace stylet::physics {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;

void require(bool condition, const char* what, double value) {
  if (!condition) throw std::invalid_argument(fmt::format("needle: {} (is {})", what, value));
}

void check(const NeedleProperties& n) {
  require(std::isfinite(n.length) && n.length > 0, "length must be positive", n.length);
  require(std::isfinite(n.outer_diameter) && n.outer_diameter > 0, "outer diameter must be positive",
          n.outer_diameter);
  require(n.inner_diameter >= 0 && n.inner_diameter < n.outer_diameter,
          "inner diameter must be at least 0 and below the outer", n.inner_diameter);
  require(std::isfinite(n.young_modulus) && n.young_modulus > 0, "Young's modulus must be positive", n.young_modulus);
  require(n.poisson_ratio > -1 && n.poisson_ratio < 0.5, "Poisson's ratio must lie in (-1, 0.5)", n.poisson_ratio);
  require(std::isfinite(n.yield_strength) && n.yield_strength >= 0, "yield strength must not be negative",
          n.yield_strength);
  require(n.beams >= 1 && n.beams <= kMaxBeams, "number of beams must be 1 to 64", n.beams);
}

void check(const NeedleBase& b) {
  if (b.kind == BaseKind::prescribed) return;
  require(std::isfinite(b.stiffness) && b.stiffness > 0, "base stiffness must be positive", b.stiffness);
  require(std::isfinite(b.rotational_stiffness) && b.rotational_stiffness > 0,
          "rotational base stiffness must be positive", b.rotational_stiffness);
  require(std::isfinite(b.damping) && b.damping >= 0, "base damping must not be negative", b.damping);
  require(std::isfinite(b.rotational_damping) && b.rotational_damping >= 0,
          "rotational base damping must not be negative", b.rotational_damping);
}

/// Element frame at rest in the node frame: x along the shaft (node z), y along the bevel normal (node x).
Matrix3d element_frame() {
  Matrix3d frame;
  frame << Vector3d::UnitZ(), Vector3d::UnitX(), Vector3d::UnitY();
  return frame;
}

}  // namespace

Quaterniond orientation_along(const Vector3d& direction) {
  const Vector3d to = direction.normalized();
  return Quaterniond(1 + to.z(), -to.y(), to.x(), 0).normalized();
}

NeedleShape straight_needle(const NeedleProperties& needle, const StylusPose& hub) {
  check(needle);
  NeedleShape shape;
  shape.node_count = needle.beams + 1;
  const Quaterniond orientation = hub.orientation.normalized();
  const Vector3d axis = orientation * Vector3d::UnitZ();
  for (int i = 0; i < shape.node_count; ++i) {
    shape.positions.col(i) = hub.position + needle.length * i / needle.beams * axis;
    shape.orientations[i] = orientation;
  }
  return shape;
}

Needle::Needle(const NeedleProperties& properties, const NeedleBase& base)
    : base_(base), rest_length_(properties.length), system_(properties.beams + 1) {
  check(properties);
  check(base);
  const Beam beam{.length = properties.length / properties.beams,
                  .rest_frame = element_frame(),
                  .section = tube_section(properties.outer_diameter, properties.inner_diameter,
                                          properties.young_modulus, properties.poisson_ratio),
                  .strength = tube_strength(properties.outer_diameter, properties.inner_diameter,
                                            properties.young_modulus, properties.yield_strength)};
  beams_.assign(properties.beams, beam);
  residual_ = Eigen::VectorXd::Zero(6 * node_count());
}

bool Needle::linearise(const NeedleShape& shape, const StylusPose& hub, double dt) {
  assemble(shape, hub, dt);
  return factorise(shape, hub, dt);
}

void Needle::assemble(const NeedleShape& shape, const StylusPose& hub, double dt) {
  assemble_beams(shape, Tangent::full);
  hold_base(shape, hub, dt);
}

bool Needle::factorise(const NeedleShape& shape, const StylusPose& hub, double dt) {
  if (system_.factorise()) return true;
  assemble_beams(shape, Tangent::material);
  hold_base(shape, hub, dt);
  return system_.factorise();
}

void Needle::assemble_beams(const NeedleShape& shape, Tangent tangent) {
  system_.set_zero();
  residual_.setZero();
  BeamEnd a{shape.positions.col(0), shape.orientation(0).toRotationMatrix()};
  for (int i = 0; i < node_count() - 1; ++i) {
    const BeamEnd b{shape.positions.col(i + 1), shape.orientation(i + 1).toRotationMatrix()};
    const BeamResponse response = yielding_response(beams_[i], a, b, tangent);
    system_.diagonal(i) += response.tangent.topLeftCorner<6, 6>();
    system_.diagonal(i + 1) += response.tangent.bottomRightCorner<6, 6>();
    system_.upper(i) = response.tangent.topRightCorner<6, 6>();
    residual_.segment<12>(6 * i) -= response.force;
    a = b;
  }
  first_diagonal_ = system_.diagonal(0);
  first_coupling_ = system_.upper(0);
  first_force_ = -residual_.head<6>();
}

void Needle::hold_base(const NeedleShape& shape, const StylusPose& hub, double dt) {
  if (base_.kind == BaseKind::prescribed) {
    // The first node is where the hub is: its rows become x_0 = 0.
    system_.diagonal(0).setIdentity();
    system_.upper(0).setZero();
    residual_.head<6>().setZero();
    return;
  }
  // b_0 -= k e,  D_0 += k + c/h. The shape followed the hub, so in the hub's frame the deflection e has not changed
  // yet in this step and the damper sees x_0 alone. The moment of an isotropic spring is k times the rotation vector.
  const Vector3d deflection = shape.positions.col(0) - hub.position;
  const Vector3d rotation = logarithm(shape.orientation(0) * hub.orientation.conjugate());
  residual_.head<3>() -= base_.stiffness * deflection;
  residual_.segment<3>(3) -= base_.rotational_stiffness * rotation;
  system_.diagonal(0).diagonal().head<3>().array() += base_.stiffness + base_.damping / dt;
  system_.diagonal(0).diagonal().tail<3>().array() += base_.rotational_stiffness + base_.rotational_damping / dt;
}

void Needle::solve(Eigen::Ref<const Eigen::VectorXd> load, Eigen::Ref<Eigen::VectorXd> motion) const {
  motion = residual_ + load;
  if (!base_is_free()) motion.head<6>().setZero();
  system_.solve(motion);
}

Vector6d Needle::base_reaction(Eigen::Ref<const Eigen::VectorXd> load,
                               Eigen::Ref<const Eigen::VectorXd> motion) const {
  return first_force_ + first_diagonal_.lazyProduct(motion.head<6>()) +
         first_coupling_.lazyProduct(motion.segment<6>(6)) - load.head<6>();
}

double Needle::energy(const NeedleShape& shape) const {
  double sum = 0;
  for (int i = 0; i < node_count() - 1; ++i) {
    const BeamEnd a{shape.positions.col(i), shape.orientation(i).toRotationMatrix()};
    const BeamEnd b{shape.positions.col(i + 1), shape.orientation(i + 1).toRotationMatrix()};
    sum += beam_energy(beams_[i], a, b);
  }
  return sum;
}

double Needle::bend() const {
  double sum = 0;
  for (const Beam& beam : beams_) sum += beam.bend.angle();
  return sum;
}

double Needle::bend_work() const {
  double sum = 0;
  for (const Beam& beam : beams_) sum += beam.bend.work;
  return sum;
}

void move(NeedleShape& shape, Eigen::Ref<const Eigen::VectorXd> motion) {
  for (int i = 0; i < shape.node_count; ++i) {
    shape.positions.col(i) += motion.segment<3>(6 * i);
    Quaterniond& q = shape.orientations[i];
    q = (exponential(motion.segment<3>(6 * i + 3)) * q).normalized();
  }
}

void follow_hub(NeedleShape& shape, const StylusPose& from, const StylusPose& to) {
  const Quaterniond turn = (to.orientation * from.orientation.conjugate()).normalized();
  const Matrix3d rotation = turn.toRotationMatrix();
  for (int i = 0; i < shape.node_count; ++i) {
    shape.positions.col(i) = to.position + rotation * (shape.positions.col(i) - from.position);
    Quaterniond& q = shape.orientations[i];
    q = (turn * q).normalized();
  }
}

}  // namespace stylet::physics
