// A pose for devices that measure none: a space mouse, which tells how hard it is pushed, and a pen on a tablet.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace stylet::haptic::hid {

/// Where a hand would be. Device frame, m.
struct HandPose {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
};

struct RateSteering {
  double reach_m = 0.15;  ///< from where it began, each axis
  double reach_rad = 1.2;
  double smoothing_s = 0.030;  ///< time constant: such devices report at 125 Hz
};

/// Adds up velocities, smoothed, within a box. @realtime
class RateHand {
public:
  explicit RateHand(const RateSteering& steering = {}) : steering_(steering) {}
  /// @param velocity, angular_velocity  m/s and rad/s
  HandPose step(const Eigen::Vector3d& velocity, const Eigen::Vector3d& angular_velocity, double dt_s);
  /// Comes to rest.
  void stop() { velocity_.setZero(), rate_.setZero(); }

private:
  RateSteering steering_;
  Eigen::Vector3d velocity_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d rate_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d position_ = Eigen::Vector3d::Zero();
  Eigen::Vector3d rotation_ = Eigen::Vector3d::Zero();  // rotation vector
};

struct PenSteering {
  double touch = 0.05;                             ///< of full pressure: less does not advance
  double full_speed_m_per_s = 0.04;                ///< at full pressure
  double min_depth_m = -0.05, max_depth_m = 0.14;  ///< from where it began
  double smoothing_s = 0.015;  ///< time constant of each of two low-passes: pens report at 130 to 300 Hz
};

/// What a pen does. Frame: X right and Y towards the trainee on the tablet, Z into it, which is along the needle.
struct PenInput {
  Eigen::Vector2d at = Eigen::Vector2d::Zero();  ///< on the tablet, m
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
  double push = 0;  ///< pressure, 0 to 1; negative: drawing back
  /// Axis of the needle as it is now, as long as the hand goes for a metre of the needle.
  Eigen::Vector3d along = Eigen::Vector3d::UnitZ();
};

/// A pen over a tablet moves the hub across the needle, and tilting and twisting it turns the needle about the hub;
/// pressing advances the needle along its axis, the harder the faster, and pressing with the barrel button held, or
/// with the eraser, draws it back. Pens report tilt in whole degrees: all of it is smoothed. @realtime
class PenHand {
public:
  explicit PenHand(const PenSteering& steering = {}) : steering_(steering) {}
  HandPose step(const PenInput& pen, double dt_s);
  /// The pen is taken off and may come back elsewhere.
  void lift() { placed_ = false; }

private:
  struct Stage {
    Eigen::Vector2d at = Eigen::Vector2d::Zero();
    Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
    Eigen::Vector3d advance = Eigen::Vector3d::Zero();  // by pushing
  };
  static void approach(Stage& stage, const Stage& goal, double share);

  PenSteering steering_;
  bool placed_ = false;
  double depth_ = 0;  // pushed, along the axes that the needle had
  Stage goal_;
  Stage first_stage_;
  Stage second_stage_;
};

}  // namespace stylet::haptic::hid
