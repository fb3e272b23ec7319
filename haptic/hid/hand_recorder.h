// What a device's reports say of the hand, one pose a report: for a recording without a session.
#pragma once

#include "haptic/hid/hand_follower.h"

#include <optional>
#include <span>

namespace stylet::haptic::hid {

/// The hub of an unmoved start (zero, no rotation) that follows the hand as a session's does: right, up and towards
/// the user, of pens right, near and along the needle. Depends on its inputs only.
class HandRecorder {
public:
  /// @param map        outlives it
  /// @param workspace  its axes and scale; where a session would begin counts for nothing
  HandRecorder(const StylusMap& map, const Workspace& workspace);

  /// @param arrived_ns  host clock, not decreasing
  /// @return the pose at the time when the device made the report, s since the first report, strictly increasing;
  /// nothing: the report says nothing of it
  std::optional<StylusSample> add(std::span<const std::uint8_t> report, std::int64_t arrived_ns);

private:
  const StylusMap& map_;
  HandFollower follower_;
  ReportClock clock_;
  HidReading reading_;
  bool started_ = false;
  std::int64_t begin_ns_ = 0;
  std::int64_t last_ns_ = 0;
};

}  // namespace stylet::haptic::hid
