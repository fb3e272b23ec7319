// What a hand is to feel of a new device: a spring, a wall, friction, a skin that gives way.
#pragma once

#include "haptic/device.h"

#include <Eigen/Core>

#include <array>
#include <cstdint>

namespace stylet::haptic {

enum class Feel : std::uint8_t { kSpring, kWall, kFriction, kPuncture };
inline constexpr std::array kFeels{Feel::kSpring, Feel::kWall, Feel::kFriction, Feel::kPuncture};

/// One of them, as strong as the limits allow. Frame: right, up, near; origin where the hand began. Depends on its
/// inputs only. @realtime
///   spring    f = -k x
///   wall      kDepth below the origin: f_up = k p + b max(0, dp/dt), p > 0 how deep
///   friction  f = -k (x - a), the anchor a drawn along where |f| would pass F: it takes, and never gives, energy
///   puncture  as the wall without b until k p reaches F; then friction along the vertical of F/5 until the hand is
///   out
class FeelModel {
public:
  static constexpr double kDepth = 0.020;  ///< m

  FeelModel(Feel feel, const DeviceLimits& limits);

  /// @param position  of the hand, m @param dt_s  since the last step
  /// @return N
  Eigen::Vector3d step(const Eigen::Vector3d& position, double dt_s);

  double stiffness() const { return stiffness_; }  ///< N/m
  double force() const { return force_; }          ///< F, N
  int punctures() const { return punctures_; }

private:
  Eigen::Vector3d friction(const Eigen::Vector3d& position, double most);

  Feel feel_;
  double stiffness_;
  double damping_;
  double force_;
  bool begun_ = false;
  bool open_ = false;  // the skin
  int punctures_ = 0;
  Eigen::Vector3d last_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d anchor_ = Eigen::Vector3d::Zero();
};

}  // namespace stylet::haptic
