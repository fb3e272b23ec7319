// Mouse and keyboard as a stylus: they move the needle sideways, tilt it, turn it, and move it in and out.
#pragma once

#include "haptic/device.h"

#include <atomic>
#include <string>

namespace stylet::haptic {

/// Where the mouse holds the needle.
struct MouseWorkspace {
  Eigen::Vector3d entry = Eigen::Vector3d::Zero();   ///< where the tip meets the skin at lateral offset 0, m
  Eigen::Vector3d axis = -Eigen::Vector3d::UnitZ();  ///< from hub to tip; normalised by the device
  Eigen::Vector3d right = Eigen::Vector3d::UnitX();  ///< mouse to the right; its part across the axis is used
  double needle_length = 0.150;                      ///< m
  double start_depth = -0.05;                        ///< of the tip below the entry along the axis, m
  double min_depth = -0.10;                          ///< the same, of the most drawn back
  double max_depth = 0.14;
  double max_lateral = 0.04;   ///< of the point it pivots about from the entry, m
  double max_tilt = 1.0;       ///< of the needle from the axis, each way, rad
  double smoothing_s = 0.040;  ///< time constant of each of the two low-passes
};

/// What mouse and keyboard ask of the needle, for MouseDevice::lead(); all at once.
struct NeedleMove {
  double right_m = 0, up_m = 0;
  double tilt_right_rad = 0, tilt_up_rad = 0;
  double twist_rad = 0;
  double advance_m = 0;
};

/// What a NeedleMove does to the needle as it is held now, by derivatives; patient frame.
struct NeedleMotion {
  Eigen::Vector3d hub = Eigen::Vector3d::Zero();     ///< where it goes to, m
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();  ///< of the straight needle there, m
  Eigen::Vector3d right = Eigen::Vector3d::Zero();   ///< of all of it, m/m
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  Eigen::Vector3d advance = Eigen::Vector3d::Zero();
  Eigen::Vector3d tilt_right = Eigen::Vector3d::Zero();  ///< of the hub, m/rad
  Eigen::Vector3d tilt_up = Eigen::Vector3d::Zero();
};

/// The window thread calls move(), advance() and press() as events come (some 60 Hz, in steps); the haptic thread
/// reads a smooth pose: each coordinate goes through two first-order low-passes in series, so that a jump of the
/// mouse becomes a motion with continuous velocity. The threads share seven atomics; neither waits for the other.
class MouseDevice final : public Device {
public:
  /// @throws std::invalid_argument  one line: axis or right is zero, they are parallel, or a range is empty
  explicit MouseDevice(const MouseWorkspace& workspace, DeviceLimits limits = {});

  /// Window thread: what the four below do.
  void lead(const NeedleMove& by);
  /// Window thread: where the goals are and what lead() would do to them.
  NeedleMotion motion() const;
  /// Window thread: moves the hub by so many metres to the right and towards `axis x right`.
  void move(double right_m, double up_m);
  /// Window thread: tilts the needle about where it meets the skin: the hub goes right and towards `axis x right`,
  /// rad.
  void tilt(double right_rad, double up_rad);
  /// Window thread: turns the needle, and with it the bevel, about its axis, rad.
  void twist(double angle_rad);
  /// Window thread: moves the needle forward (positive) along its axis, m.
  void advance(double depth_m);
  /// Window thread: the buttons that are down, one bit each.
  void press(std::uint32_t buttons) { buttons_.store(buttons, std::memory_order_relaxed); }

  std::string name() const override { return "mouse"; }
  DeviceLimits limits() const override { return limits_; }
  StylusSample read(double now_s) override;
  /// A mouse renders no force.
  void write(const Eigen::Vector3d&, const Eigen::Vector3d&) override {}

private:
  /// Of the needle's frame, from untilted.
  Eigen::Quaterniond tilted(double right_rad, double up_rad) const;

  MouseWorkspace workspace_;
  DeviceLimits limits_;
  Eigen::Vector3d up_;
  Eigen::Quaterniond orientation_;
  // Goals, written by the window thread only. Each coordinate is smoothed on its own, so reading them one by one is
  // as good as reading them at once.
  std::atomic<double> right_goal_{0};
  std::atomic<double> up_goal_{0};
  std::atomic<double> depth_goal_;
  std::atomic<double> tilt_right_goal_{0};
  std::atomic<double> tilt_up_goal_{0};
  std::atomic<double> twist_goal_{0};
  std::atomic<std::uint32_t> buttons_{0};
  // Haptic thread's.
  using Coordinates = Eigen::Vector<double, 6>;  // right, up, depth, tilt right, tilt up, twist
  Coordinates first_stage_ = Coordinates::Zero();
  Coordinates second_stage_ = Coordinates::Zero();
  double last_read_s_ = 0;
  bool read_before_ = false;
};

}  // namespace stylet::haptic
