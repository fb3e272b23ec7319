#include "haptic/hid/hand_recorder.h"

#include <algorithm>

namespace stylet::haptic::hid {
namespace {

constexpr std::int64_t kLeastStep = 1000;  // ns; reports that came in one transfer

FollowSettings settings_of(const StylusMap& map, const Workspace& workspace) {
  return {.kind = map.kind(),
          .workspace = {.patient_from_device = workspace.patient_from_device, .scale = workspace.scale},
          .stale_s = 0};
}

}  // namespace

HandRecorder::HandRecorder(const StylusMap& map, const Workspace& workspace)
    : map_(map), follower_(settings_of(map, workspace)), clock_(map.scan_tick_s() > 0 ? map.scan_tick_s() : 1e-4) {}

std::optional<StylusSample> HandRecorder::add(std::span<const std::uint8_t> report, std::int64_t arrived_ns) {
  if (map_.decode(report, reading_) != Decoded::kReading) return {};
  std::int64_t made_ns = arrived_ns;
  if ((reading_.carries & kScanTime) != 0) made_ns = clock_.stamp(reading_.scan_time, arrived_ns).made_ns;
  if (!started_) {
    started_ = true;
    begin_ns_ = made_ns;
    last_ns_ = made_ns - kLeastStep;
  }
  last_ns_ = std::max(made_ns, last_ns_ + kLeastStep);
  StylusSample sample = follower_.follow(
      {.reading = reading_, .made_ns = last_ns_, .not_before_ns = last_ns_, .connected = true}, last_ns_);
  sample.time_s = static_cast<double>(last_ns_ - begin_ns_) * 1e-9;
  return sample;
}

}  // namespace stylet::haptic::hid
