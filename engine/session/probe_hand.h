// A tracked hand that holds the probe: free in the air, the probe stays on the skin beneath it.
#pragma once

#include "engine/content/scene.h"
#include "engine/session/held_probe.h"
#include "haptic/workspace_map.h"

#include <optional>

namespace stylet::session {

/// From where the hand takes it up the probe slides, turns and is pressed as the hand moves. A hand feels no skin:
/// the probe goes no deeper into it than kDeepest, and no higher over it than kHighest. Thread: the display's, or the
/// device's.
class ProbeHand {
public:
  /// Keeps references.
  ProbeHand(const content::Scene& scene, HeldProbe& probe) : scene_(scene), probe_(probe) {}

  /// @param position, orientation  of the hand, patient frame
  /// @param time_s                 of the session
  /// @return false: there is no skin beneath the hand; the probe stays where it was
  bool follow(const Eigen::Vector3d& position, const Eigen::Quaterniond& orientation, double time_s);
  /// The hand lets go, or is not seen; the probe stays.
  void release() { hand_.reset(); }

  static constexpr double kDeepest = 0.010;  ///< m
  static constexpr double kHighest = 0.030;

private:
  const content::Scene& scene_;
  HeldProbe& probe_;
  std::optional<haptic::WorkspaceMap> hand_;  ///< from the hand to where it would have the probe
};

}  // namespace stylet::session
