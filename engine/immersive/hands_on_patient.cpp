#include "engine/immersive/hands_on_patient.h"

#include <algorithm>
#include <cmath>

namespace stylet::immersive {

namespace {

constexpr std::uint32_t kButton0 = 1;

bool holds(const headset::Hand& hand) {
  return hand.tracked && !hand.squeeze;
}

constexpr double kFullForce = 3;  // N
constexpr double kLeastAmplitude = 0.25;
constexpr double kPulse = 0.04;  // s

}  // namespace

headset::Vibration vibration_of(const physics::Puncture& puncture) {
  return {std::clamp(std::abs(puncture.force) / kFullForce, kLeastAmplitude, 1.0), kPulse};
}

HandsOnPatient::HandsOnPatient(const content::Scene& scene, haptic::HandDevice* needle, session::HeldProbe* probe)
    : patient_from_room_(scene.room_from_patient.inverse()), needle_(needle) {
  if (probe != nullptr) probe_.emplace(scene, *probe);
}

void HandsOnPatient::move(const headset::Hands& hands, double time_s) {
  if (needle_ != nullptr) {
    const Eigen::Isometry3d hand = patient_from_room_ * hands.needle().room_from_grip;
    if (holds(hands.needle()))
      needle_->follow(hand.translation(), Eigen::Quaterniond(hand.linear()));
    else
      needle_->release();
    needle_->press(hands.needle().trigger ? kButton0 : 0);
  }
  if (probe_) {
    const Eigen::Isometry3d hand = patient_from_room_ * hands.probe().room_from_grip;
    if (holds(hands.probe()))
      probe_->follow(hand.translation(), Eigen::Quaterniond(hand.linear()), time_s);
    else
      probe_->release();
  }
}

}  // namespace stylet::immersive
