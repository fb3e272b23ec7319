// The hand that holds the probe gives way where the skin does not (physics/README.md eq. 33c).
#pragma once

#include "physics/contact/organ_contact.h"
#include "physics/messages/messages.h"

#include <optional>

namespace stylet::physics {

/// One axis, that of the head: the head stays behind where the hand would have it by s = s_g (F / F_g)^4, F being the
/// force along the axis. Nothing to feel at the forces of an examination; nobody presses with hundreds of newtons.
class ProbeGrip {
public:
  explicit ProbeGrip(const ProbeContactSettings& settings);

  /// Where the head is, from where the hand would have it. A part of what the hand advances gives way at once.
  RigidPose head(const RigidPose& held);
  /// Follows (33c) by a step of Newton's method, and lessens the stiffness that the hand is told by its own.
  /// @param contact  of the head at that pose; `yielded` is set
  void feel(const RigidPose& head, ProbeContact& contact);
  /// The hand is off.
  void release();

private:
  double force_ = 0;       // F_g, N
  double yield_ = 0;       // s_g, m
  double yielded_ = 0;     // s, m
  double lost_share_ = 0;  // of an advance, what gives way and does not press
  std::optional<Eigen::Vector3d> held_before_{};
};

}  // namespace stylet::physics
