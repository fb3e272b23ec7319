#include "engine/immersive/thumb_on_scanner.h"

#include <cmath>

namespace stylet::immersive {

namespace {

constexpr float kTaken = 0.7F;  // of the stick's way: a thumb at rest on it turns nothing
constexpr float kLetGo = 0.4F;
constexpr double kFirst = 0.5;  // s until it repeats
constexpr double kAgain = 0.15;

}  // namespace

/// Along the axis it is pushed further.
ThumbOnScanner::Push ThumbOnScanner::direction(const Eigen::Vector2f& stick) {
  if (std::abs(stick.y()) > std::abs(stick.x())) return stick.y() < 0 ? Push::down : Push::up;
  return stick.x() < 0 ? Push::left : Push::right;
}

std::vector<scanner::Command> ThumbOnScanner::commands(const headset::Hands& hands, double time_s) {
  std::vector<scanner::Command> all;
  if (hands.freeze_pressed) all.emplace_back(scanner::Freeze{});
  const Eigen::Vector2f& stick = hands.probe().stick;
  const float pushed = stick.cwiseAbs().maxCoeff();
  if (held_ != Push::none && (pushed < kLetGo || direction(stick) != held_)) held_ = Push::none;
  const bool taken = held_ == Push::none && pushed > kTaken;
  if (taken) held_ = direction(stick);
  if (held_ == Push::none || (!taken && time_s < next_s_)) return all;
  next_s_ = time_s + (taken ? kFirst : kAgain);
  const double way = held_ == Push::up || held_ == Push::right ? 1 : -1;
  if (held_ == Push::up || held_ == Push::down) {
    all.emplace_back(scanner::SetGain{way * scanner::kGainStep, true});
  } else {
    all.emplace_back(scanner::SetDepth{way * scanner::kDepthStep, true});
  }
  return all;
}

}  // namespace stylet::immersive
