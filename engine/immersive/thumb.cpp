#include "engine/immersive/thumb.h"

#include <cmath>

namespace stylet::immersive {
namespace {

constexpr float kTaken = 0.7F;  // of the stick's way: a thumb at rest on it pushes nothing
constexpr float kLetGo = 0.4F;
constexpr double kFirst = 0.5;  // s until it repeats
constexpr double kAgain = 0.15;

/// Along the axis it is pushed further.
Push direction(const Eigen::Vector2f& stick) {
  if (std::abs(stick.y()) > std::abs(stick.x())) return stick.y() < 0 ? Push::down : Push::up;
  return stick.x() < 0 ? Push::left : Push::right;
}

}  // namespace

Push Thumb::pushes(const Eigen::Vector2f& stick, double time_s) {
  const float pushed = stick.cwiseAbs().maxCoeff();
  if (held_ != Push::none && (pushed < kLetGo || direction(stick) != held_)) held_ = Push::none;
  const bool taken = held_ == Push::none && pushed > kTaken;
  if (taken) held_ = direction(stick);
  if (held_ == Push::none || (!taken && time_s < next_s_)) return Push::none;
  next_s_ = time_s + (taken ? kFirst : kAgain);
  return held_;
}

}  // namespace stylet::immersive
