// A stylus that is tracked elsewhere: poses of the needle come in over the network.
#pragma once

#include "haptic/device.h"
#include "physics/messages/latest_value.h"
#include "physics/messages/messages.h"

#include <atomic>
#include <string>

namespace stylet::link {

/// The link's thread calls follow() as poses come (some 20 to 100 Hz, in steps); the haptic thread reads a smooth
/// motion, through two low-passes in series and never faster than kFastest: a tracker that jumps does not make the
/// needle jump. Neither thread waits for the other. A pose counts for kStale; without a newer one the samples are not
/// valid, and the hub stays where it is.
class LinkStylus final : public haptic::Device {
public:
  /// @param start  of the hub, until the first pose comes
  explicit LinkStylus(const physics::RigidPose& start);

  /// Link's thread: the hub belongs there. Patient frame, +Z from hub to tip.
  void follow(const physics::RigidPose& hub);

  std::string name() const override { return "link"; }
  /// Renders no force.
  haptic::DeviceLimits limits() const override { return {}; }
  haptic::StylusSample read(double now_s) override;
  void write(const Eigen::Vector3d&, const Eigen::Vector3d&) override {}

  static constexpr double kStale = 0.1;       ///< s
  static constexpr double kSmoothing = 0.02;  ///< s, of each low-pass
  static constexpr double kFastest = 0.5;     ///< m/s
  static constexpr double kFastestTurn = 6;   ///< rad/s

private:
  physics::LatestValue<physics::RigidPose> goal_;
  // Haptic thread's.
  physics::RigidPose first_stage_;
  physics::RigidPose second_stage_;
  double heard_s_ = -kStale;  ///< when the latest pose was first seen
  bool heard_ = false;
  double last_read_s_ = 0;
};

}  // namespace stylet::link
