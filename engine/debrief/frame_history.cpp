#include "engine/debrief/frame_history.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace stylet::debrief {

namespace {

constexpr float kUnits = std::numeric_limits<std::int16_t>::max();

using Coordinates = Eigen::Map<const Eigen::ArrayXf>;
using Units = Eigen::Map<Eigen::Array<std::int16_t, Eigen::Dynamic, 1>>;

Eigen::Index size_of(const std::vector<Eigen::Vector3f>& nodes) {
  return 3 * static_cast<Eigen::Index>(nodes.size());
}

std::size_t node_count(const state::FrameState& frame) {
  std::size_t count = 0;
  for (const auto& body : frame.bodies) count += body.size();
  return count;
}

std::size_t bytes_of(const state::FrameState& frame) {
  return node_count(frame) * 3 * sizeof(std::int16_t) + sizeof(state::FrameState) +
         frame.needle_positions.size() * (sizeof(Eigen::Vector3f) + sizeof(Eigen::Quaternionf));
}

/// `to` becomes what lies at `share` of the way from it to `later`.
void interpolate(state::FrameState& to, const state::FrameState& later, float share, double time_s) {
  const auto mix = [share](auto& a, const auto& b) { a += share * (b - a); };
  const auto turn = [share](Eigen::Quaternionf& a, const Eigen::Quaternionf& b) { a = a.slerp(share, b); };
  to.time_s = time_s;
  for (std::size_t b = 0; b < to.bodies.size(); ++b) {
    for (std::size_t i = 0; i < to.bodies[b].size(); ++i) mix(to.bodies[b][i], later.bodies[b][i]);
  }
  for (std::size_t i = 0; i < to.needle_positions.size(); ++i) mix(to.needle_positions[i], later.needle_positions[i]);
  for (std::size_t i = 0; i < to.needle_orientations.size(); ++i) {
    turn(to.needle_orientations[i], later.needle_orientations[i]);
  }
  mix(to.probe_position, later.probe_position);
  turn(to.probe_orientation, later.probe_orientation);
  for (auto field : {&state::FrameState::breath, &state::FrameState::force}) mix(to.*field, later.*field);
  for (std::size_t t = 0; t < to.targets.size(); ++t) {
    mix(to.targets[t].centre, later.targets[t].centre);
    mix(to.targets[t].distance, later.targets[t].distance);
  }
  for (auto field :
       {&state::FrameState::force_scale, &state::FrameState::force_clipped, &state::FrameState::insertion_depth,
        &state::FrameState::probe_force, &state::FrameState::probe_area, &state::FrameState::probe_lifted}) {
    mix(to.*field, later.*field);
  }
}

}  // namespace

FrameHistory::FrameHistory(const state::FrameState& rest, std::size_t memory)
    : rest_(rest), most_frames_(std::max<std::size_t>(memory / bytes_of(rest), 4)) {}

FrameHistory::Kept FrameHistory::pack(const state::FrameState& frame) const {
  Kept kept{.details = frame};
  const auto displacements = [&](std::size_t b) {
    return Coordinates(frame.bodies[b].data()->data(), size_of(rest_.bodies[b])) -
           Coordinates(rest_.bodies[b].data()->data(), size_of(rest_.bodies[b]));
  };
  float most = 0;
  for (std::size_t b = 0; b < rest_.bodies.size(); ++b) {
    if (!rest_.bodies[b].empty()) most = std::max(most, displacements(b).abs().maxCoeff());
  }
  kept.metres_per_unit = most / kUnits;
  kept.nodes.resize(3 * node_count(rest_));
  const float units_per_metre = most > 0 ? kUnits / most : 0;
  std::int16_t* units = kept.nodes.data();
  for (std::size_t b = 0; b < rest_.bodies.size(); ++b) {
    if (rest_.bodies[b].empty()) continue;
    const Eigen::Index size = size_of(rest_.bodies[b]);
    Units(units, size) = (units_per_metre * displacements(b)).rint().cast<std::int16_t>();
    units += size;
  }
  return kept;
}

void FrameHistory::add(const state::FrameState& frame) {
  {
    const std::lock_guard lock(mutex_);
    if (!is_next(frame.time_s) || seen_++ % every_ != 0) return;
  }
  Kept kept = pack(frame);
  const std::lock_guard lock(mutex_);
  if (!is_next(frame.time_s)) return;
  if (frames_.size() == most_frames_) {
    std::size_t left = 0;
    for (std::size_t i = 0; i < frames_.size(); i += 2, ++left) frames_[left] = std::move(frames_[i]);
    frames_.resize(left);
    every_ *= 2;
  }
  frames_.push_back(std::move(kept));
}

void FrameHistory::unpack(const Kept& kept, state::FrameState& out) const {
  static_cast<state::FrameDetails&>(out) = kept.details;
  const std::int16_t* unit = kept.nodes.data();
  for (std::size_t b = 0; b < rest_.bodies.size(); ++b) {
    for (std::size_t i = 0; i < rest_.bodies[b].size(); ++i, unit += 3) {
      out.bodies[b][i] = rest_.bodies[b][i] + kept.metres_per_unit * Eigen::Vector3f(static_cast<float>(unit[0]),
                                                                                     static_cast<float>(unit[1]),
                                                                                     static_cast<float>(unit[2]));
    }
  }
}

bool FrameHistory::sample(double time_s, state::FrameState& out) const {
  const std::lock_guard lock(mutex_);
  if (frames_.empty()) return false;
  const auto later = std::lower_bound(frames_.begin(), frames_.end(), time_s,
                                      [](const Kept& kept, double t) { return kept.details.time_s < t; });
  if (later == frames_.begin() || later == frames_.end()) {
    unpack(later == frames_.end() ? frames_.back() : frames_.front(), out);
    return true;
  }
  const Kept& earlier = *(later - 1);
  const double span = later->details.time_s - earlier.details.time_s;
  state::FrameState second = rest_;
  unpack(*later, second);
  unpack(earlier, out);
  interpolate(out, second, static_cast<float>((time_s - earlier.details.time_s) / span), time_s);
  return true;
}

std::size_t FrameHistory::size() const {
  const std::lock_guard lock(mutex_);
  return frames_.size();
}
double FrameHistory::begin_s() const {
  const std::lock_guard lock(mutex_);
  return frames_.empty() ? 0 : frames_.front().details.time_s;
}
double FrameHistory::end_s() const {
  const std::lock_guard lock(mutex_);
  return frames_.empty() ? 0 : frames_.back().details.time_s;
}

}  // namespace stylet::debrief
