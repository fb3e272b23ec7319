// The controllers of a headset as what they hold: the needle in one hand, the probe in the other.
#pragma once

#include "engine/content/scene.h"
#include "engine/headset/headset_controllers.h"
#include "engine/session/probe_hand.h"
#include "haptic/hand_device.h"
#include "physics/messages/messages.h"

#include <optional>

namespace stylet::immersive {

/// What the hand with the needle is to feel of a puncture: more where the tip had to be pushed harder. Engineering
/// values: full at 3 N, and never less than what is felt at all.
headset::Vibration vibration_of(const physics::Puncture& puncture);

/// And as it is fired in it: the click of haptic::Click is too short for a controller.
inline constexpr headset::Vibration kRecoil{.amplitude = 1, .duration_s = 0.03};

/// Squeezed, or out of sight, a hand has let go: what it held stays, and is taken up again from wherever the hand is
/// then. The trigger of the hand with the needle is button 0 of the stylus. Thread: the display's.
class HandsOnPatient {
public:
  /// @param needle  null: something else leads the needle
  /// @param probe   null: the scene moves the probe
  /// All outlive this.
  HandsOnPatient(const content::Scene& scene, haptic::HandDevice* needle, session::HeldProbe* probe);

  /// With each frame. @param time_s  of the session
  void move(const headset::Hands& hands, double time_s);

private:
  Eigen::Isometry3d patient_from_room_;
  haptic::HandDevice* needle_;
  std::optional<session::ProbeHand> probe_;
};

}  // namespace stylet::immersive
