#include "engine/motion/biopsy_motion.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace stylet::motion {
namespace {

constexpr double kPi = std::numbers::pi;

/// One stroke of the hand: depth of the tip beyond the entry point, from one to the other.
struct Stroke {
  double from;        ///< m, negative outside
  double to;          ///< m
  double peak_speed;  ///< m/s; 0: a pause of `pause` seconds
  double pause;       ///< s
  double sway;        ///< sideways excursion of the hub in units of the plan's `lateral`
  double duration() const { return peak_speed > 0 ? 1.875 * std::abs(to - from) / peak_speed : pause; }
};

/// Minimum-jerk profile on [0, 1]; its largest slope is 1.875.
double minimum_jerk(double t) {
  return t * t * t * (10 - 15 * t + 6 * t * t);
}

/// Physiological tremor: three incommensurate sines, m.
double tremor(double t, double phase) {
  return 0.04e-3 *
         (std::sin(2 * kPi * 7.3 * t + phase) + 0.6 * std::sin(2 * kPi * 9.1 * t + 2.1 * phase) +
          0.4 * std::sin(2 * kPi * 10.7 * t + 3.7 * phase)) /
         2;
}

}  // namespace

BiopsyPlan demonstration(const Eigen::Vector3d& entry, const Eigen::Vector3d& target, double target_radius,
                         double needle_length) {
  return {.entry = entry,
          .target = target,
          .needle_length = needle_length,
          .lateral = 0,
          .steer = 0,
          .lead = 0,
          .beyond = 0.0093 - target_radius,
          .front = 0.0014,
          .back = 0,
          .last = 0.015,
          .last_speed = 0.020,
          .leaves = true};
}

content::Motion biopsy_motion(const BiopsyPlan& plan) {
  // Sideways is across the plan within the intercostal space, which runs round the trunk.
  const Eigen::Vector3d planned = (plan.target - plan.entry).normalized();
  const Eigen::Vector3d aim =
      plan.target + plan.lead * planned.cross(Eigen::Vector3d::UnitY()).normalized() + plan.beyond * planned;
  const double depth = (aim - plan.entry).norm();
  const double first = depth - plan.last;  // the first pass stops short of the end
  const double back = first - plan.back;
  std::vector<Stroke> strokes{{-0.045, -0.045, 0, plan.wait, 0},
                              {-0.045, -0.004, 0.042, 0, 0},
                              {-0.004, -0.004, 0, 0.3, 0},
                              {-0.004, first, 0.040, 0, 1},
                              {first, first, 0, 0.4, 0}};
  if (plan.back > 0) {
    strokes.push_back({first, back, 0.036, 0, 0});
    strokes.push_back({back, back, 0, 0.4, 0});
  }
  const std::size_t steered = strokes.size();
  strokes.push_back({back, depth, plan.last_speed, 0, 0});
  strokes.push_back({depth, depth, 0, 0.9, 0});
  if (plan.leaves) strokes.push_back({depth, -0.030, 0.042, 0, 0});
  double total = 0;
  for (const Stroke& stroke : strokes) total += stroke.duration();

  const Eigen::Vector3d axis = (aim - plan.entry) / depth;
  const Eigen::Vector3d across = axis.cross(Eigen::Vector3d::UnitY()).normalized();
  Eigen::Matrix3d frame;
  frame << across, axis.cross(across), axis;
  const Eigen::Quaterniond straight(frame);
  const Eigen::Vector3d start = plan.entry - plan.front * frame.col(1);
  // +X of the needle, the bevel's normal: the tip is pushed the other way.
  const Eigen::Quaterniond bevel(Eigen::AngleAxisd(plan.lead < 0 ? kPi : 0, Eigen::Vector3d::UnitZ()));

  content::Motion motion;
  const int samples = static_cast<int>(std::ceil(total * plan.sample_hz));
  for (int i = 0; i <= samples; ++i) {
    const double t = std::min(i / plan.sample_hz, total);
    double begin = 0;
    std::size_t s = 0;
    while (s + 1 < strokes.size() && t >= begin + strokes[s].duration()) begin += strokes[s++].duration();
    const Stroke& stroke = strokes[s];
    const double share = minimum_jerk(std::clamp((t - begin) / stroke.duration(), 0.0, 1.0));
    const double tip = stroke.from + share * (stroke.to - stroke.from);
    const double side = s > steered    ? plan.steer
                        : s == steered ? plan.steer * share
                                       : plan.lateral * stroke.sway * std::sin(2 * kPi * share);
    // The hand leans against the angle that would keep the needle straight through the entry point, by half of it:
    // that bends the needle.
    const double outside = std::max(plan.needle_length - std::max(tip, 0.0), 0.03);
    const double lean = -0.5 * std::atan2(side, outside);

    content::MotionSample sample;
    sample.time_s = t;
    const Eigen::Vector3d shake(tremor(t, 0.4), tremor(t, 1.7), 0.5 * tremor(t, 2.9));
    sample.pose.position = start + (tip - plan.needle_length) * axis + side * across + frame * shake;
    // A positive lean about +Y turns +Z towards +X; leaning back turns the tip towards the axis.
    sample.pose.orientation =
        straight * Eigen::Quaterniond(Eigen::AngleAxisd(-lean, Eigen::Vector3d::UnitY())) * bevel;
    sample.buttons = s == steered + 1 && t > begin + 0.4 ? 1u : 0u;
    if (motion.stylus.empty() || t > motion.stylus.back().time_s) motion.stylus.push_back(sample);
  }
  return motion;
}

}  // namespace stylet::motion
