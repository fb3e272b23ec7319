// A stylus with force in a hand that gives way, without a device.
#pragma once

#include "engine/content/scene.h"
#include "haptic/device.h"
#include "physics/messages/messages.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <string>
#include <utility>

namespace stylet::tests {

/// A stylus of 45 g, held by a hand: a soft spring to where the hand wants it. Readings and forces travel.
class HeldStylus final : public haptic::Device {
public:
  /// @param wanted  where the hand wants the hub to be at a session time; its orientation is the hand's
  explicit HeldStylus(std::function<physics::StylusPose(double)> wanted, const haptic::DeviceLimits& limits = {})
      : limits_(limits), wanted_(std::move(wanted)) {
    limits_.renders_force = true;
    position_ = wanted_(0).position;
    seen_.fill(position_);
  }

  std::string name() const override { return "held stylus"; }
  haptic::DeviceLimits limits() const override { return limits_; }
  haptic::StylusSample read(double now_s) override {
    while (time_s_ < now_s) advance();
    return {
        .time_s = now_s,
        .position = seen_[0],
        .orientation = turned == 0 ? wanted_(now_s).orientation : Eigen::Quaterniond(turned, turned, turned, turned),
        .valid = plugged,
        .age_s = age_s};
  }
  void write(const Eigen::Vector3d& force, const Eigen::Vector3d&) override {
    sent = force;
    largest = std::max(largest, force.norm());
  }

  double speed() const { return velocity_.norm(); }
  const Eigen::Vector3d& seen() const { return seen_[0]; }

  bool plugged = true;
  double age_s = 0;
  double turned = 0;  ///< not 0: every component of the orientation that it reports
  Eigen::Vector3d sent = Eigen::Vector3d::Zero();
  double largest = 0;

private:
  // Half of the data sheet's delay is on the way in, half on the way out.
  static constexpr double kSubstep = 0.125e-3;
  static constexpr std::size_t kDelay = 6;
  static constexpr double kMass = 0.045, kGrip = 400;  // kg, N/m

  void advance() {
    time_s_ += kSubstep;
    std::rotate(on_the_way_.begin(), on_the_way_.begin() + 1, on_the_way_.end());
    on_the_way_.back() = sent;
    const Eigen::Vector3d force = on_the_way_[0] + kGrip * (wanted_(time_s_).position - position_) -
                                  limits_.physical_damping_n_s_per_m * velocity_;
    velocity_ += force / kMass * kSubstep;
    position_ += velocity_ * kSubstep;
    std::rotate(seen_.begin(), seen_.begin() + 1, seen_.end());
    seen_.back() = position_;
  }

  haptic::DeviceLimits limits_;
  std::function<physics::StylusPose(double)> wanted_;
  Eigen::Vector3d position_, velocity_ = Eigen::Vector3d::Zero();
  std::array<Eigen::Vector3d, kDelay> seen_;
  std::array<Eigen::Vector3d, kDelay> on_the_way_{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(),
                                                  Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero(),
                                                  Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  double time_s_ = 0;
};

/// A hand that goes 30 mm in by 0.8 s, 4 mm sideways by 1.4 s, then stays.
inline HeldStylus held_stylus(const content::Scene& scene, const haptic::DeviceLimits& limits = {}) {
  const Eigen::Vector3d above(0, 0, 0.1 + scene.needle.length);
  const Eigen::Quaterniond orientation = scene.motion.stylus.front().pose.orientation;
  return HeldStylus(
      [above, orientation](double t) {
        const auto ease = [](double u) { return 0.5 * (1 - std::cos(std::numbers::pi * std::clamp(u, 0.0, 1.0))); };
        return physics::StylusPose{
            above + Eigen::Vector3d(0.004 * ease((t - 0.8) / 0.6), 0, 0.005 - 0.035 * ease(t / 0.8)), orientation};
      },
      limits);
}

}  // namespace stylet::tests
