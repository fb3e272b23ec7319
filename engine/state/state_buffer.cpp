#include "engine/state/state_buffer.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>

namespace stylet::state {
namespace {

bool same_sizes(const FrameState& a, const FrameState& b) {
  return a.bodies.size() == b.bodies.size() && a.needle_positions.size() == b.needle_positions.size() &&
         a.needle_orientations.size() == b.needle_orientations.size() && a.targets.size() == b.targets.size() &&
         std::equal(a.bodies.begin(), a.bodies.end(), b.bodies.begin(),
                    [](const auto& x, const auto& y) { return x.size() == y.size(); });
}

/// The one place that knows the order of the values in a slot: calls `vector(Vector3f&)`, `rotation(Quaternionf&)`
/// and `scalar(float&)` for each field.
template <typename State, typename Vector, typename Rotation, typename Scalar>
void for_each_value(State& s, Vector&& vector, Rotation&& rotation, Scalar&& scalar) {
  for (auto& body : s.bodies) {
    for (auto& x : body) vector(x);
  }
  for (auto& x : s.needle_positions) vector(x);
  for (auto& q : s.needle_orientations) rotation(q);
  vector(s.probe_position);
  rotation(s.probe_orientation);
  vector(s.breath);
  vector(s.force);
  for (auto& target : s.targets) {
    vector(target.centre);
    scalar(target.distance);
  }
  scalar(s.force_scale);
  scalar(s.force_clipped);
  scalar(s.insertion_depth);
  scalar(s.probe_force);
  scalar(s.probe_area);
  scalar(s.probe_lifted);
}

std::size_t count_values(const FrameState& state) {
  std::size_t count = 0;
  for_each_value(
      state, [&](const Eigen::Vector3f&) { count += 3; }, [&](const Eigen::Quaternionf&) { count += 4; },
      [&](float) { ++count; });
  return count;
}

void require_sizes(const FrameState& prototype, const FrameState& state, const char* what) {
  if (same_sizes(prototype, state)) return;
  fmt::print(stderr, "state buffer: {} has {} bodies, {} needle nodes and {} values in all instead of {}, {}, {}\n",
             what, state.bodies.size(), state.needle_positions.size(), count_values(state), prototype.bodies.size(),
             prototype.needle_positions.size(), count_values(prototype));
  std::abort();
}

/// Reads a slot's values one after the other. Acquire: a value of a later publication brings with it the mark in
/// `sequence` that this publication had begun.
class SlotReader {
public:
  explicit SlotReader(const std::vector<std::atomic<float>>& values) : next_(values.data()) {}
  float scalar() { return (next_++)->load(std::memory_order_acquire); }
  Eigen::Vector3f vector() {
    const float x = scalar(), y = scalar(), z = scalar();
    return {x, y, z};
  }
  Eigen::Quaternionf rotation() {
    const float x = scalar(), y = scalar(), z = scalar(), w = scalar();
    return {w, x, y, z};
  }

private:
  const std::atomic<float>* next_;
};

}  // namespace

StateBuffer::StateBuffer(const FrameState& prototype, int history)
    : prototype_(prototype),
      slots_(static_cast<std::size_t>(std::max(history, kMinHistory))),
      newest_s_(-std::numeric_limits<double>::infinity()) {
  for (Slot& s : slots_) s.values = std::vector<std::atomic<float>>(count_values(prototype));
}

// A sequence lock. The usual formulation orders the plain copies by fences; here every word is stored with release
// and loaded with acquire, which orders as well, costs nothing on x86 and is understood by ThreadSanitizer.
bool StateBuffer::publish(const FrameState& state) {
  require_sizes(prototype_, state, "a published state");
  if (!std::isfinite(state.time_s) || state.time_s <= newest_s_.load(std::memory_order_relaxed)) return false;
  const std::uint64_t n = published_.load(std::memory_order_relaxed) + 1;
  Slot& s = slot(n);
  s.sequence.store(2 * n - 1, std::memory_order_relaxed);
  s.time_s.store(state.time_s, std::memory_order_release);
  s.simulation_step.store(state.simulation_step, std::memory_order_release);
  s.haptic_step.store(state.haptic_step, std::memory_order_release);
  std::atomic<float>* next = s.values.data();
  const auto put = [&next](float value) { (next++)->store(value, std::memory_order_release); };
  for_each_value(
      state, [&](const Eigen::Vector3f& v) { put(v.x()), put(v.y()), put(v.z()); },
      [&](const Eigen::Quaternionf& q) { put(q.x()), put(q.y()), put(q.z()), put(q.w()); }, put);
  s.sequence.store(2 * n, std::memory_order_release);
  published_.store(n, std::memory_order_release);
  newest_s_.store(state.time_s, std::memory_order_release);
  return true;
}

FrameStamps StateBuffer::sample(double time_s, FrameState& out) const {
  require_sizes(prototype_, out, "the frame to fill");
  if (std::isnan(time_s)) time_s = std::numeric_limits<double>::infinity();  // no time asked for: the newest
  FrameStamps stamps;
  // Ends when a copy is made while the writer publishes less than twice.
  while (!try_sample(time_s, out, stamps)) {
  }
  return stamps;
}

bool StateBuffer::try_sample(double time_s, FrameState& out, FrameStamps& stamps) const {
  stamps = {};
  const std::uint64_t newest = published_.load(std::memory_order_acquire);
  if (newest == 0) return true;
  const std::uint64_t offered = std::min<std::uint64_t>(newest, slots_.size() - 2);

  // From the newest backwards to the first one not later than the time asked for: `earlier`; `later` is the one
  // after.
  std::uint64_t earlier = newest;
  std::uint64_t later = newest;
  double earlier_s = 0, later_s = 0;
  for (std::uint64_t n = newest; n > newest - offered; --n) {
    const Slot& s = slot(n);
    const double t = s.time_s.load(std::memory_order_acquire);
    if (s.sequence.load(std::memory_order_relaxed) != 2 * n) return false;  // overtaken
    later = n == newest ? n : earlier;
    later_s = n == newest ? t : earlier_s;
    earlier = n;
    earlier_s = t;
    if (t <= time_s) break;
  }
  if (earlier_s > time_s || earlier_s == time_s) {  // before all that is offered, or hit
    later = earlier;
    later_s = earlier_s;
  }
  const Slot& a = slot(earlier);
  const Slot& b = slot(later);
  stamps.earlier_s = earlier_s;
  stamps.later_s = later_s;
  stamps.earlier_step = a.simulation_step.load(std::memory_order_acquire);
  stamps.later_step = b.simulation_step.load(std::memory_order_acquire);
  out.simulation_step = stamps.earlier_step;
  out.haptic_step = a.haptic_step.load(std::memory_order_acquire);
  SlotReader from(a.values);
  if (earlier == later) {
    stamps.provenance = earlier_s == time_s ? Provenance::exact : Provenance::held;
    out.time_s = earlier_s;
    for_each_value(
        out, [&](Eigen::Vector3f& v) { v = from.vector(); }, [&](Eigen::Quaternionf& q) { q = from.rotation(); },
        [&](float& x) { x = from.scalar(); });
  } else {
    stamps.provenance = Provenance::interpolated;
    out.time_s = time_s;
    const auto w = static_cast<float>((time_s - earlier_s) / (later_s - earlier_s));
    SlotReader to(b.values);
    for_each_value(
        out,
        [&](Eigen::Vector3f& v) {
          const Eigen::Vector3f v0 = from.vector(), v1 = to.vector();
          v = v0 + w * (v1 - v0);
        },
        [&](Eigen::Quaternionf& q) {
          const Eigen::Quaternionf q0 = from.rotation(), q1 = to.rotation();
          q = q0.slerp(w, q1);
        },
        [&](float& x) {
          const float x0 = from.scalar(), x1 = to.scalar();
          x = x0 + w * (x1 - x0);
        });
  }
  return a.sequence.load(std::memory_order_relaxed) == 2 * earlier &&
         b.sequence.load(std::memory_order_relaxed) == 2 * later;
}

}  // namespace stylet::state
