#include "haptic/host/host_loop.h"

#include <array>
#include <span>

namespace stylet::haptic::host {

bool HostLoop::obey(std::int64_t now_ns) {
  std::array<std::uint8_t, ReportRing::kBytes> report{};
  bool any = false;
  while (const std::size_t size = channel_.orders.take(next_, report)) {
    const auto bytes = std::span(report).first(size);
    if (!adapter_.output(bytes, now_ns)) adapter_.set_gain(bytes);
    any = true;
  }
  if (adapter_.enabled() != on_) {
    on_ = adapter_.enabled();
    driver_.enable(on_);
  }
  return !any || push(now_ns);
}

bool HostLoop::push(std::int64_t now_ns) {
  if (pose_ns_ == 0 || now_ns - pose_ns_ >= kSilence) adapter_.interrupt();
  return driver_.push(adapter_.force(now_ns));
}

bool HostLoop::turn(std::int64_t now_ns) {
  obey(now_ns);
  hid::AdaptedState state;
  const Driver::Read read = driver_.read(state, now_ns);
  if (read == Driver::Read::kGone) return false;
  if (read == Driver::Read::kPose) {
    pose_ns_ = now_ns;
    channel_.poses.put(adapter_.input(state, now_ns));
  }
  push(now_ns);
  channel_.alive_ns.store(now_ns, std::memory_order_relaxed);
  return true;
}

}  // namespace stylet::haptic::host
