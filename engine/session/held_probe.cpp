#include "engine/session/held_probe.h"

#include "engine/session/coupled_loops.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace stylet::session {
namespace {

constexpr std::array kParts{&content::ProbeMove::lateral, &content::ProbeMove::elevation, &content::ProbeMove::press,
                            &content::ProbeMove::tilt,    &content::ProbeMove::rock,      &content::ProbeMove::twist};

bool is_none(const content::ProbeMove& move) {
  return std::ranges::all_of(kParts, [&](auto part) { return move.*part == 0; });
}

}  // namespace

HeldProbe::HeldProbe(const content::Scene& scene, const content::ProbeMove& start) : scene_(scene), start_(start) {
  if (is_none(start)) return;
  const physics::RigidPose held = probe_pose(scene, 0);
  const auto there = content::moved_on_skin(held, scene.labels, start);
  if (!there) {
    start_ = {};
    return;
  }
  store(start);
  offset_ = held.orientation.conjugate() * (there->position - held.position);
  turn_ = held.orientation.conjugate() * there->orientation;
  at_rest_ = false;
}

void HeldProbe::store(const content::ProbeMove& goal) {
  for (std::size_t i = 0; i < kParts.size(); ++i) goal_[i].store(goal.*kParts[i], std::memory_order_relaxed);
}

bool HeldProbe::move(const content::ProbeMove& by, double time_s) {
  content::ProbeMove to = moved();
  for (const auto part : kParts) to.*part += by.*part;
  if (!content::moved_on_skin(probe_pose(scene_, time_s), scene_.labels, to)) return false;
  store(to);
  is_tracked_.store(false, std::memory_order_relaxed);
  return true;
}

bool HeldProbe::apply(const ProbeCommand& command, double time_s) {
  if (const auto* by = std::get_if<content::ProbeMove>(&command)) return move(*by, time_s);
  release();
  return true;
}

void HeldProbe::release() {
  store(start_);
  is_tracked_.store(false, std::memory_order_relaxed);
}

bool HeldProbe::follow(const physics::RigidPose& patient_from_probe) {
  const auto pose = content::drawn_back(patient_from_probe, scene_.labels, kDeepest);
  if (!pose) return false;
  tracked_.back() = *pose;
  tracked_.publish();
  is_tracked_.store(true, std::memory_order_release);
  return true;
}

content::ProbeMove HeldProbe::moved() const {
  content::ProbeMove move;
  for (std::size_t i = 0; i < kParts.size(); ++i) move.*kParts[i] = goal_[i].load(std::memory_order_relaxed);
  return move;
}

physics::RigidPose HeldProbe::pose(double time_s) {
  const physics::RigidPose scene = probe_pose(scene_, time_s);
  const double dt = std::max(time_s - last_s_, 0.0);
  last_s_ = time_s;
  const content::ProbeMove goal = moved();
  const bool tracked = is_tracked_.load(std::memory_order_acquire);
  const bool elsewhere = tracked || !is_none(goal);
  if (!elsewhere && at_rest_) return scene;

  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  if (elsewhere) {
    std::optional<physics::RigidPose> hand;
    if (tracked) {
      tracked_.update();
      hand = tracked_.front();
    } else {
      hand = content::moved_on_skin(scene, scene_.labels, goal);
    }
    offset = hand ? Eigen::Vector3d(scene.orientation.conjugate() * (hand->position - scene.position)) : offset_;
    turn = hand ? scene.orientation.conjugate() * hand->orientation : turn_;
  }
  const bool quick = tracked || keeps_up_.load(std::memory_order_relaxed);
  const double share = 1 - std::exp(-dt / (quick ? kTrackedConstant : kTimeConstant));
  offset_ += share * (offset - offset_);
  turn_ = turn_.slerp(share, turn).normalized();
  at_rest_ = !elsewhere && offset_.norm() < 1e-6 && turn_.vec().norm() < 1e-6;
  if (at_rest_) {
    offset_.setZero();
    turn_.setIdentity();
    return scene;
  }
  physics::RigidPose pose;
  pose.position = scene.position + scene.orientation * offset_;
  pose.orientation = scene.orientation * turn_;
  return pose;
}

}  // namespace stylet::session
