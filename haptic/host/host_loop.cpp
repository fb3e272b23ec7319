#include "haptic/host/host_loop.h"

#include <array>
#include <span>
#include <utility>

namespace stylet::haptic::host {

bool HostLoop::obey() {
  const std::int64_t now_ns = clock_.now_ns();
  // What waited that long may be as old.
  const bool fresh = now_ns - std::exchange(looked_ns_, now_ns) < kSilence;
  std::array<std::uint8_t, ReportRing::kBytes> report{};
  bool any = false;
  while (const std::size_t size = channel_.orders.take(next_, report)) {
    const auto bytes = std::span(report).first(size);
    any = true;
    if (!fresh && bytes[0] == hid::kForceReport) continue;
    if (!adapter_.output(bytes, now_ns)) adapter_.set_gain(bytes);
  }
  if (adapter_.enabled() != on_) {
    on_ = adapter_.enabled();
    driver_.enable(on_);
  }
  if (pose_ns_ == 0 || now_ns - pose_ns_ >= kSilence) adapter_.interrupt();
  // A force that is over does not wait behind the next read.
  const bool over = pushed_ && adapter_.force(now_ns).isZero(0);
  return (!any && !over) || push(now_ns);
}

bool HostLoop::push(std::int64_t now_ns) {
  if (pose_ns_ == 0 || now_ns - pose_ns_ >= kSilence) adapter_.interrupt();
  const Eigen::Vector3d force = adapter_.force(now_ns);
  const bool done = driver_.push(force);
  pushed_ = !force.isZero(0) || (pushed_ && !done);
  return done;
}

bool HostLoop::turn() {
  obey();
  hid::AdaptedState state;
  // The library may take its time: the pose is as old as the question, the force is that of afterwards.
  const std::int64_t asked_ns = clock_.now_ns();
  const Driver::Read read = driver_.read(state, asked_ns);
  const std::int64_t now_ns = clock_.now_ns();
  if (read == Driver::Read::kGone) return false;
  if (read == Driver::Read::kPose) {
    pose_ns_ = asked_ns;
    channel_.poses.put(adapter_.input(state, asked_ns));
    if (state.told_force) {
      for (int axis = 0; axis < 3; ++axis) {
        channel_.told_force[axis].store((*state.told_force)[axis], std::memory_order_relaxed);
      }
      channel_.tells.store(1, std::memory_order_release);
    }
  }
  push(now_ns);
  channel_.alive_ns.store(now_ns, std::memory_order_relaxed);
  return true;
}

}  // namespace stylet::haptic::host
