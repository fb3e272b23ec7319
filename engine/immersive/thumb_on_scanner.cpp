#include "engine/immersive/thumb_on_scanner.h"

#include <cmath>

namespace stylet::immersive {

namespace {

constexpr float kTaken = 0.7F;  // of the stick's way: a thumb at rest on it turns nothing
constexpr float kLetGo = 0.4F;
constexpr double kFirst = 0.5;  // s until it repeats
constexpr double kAgain = 0.15;

/// The knob that a stick means, along the axis it is pushed further.
view::Input::Stroke knob(const Eigen::Vector2f& stick) {
  const bool gain = std::abs(stick.y()) > std::abs(stick.x());
  return {.key = gain ? 'G' : 'D', .shift = (gain ? stick.y() : stick.x()) < 0};
}

}  // namespace

std::vector<view::Input::Stroke> ThumbOnScanner::strokes(const headset::Hands& hands, double time_s) {
  std::vector<view::Input::Stroke> all;
  if (hands.freeze_pressed) all.push_back({.key = ' '});
  const Eigen::Vector2f& stick = hands.left.stick;
  const float pushed = stick.cwiseAbs().maxCoeff();
  if (held_.key != 0) {
    const view::Input::Stroke now = knob(stick);
    if (pushed < kLetGo || now.key != held_.key || now.shift != held_.shift) held_ = {};
  }
  if (held_.key == 0 && pushed > kTaken) {
    held_ = knob(stick);
    all.push_back(held_);
    next_s_ = time_s + kFirst;
  } else if (held_.key != 0 && time_s >= next_s_) {
    all.push_back({.key = held_.key, .shift = held_.shift, .repeated = true});
    next_s_ = time_s + kAgain;
  }
  return all;
}

}  // namespace stylet::immersive
