#include "engine/panels/session_watch.h"

#include "engine/training/ear.h"

#include <fmt/format.h>

#include <cmath>
#include <string_view>

namespace stylet::panels {
namespace {

constexpr std::size_t kCurvePoints = 40'000;  // at 60 frames a second, 11 minutes

// What an instructor would remark on.
constexpr double kOutOfPlane = 0.003;  // m: half the slice thickness at the focus
constexpr double kFirmProbe = 15;      // N
constexpr double kBend = 0.004;        // m
constexpr double kBeyondTarget = 1.5;  // radii past its centre

}  // namespace

SessionWatch::SessionWatch(const content::Scene& scene) : scene_(scene), trace_(kCurvePoints) {}

void SessionWatch::look(const state::FrameState& frame) {
  if (frame.needle_orientations.empty() || (seen_ && frame.time_s <= frame_.time_s)) return;
  const bool finite = frame.force.allFinite() && std::isfinite(frame.insertion_depth) &&
                      frame.needle_positions.front().allFinite() && frame.needle_positions.back().allFinite();
  if (!finite) return;  // the session says so itself; a curve has no place for it
  seen_ = true;
  frame_ = frame;
  const Eigen::Vector3f axis = frame.needle_orientations.front() * Eigen::Vector3f::UnitZ();
  const Eigen::Vector3f hub = frame.needle_positions.front(), tip = frame.needle_positions.back();
  trace_.add(frame.time_s, hub.cast<double>(), axis.cast<double>(), frame.insertion_depth,
             frame.force.cast<double>());
  out_of_plane_ = (frame.probe_orientation.conjugate() * (tip - frame.probe_position)).y();
  bend_ = axis.cross(tip - hub).norm();
}

void SessionWatch::fill(SessionFacts& facts) const {
  if (!seen_) return;
  facts.time_s = frame_.time_s;
  facts.insertion_depth = frame_.insertion_depth;
  facts.force = frame_.force.norm();
  facts.force_scale = frame_.force_scale;
  facts.probe_force = frame_.probe_force;
  facts.out_of_plane = out_of_plane_;
  if (const auto* target = frame_.nearest_target()) facts.target_distance = target->distance;
  facts.force_curve = trace_.samples();
  warn(facts);
}

void SessionWatch::warn(SessionFacts& facts) const {
  const auto add = [&](Concern concern, std::string_view text) {
    facts.warnings.emplace_back();
    facts.warnings.back().concern = concern;
    facts.warnings.back().text.assign(text);
  };
  const bool inserted = frame_.insertion_depth > 0.005F;
  if (frame_.probe_lifted > 0.5F) add(Concern::caution, "probe is off the skin");
  if (frame_.probe_force > kFirmProbe) add(Concern::caution, "probe is pressed hard");
  if (inserted && std::abs(out_of_plane_) > kOutOfPlane) add(Concern::caution, "tip is out of the image plane");
  if (inserted && bend_ > kBend) add(Concern::caution, fmt::format("needle is bent by {:.0f} mm", bend_ * 1e3));
  if (frame_.force_clipped > 0.5F) add(Concern::caution, "stylus cannot give this force");
  if (facts.force > training::Ear::kHardPush) add(Concern::danger, "pushed hard: bone or cartilage?");
  if (const state::TargetState* target = frame_.nearest_target(); inserted && target != nullptr) {
    const Eigen::Vector3f axis = frame_.needle_orientations.back() * Eigen::Vector3f::UnitZ();
    const float past = axis.dot(frame_.needle_positions.back() - target->centre);
    const double radius = scene_.targets[target - frame_.targets.data()].radius;
    if (past > kBeyondTarget * radius) add(Concern::danger, "tip is beyond the target");
  }
  if (facts.warnings.empty()) add(Concern::note, "nothing to remark");
}

}  // namespace stylet::panels
