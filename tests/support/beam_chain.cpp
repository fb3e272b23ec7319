#include "tests/support/beam_chain.h"

#include "physics/needle/block_tridiagonal.h"
#include "physics/needle/rotation_vector.h"
#include "tools/reference/dense_algebra.h"

#include <Eigen/LU>

namespace stylet::support {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using physics::BeamEnd;
using physics::BlockTridiagonal;
using physics::Matrix12d;
using physics::skew;
using physics::Vector12d;

namespace {

BeamEnd arm_end(const BeamEnd& node, const Vector3d& offset) {
  return {node.position + node.orientation * offset, node.orientation};
}

/// Force and tangent of a member on its nodes: the arms carry the element's over to them.
physics::BeamResponse member_response(const BeamChain::Member& member, const BeamEnd& a, const BeamEnd& b) {
  physics::BeamResponse r = physics::beam_response(member.beam, arm_end(a, member.offset), arm_end(b, member.offset));
  if (member.offset.isZero(0)) return r;
  Matrix12d to_ends = Matrix12d::Identity();
  Matrix12d turning = Matrix12d::Zero();  // the moment arm x force changes as the arm turns
  for (int end = 0; end < 2; ++end) {
    const Matrix3d arm = skew((end == 0 ? a : b).orientation * member.offset);
    const Matrix3d force = skew(r.force.segment<3>(6 * end));
    to_ends.block<3, 3>(6 * end, 6 * end + 3) = -arm;
    turning.block<3, 3>(6 * end + 3, 6 * end + 3) = 0.5 * (force * arm + arm * force);
  }
  r.force = (to_ends.transpose() * r.force).eval();
  const Matrix12d tangent = r.tangent.lazyProduct(to_ends);
  r.tangent = to_ends.transpose().lazyProduct(tangent) + turning;
  return r;
}

struct System {
  BlockTridiagonal tangent;
  Eigen::VectorXd force;
};

System assemble_blocks(const BeamChain& chain) {
  System s{BlockTridiagonal(chain.free_dofs() / 6), Eigen::VectorXd::Zero(chain.free_dofs())};
  s.tangent.set_zero();
  for (const auto& member : chain.members) {
    const auto r = member_response(member, chain.nodes[member.node], chain.nodes[member.node + 1]);
    const int second = static_cast<int>(member.node);  // block of the member's second node; the clamp has none
    s.tangent.diagonal(second) += r.tangent.bottomRightCorner<6, 6>();
    s.force.segment<6>(6 * second) += r.force.tail<6>();
    if (second == 0) continue;
    s.tangent.diagonal(second - 1) += r.tangent.topLeftCorner<6, 6>();
    s.tangent.upper(second - 1) += r.tangent.topRightCorner<6, 6>();
    s.force.segment<6>(6 * (second - 1)) += r.force.head<6>();
  }
  return s;
}

}  // namespace

BeamChain BeamChain::through(std::span<const Vector3d> points, const physics::SectionStiffness& section) {
  BeamChain chain;
  for (const auto& p : points) chain.nodes.push_back({p, Matrix3d::Identity()});
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    const Vector3d chord = points[i + 1] - points[i];
    const Vector3d x = chord.normalized();
    const Vector3d y = Vector3d::UnitZ().cross(x).normalized();
    Member member{.node = i, .beam = {.length = chord.norm(), .rest_frame = {}, .section = section}};
    member.beam.rest_frame << x, y, x.cross(y);
    chain.members.push_back(member);
  }
  return chain;
}

BeamChain BeamChain::straight(int count, double length, const physics::SectionStiffness& section, double grading) {
  std::vector<Vector3d> points{Vector3d::Zero()};
  double beam = 1;
  for (int i = 0; i < count; ++i, beam *= grading) points.emplace_back(points.back() + beam * Vector3d::UnitX());
  const double scale = length / points.back().x();
  for (auto& p : points) p *= scale;
  return through(points, section);
}

void BeamChain::add_fibre(const Vector3d& offset, const physics::SectionStiffness& section) {
  for (std::size_t i = 0, beams = nodes.size() - 1; i < beams; ++i) {
    Member fibre = members[i];
    fibre.offset = offset;
    fibre.beam.section = section;
    members.push_back(fibre);
  }
}

void BeamChain::assemble(Eigen::MatrixXd& tangent, Eigen::VectorXd& force) const {
  System s = assemble_blocks(*this);
  tangent.setZero(free_dofs(), free_dofs());
  for (int i = 0; i < s.tangent.block_count(); ++i) {
    tangent.block<6, 6>(6 * i, 6 * i) = s.tangent.diagonal(i);
    if (i + 1 == s.tangent.block_count()) break;
    tangent.block<6, 6>(6 * i, 6 * i + 6) = s.tangent.upper(i);
    tangent.block<6, 6>(6 * i + 6, 6 * i) = s.tangent.upper(i).transpose();
  }
  force = s.force;
}

void BeamChain::move(const Eigen::VectorXd& motion) {
  for (std::size_t i = 1; i < nodes.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(6 * (i - 1));
    nodes[i].position += motion.segment<3>(k);
    // Back through a unit quaternion: thousands of products would leave the rotations otherwise.
    const Eigen::Quaterniond q(nodes[i].orientation);
    nodes[i].orientation = (physics::exponential(motion.segment<3>(k + 3)) * q).normalized().toRotationMatrix();
  }
}

int BeamChain::solve(const physics::Vector6d& tip_load, double tolerance, int max_iterations) {
  for (int iteration = 1; iteration <= max_iterations; ++iteration) {
    System s = assemble_blocks(*this);
    Eigen::VectorXd x = -s.force;
    x.tail<6>() += tip_load;
    if (s.tangent.factorise()) {
      s.tangent.solve(x);
    } else {  // on the way, or beyond a dead moment's limit: indefinite, and Newton does not mind
      Eigen::MatrixXd k;
      Eigen::VectorXd f;
      assemble(k, f);
      x = reference::solve(k, x);
    }
    move(x);
    if (x.norm() < tolerance) return iteration;
  }
  return max_iterations + 1;
}

bool BeamChain::is_stable() const {
  return assemble_blocks(*this).tangent.factorise();
}

}  // namespace stylet::support
