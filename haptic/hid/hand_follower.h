// The needle's hub led by the hand: engagement, clutch, and what to do while the hand cannot be seen.
#pragma once

#include "haptic/device.h"
#include "haptic/hid/pose_stream.h"
#include "haptic/hid/steered_hand.h"
#include "haptic/workspace_map.h"

namespace stylet::haptic::hid {

struct FollowSettings {
  DeviceKind kind = DeviceKind::kStylus;
  Workspace workspace{};
  RateSteering rate{};
  PenSteering pen{};
  std::uint32_t clutch = kSecondaryBarrelButton;  ///< while it is held the hub stays; 0: no button does that
  double stale_s = 0.020;  ///< a pose older than that is none; 0: the device may be silent while nothing moves
};

/// Gives the hub's pose for the latest pose of the hand. The sample is not valid, and the hub stays where it is,
/// while the device is away, out of range or silent by the host's clock, while the clutch is held, and for one step
/// after a gap; when the hand comes back it is taken up from where it is, and nothing jumps. Where the workspace has
/// a rest place the first engagement waits for the hand to come there. @realtime
class HandFollower {
public:
  explicit HandFollower(const FollowSettings& settings)
      : settings_(settings),
        map_(settings.workspace),
        rate_(settings.rate),
        pen_(settings.pen),
        waits_for_rest_(settings.workspace.rest && has_place(settings.kind)) {}

  /// @param now_ns  host clock, that of StreamedPose::made_ns; never goes back
  StylusSample follow(const StreamedPose& pose, std::int64_t now_ns);

  const WorkspaceMap& map() const { return map_; }
  /// Whether the hand has still to come to its rest place.
  bool waits_for_rest() const { return waits_for_rest_; }

  static constexpr double kAtRest = 0.010;  ///< m from the rest place

private:
  static bool has_place(DeviceKind kind) { return kind == DeviceKind::kStylus || kind == DeviceKind::kJoystick; }
  bool can_follow(const StreamedPose& pose, std::int64_t now_ns) const;

  FollowSettings settings_;
  WorkspaceMap map_;
  RateHand rate_;
  PenHand pen_;
  bool waits_for_rest_ = false;
  std::uint64_t gaps_ = 0;
  std::int64_t last_ns_ = 0;
};

}  // namespace stylet::haptic::hid
