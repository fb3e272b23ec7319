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
  /// One that feels it. @param skin  outlives this @param stiffness, damping  see SkinCoupling
  ProbeHand(const content::Scene& scene, HeldProbe& probe, FeltSkin& skin, double stiffness, double damping)
      : scene_(scene), probe_(probe), skin_(&skin), coupling_(stiffness, damping, kDeepest) {
    probe.keep_up();
  }

  /// @param position, orientation  of the hand, patient frame
  /// @param time_s                 of the session
  /// @return false: there is no skin beneath the hand; the probe stays where it was
  bool follow(const Eigen::Vector3d& position, const Eigen::Quaterniond& orientation, double time_s);
  /// Between two calls of follow(): what a hand here feels of the skin, patient frame, N; zero without skin beneath
  /// it.
  /// @param dt_s  since the last call
  /// @realtime
  Eigen::Vector3d force(const Eigen::Vector3d& position, const Eigen::Quaterniond& orientation, double dt_s);
  /// The hand lets go, or is not seen; the probe stays.
  void release() {
    hand_.reset();
    under_.reset();
    before_.reset();
    speed_ = 0;
  }

  static constexpr double kDeepest = 0.010;  ///< m
  static constexpr double kHighest = 0.030;

private:
  static constexpr double kSpeedOver = 0.002;  ///< s: a pose that comes twice is no hand that stands

  /// The skin at rest beneath the hand.
  struct Under {
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    Eigen::Vector3d inwards = Eigen::Vector3d::UnitZ();  ///< unit: of the scene's probe there
  };
  /// Of the hand as hand_ has it, and its speed.
  SkinCoupling::Press press(const Under& under) const;

  const content::Scene& scene_;
  HeldProbe& probe_;
  FeltSkin* skin_ = nullptr;  ///< null: the hand feels none
  SkinCoupling coupling_{1, 0, kDeepest};
  std::optional<Under> under_;
  std::optional<Eigen::Vector3d> before_;     ///< where force() last had the hand
  double speed_ = 0;                          ///< of the hand inwards, over kSpeedOver, m/s
  std::optional<haptic::WorkspaceMap> hand_;  ///< from the hand to where it would have the probe
};

}  // namespace stylet::session
