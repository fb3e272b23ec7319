#include "engine/motion/stroke_motion.h"

#include "engine/content/breathing.h"

#include <algorithm>
#include <cmath>
#include <functional>

namespace stylet::motion {
namespace {

constexpr double kPeakSpeed = 0.040;  // m/s
constexpr double kSteepest = 1.875;   // of eased()

/// Minimum-jerk profile on [0, 1].
double eased(double t) {
  t = std::clamp(t, 0.0, 1.0);
  return t * t * t * (10 - 15 * t + 6 * t * t);
}

double stroke_time(double length) {
  return kSteepest * std::abs(length) / kPeakSpeed;
}

/// +Z along `axis`, +X (the side that the bevel faces) as near to `side` as that allows.
Eigen::Quaterniond pointing(const Eigen::Vector3d& axis, const Eigen::Vector3d& side) {
  Eigen::Matrix3d frame;
  frame.col(2) = axis;
  frame.col(1) = axis.cross(side).normalized();
  frame.col(0) = frame.col(1).cross(axis);
  return Eigen::Quaterniond(frame);
}

/// Hub from where the tip is and where the needle points.
content::MotionSample sample(double t, const Eigen::Vector3d& tip, const Eigen::Vector3d& axis, double length,
                             const Eigen::Vector3d& side = Eigen::Vector3d::UnitY()) {
  content::MotionSample out;
  out.time_s = t;
  out.pose.position = tip - length * axis;
  out.pose.orientation = pointing(axis, side);
  return out;
}

}  // namespace

content::Motion tour_motion(const TourPlan& plan) {
  constexpr double kClear = 0.012;  // m above the entry, between two insertions
  constexpr double kRest = 1.2, kTurn = 0.9, kBegin = 0.5;
  struct Leg {
    double begin;
    Eigen::Vector3d from, to;            // of the tip
    Eigen::Vector3d from_axis, to_axis;  // turned from one to the other
    double duration;
  };
  std::vector<Leg> legs;
  double t = 0;
  const auto go = [&](const Eigen::Vector3d& to, const Eigen::Vector3d& axis, double duration) {
    const Eigen::Vector3d from = legs.empty() ? to : legs.back().to;
    const Eigen::Vector3d from_axis = legs.empty() ? axis : legs.back().to_axis;
    legs.push_back({t, from, to, from_axis, axis, duration});
    t += duration;
  };
  Eigen::Vector3d entry = plan.entry;
  for (const content::Target& target : plan.targets) {
    const Eigen::Vector3d aim = target.centre - Eigen::Vector3d(0, 0, plan.below);
    const Eigen::Vector3d axis = (aim - entry).normalized();
    const Eigen::Vector3d clear = entry - kClear * axis;
    entry += plan.apart;
    go(clear, axis, legs.empty() ? kBegin : kTurn);
    const Eigen::Vector3d end = aim - std::max(target.radius - plan.inside, 0.0) * axis;
    const double way = stroke_time((end - clear).norm());
    go(end, axis, way);
    go(end, axis, kRest);
    go(clear, axis, way);
  }
  content::Motion motion;
  std::size_t leg = 0;
  for (int i = 0; i <= static_cast<int>(std::floor(t * plan.sample_hz)); ++i) {
    const double now = i / plan.sample_hz;
    while (leg + 1 < legs.size() && now >= legs[leg + 1].begin) ++leg;
    const Leg& at = legs[leg];
    const double share = eased((now - at.begin) / at.duration);
    const Eigen::Vector3d axis = (at.from_axis + share * (at.to_axis - at.from_axis)).normalized();
    motion.stylus.push_back(
        sample(now, at.from + share * (at.to - at.from), axis, plan.needle_length, Eigen::Vector3d::UnitZ()));
  }
  return motion;
}

content::Motion stay_motion(const StayMotionPlan& plan) {
  constexpr double kOutside = 0.040, kWait = 0.5, kPress = 0.3;
  const Eigen::Vector3d axis = (plan.target - plan.entry).normalized();
  const Eigen::Vector3d begin = plan.entry - kOutside * axis;
  const Eigen::Vector3d end = plan.target + (plan.exposed / 2 + plan.beyond) * axis;
  const double way = stroke_time((end - begin).norm());
  const double there = plan.begin + way;
  const Eigen::Vector3d pivot = plan.entry + plan.pivot_depth * axis;
  const double leave = there + kWait + plan.stay;
  const double last = leave + (plan.withdraw ? way : 0);
  content::Motion motion;
  for (int i = 0; i <= static_cast<int>(last * plan.sample_hz); ++i) {
    const double now = i / plan.sample_hz;
    const double share = eased((now - plan.begin) / way);
    Eigen::Vector3d tip = begin + share * (end - begin);
    Eigen::Vector3d along = axis;
    if (now > there) {
      tip += content::inspiration(plan.breathing, now) * plan.carried;
      along = (tip - pivot).normalized();
      if (now > leave) tip -= eased((now - leave) / way) * (end - begin).norm() * along;
    }
    motion.stylus.push_back(sample(now, tip, along, plan.needle_length));
    const bool begins = now > there + kWait && now < there + kWait + kPress;
    const bool ends = plan.withdraw && now > leave - 2 * kPress && now < leave - kPress;
    motion.stylus.back().buttons = begins || ends ? 1U : 0U;
  }
  return motion;
}

}  // namespace stylet::motion
