// A tracked hand that holds the probe: free in the air, the probe stays on the skin beneath it.
#pragma once

#include "engine/content/scene.h"
#include "engine/session/felt_skin.h"
#include "engine/session/held_probe.h"
#include "haptic/workspace_map.h"

#include <optional>

namespace stylet::session {

/// From where the hand takes it up the probe slides, turns and is pressed as the hand moves: no deeper into the skin
/// than kDeepest, as a hand may not feel it, and no higher over it than kHighest. Thread: the display's, or the
/// device's.
class ProbeHand {
public:
  /// A hand that feels no skin. Keeps references.
  ProbeHand(const content::Scene& scene, HeldProbe& probe) : scene_(scene), probe_(probe) {}
  /// One that feels it, through a spring. @param skin  outlives this @param stiffness  of the spring, N/m
  ProbeHand(const content::Scene& scene, HeldProbe& probe, FeltSkin& skin, double stiffness)
      : scene_(scene), probe_(probe), skin_(&skin), coupling_(stiffness, kDeepest) {
    probe.keep_up();
  }

  /// @param position, orientation  of the hand, patient frame
  /// @param time_s                 of the session
  /// @return false: there is no skin beneath the hand; the probe stays where it was
  bool follow(const Eigen::Vector3d& position, const Eigen::Quaterniond& orientation, double time_s);
  /// Between two calls of follow(): what a hand here feels of the skin, patient frame, N; zero without skin beneath
  /// it.
  /// @realtime
  Eigen::Vector3d force(const Eigen::Vector3d& position, const Eigen::Quaterniond& orientation);
  /// The hand lets go, or is not seen; the probe stays.
  void release() {
    hand_.reset();
    under_.reset();
  }

  static constexpr double kDeepest = 0.010;  ///< m
  static constexpr double kHighest = 0.030;

private:
  /// The skin at rest beneath the hand.
  struct Under {
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    Eigen::Vector3d inwards = Eigen::Vector3d::UnitZ();  ///< unit: of the scene's probe there
  };
  /// Of the hand as hand_ has it.
  SkinCoupling::Press press(const Under& under) const;

  const content::Scene& scene_;
  HeldProbe& probe_;
  FeltSkin* skin_ = nullptr;  ///< null: the hand feels none
  SkinCoupling coupling_{1, kDeepest};
  std::optional<Under> under_;
  std::optional<haptic::WorkspaceMap> hand_;  ///< from the hand to where it would have the probe
};

}  // namespace stylet::session
