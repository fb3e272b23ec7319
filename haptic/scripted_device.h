// A stylus moved by a formula: the procedure in its simplest form, with no file and no hand.
#pragma once

#include "haptic/device.h"

#include <string>
#include <vector>

namespace stylet::haptic {

/// The tip's way along the straight line from entry to target, and the hub's swing across it.
struct ScriptedMotion {
  /// A time at which the tip is at rest. Between two keys it moves with minimum jerk (twice continuously
  /// differentiable); two keys of equal depth are a pause.
  struct DepthKey {
    double time_fraction = 0;   ///< of `duration_s`, strictly increasing from 0 to 1
    double depth_fraction = 0;  ///< 0 at the entry, 1 at the target, negative: before the skin
  };

  Eigen::Vector3d entry = Eigen::Vector3d::Zero();   ///< where the tip meets the skin, m
  Eigen::Vector3d target = {0, 0, -0.08};            ///< where the tip ends, m
  Eigen::Vector3d bevel = Eigen::Vector3d::UnitX();  ///< direction of the bevel normal, not along the needle
  double needle_length = 0.150;                      ///< hub to tip, m
  double duration_s = 12;
  double lateral_amplitude = 0.010;  ///< of the S-curve of the hub along the bevel normal, m; 0: straight
  /// Approach, insertion with a lateral S-curve, partial withdrawal, second advance.
  std::vector<DepthKey> depth = {{0.00, -0.40}, {0.15, 0.00}, {0.50, 0.80}, {0.56, 0.80},
                                 {0.68, 0.40},  {0.72, 0.40}, {0.95, 1.00}, {1.00, 1.00}};
};

/// Pose of the hub at a time; the needle points from entry to target all the way, so the lateral swing bends it.
/// The swing is A sin(2 pi u) with u the fraction of the first insertion (from depth 0 to the first greatest depth
/// before a withdrawal), zero before and after. Held at both ends of the duration.
class ScriptedDevice final : public Device {
public:
  /// @throws std::invalid_argument  one line: what is wrong with the motion
  explicit ScriptedDevice(const ScriptedMotion& motion, DeviceLimits limits = {},
                          std::string name = "scripted stylus");

  std::string name() const override { return name_; }
  DeviceLimits limits() const override { return limits_; }
  /// A pure function of the time. @realtime O(keys)
  StylusSample read(double now_s) override;
  /// The script feels nothing.
  void write(const Eigen::Vector3d&, const Eigen::Vector3d&) override {}

  double duration_s() const { return motion_.duration_s; }

private:
  std::string name_;
  DeviceLimits limits_;
  ScriptedMotion motion_;
  Eigen::Vector3d axis_;   // unit, entry to target
  Eigen::Vector3d bevel_;  // unit, across the axis
  Eigen::Quaterniond orientation_;
  double length_ = 0;                // entry to target, m
  std::size_t first_insertion_ = 0;  // index of the key at which the first insertion starts; it ends at the next
};

}  // namespace stylet::haptic
