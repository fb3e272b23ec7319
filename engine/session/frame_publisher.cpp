#include "engine/session/frame_publisher.h"

#include <Eigen/LU>

#include <algorithm>
#include <limits>

namespace stylet::session {

state::FrameState rest_frame(const content::Scene& scene) {
  state::FrameState frame;
  for (const content::DeformableBody& body : scene.bodies) {
    auto& positions = frame.bodies.emplace_back();
    for (const Eigen::Vector3d& node : body.mesh.nodes) positions.push_back(node.cast<float>());
  }
  physics::StylusPose hub;
  if (!scene.motion.stylus.empty()) hub = scene.motion.stylus.front().pose;
  for (int i = 0; i <= scene.needle.beams; ++i) {
    const Eigen::Vector3d along(0, 0, scene.needle.length * i / scene.needle.beams);
    frame.needle_positions.push_back((hub.position + hub.orientation * along).cast<float>());
    frame.needle_orientations.push_back(hub.orientation.cast<float>());
  }
  const physics::RigidPose probe = probe_pose(scene, 0);
  frame.probe_position = probe.position.cast<float>();
  frame.probe_orientation = probe.orientation.cast<float>();
  for (const content::Target& target : scene.targets)
    frame.targets.push_back({.centre = target.centre.cast<float>()});
  return frame;
}

namespace {

constexpr double kClippedShown = 0.3;  // s: a clipped force is shown so long at least

}  // namespace

FramePublisher::FramePublisher(const content::Scene& scene, double force_scale)
    : scene_(scene),
      frame_(rest_frame(scene)),
      buffer_(frame_),
      closest_(std::numeric_limits<double>::infinity()),
      clipped_s_(-std::numeric_limits<double>::infinity()) {
  frame_.force_scale = static_cast<float>(force_scale);
  for (const content::Target& target : scene.targets) carriers_.push_back(carrier_of(target.centre));
}

FramePublisher::Carrier FramePublisher::carrier_of(const Eigen::Vector3d& centre) const {
  for (std::size_t b = 0; b < scene_.bodies.size(); ++b) {
    const physics::TetMesh& mesh = scene_.bodies[b].mesh;
    for (const auto& tet : mesh.tets) {
      Eigen::Matrix4d corners;
      for (int i = 0; i < 4; ++i) corners.col(i) << mesh.nodes[tet[i]], 1.0;
      const Eigen::Vector4d weights = corners.inverse() * centre.homogeneous();
      if (weights.minCoeff() >= -1e-9) return {.body = static_cast<int>(b), .nodes = tet, .weights = weights};
    }
  }
  return {};
}

void FramePublisher::show_probe(const physics::RigidPose& pose, const physics::ProbeContact& contact) {
  const Eigen::Vector3d axis = pose.orientation * Eigen::Vector3d::UnitZ();
  frame_.probe_position = (pose.position - contact.yielded * axis).cast<float>();
  frame_.probe_orientation = pose.orientation.cast<float>();
  const double force = -contact.wrench.force.dot(axis);
  frame_.probe_force = static_cast<float>(force);
  frame_.probe_area = static_cast<float>(contact.area);
  frame_.probe_lifted = scene_.probe.presses >= 0 && !(contact.area > 0) ? 1.0F : 0.0F;
  probe_.least_area = steps_ > 0 ? std::min(probe_.least_area, contact.area) : contact.area;
  steps_ += 1;
  probe_.mean_force += (force - probe_.mean_force) / steps_;
  probe_.mean_area += (contact.area - probe_.mean_area) / steps_;
  probe_.peak_force = std::max(probe_.peak_force, force);
}

void FramePublisher::force_sent(double time_s, std::uint64_t /*step*/, const haptic::GuardedWrench& out) {
  if ((out.flags & haptic::kOutputClipped) != 0) clipped_s_.store(time_s, std::memory_order_relaxed);
}

void FramePublisher::simulation_stepped(const recording::SimulationStepRecord& record,
                                        const physics::SimulationReport& report, const physics::TissueState& tissue,
                                        const physics::NeedleState& needle) {
  if (needle.node_count < 2) return;
  frame_.time_s = record.time_s;
  frame_.simulation_step = record.step;
  frame_.haptic_step = record.needle_step;
  for (std::size_t b = 0; b < frame_.bodies.size(); ++b) {
    const auto& positions = tissue.positions[b];
    for (std::size_t i = 0; i < frame_.bodies[b].size(); ++i) {
      frame_.bodies[b][i] = positions.col(static_cast<Eigen::Index>(i)).cast<float>();
    }
  }
  for (int i = 0; i < needle.node_count; ++i) {
    frame_.needle_positions[i] = needle.positions.col(i).cast<float>();
    frame_.needle_orientations[i] = needle.orientations[i].cast<float>();
  }
  show_probe(record.probe, report.probe);
  frame_.breath = (record.inspiration * scene_.breathing.rigid_motion).cast<float>();
  frame_.force = needle.wrench.force.cast<float>();
  frame_.force_clipped = record.time_s - clipped_s_.load(std::memory_order_relaxed) < kClippedShown ? 1.0F : 0.0F;
  frame_.insertion_depth = static_cast<float>(insertion_depth(scene_.needle, needle));
  const Eigen::Vector3d tip = needle.positions.col(needle.node_count - 1);
  for (std::size_t t = 0; t < carriers_.size(); ++t) {
    const Carrier& carrier = carriers_[t];
    Eigen::Vector3d centre = scene_.targets[t].centre;
    if (carrier.body >= 0) {
      const auto& positions = tissue.positions[carrier.body];
      centre.setZero();
      for (int i = 0; i < 4; ++i) centre += carrier.weights[i] * positions.col(carrier.nodes[i]);
    }
    const double distance = (tip - centre).norm();
    frame_.targets[t] = {.centre = centre.cast<float>(), .distance = static_cast<float>(distance)};
    closest_ = std::min(closest_, distance);
  }
  buffer_.publish(frame_);
}

}  // namespace stylet::session
