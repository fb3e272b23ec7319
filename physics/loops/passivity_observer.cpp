#include "physics/loops/passivity_observer.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace stylet::physics {

using Eigen::Vector3d;

namespace {

constexpr double kSame = 1e-4;  // m: reversals no further apart are at the same depth

}  // namespace

PassivityObserver::PassivityObserver(const PassivitySettings& settings) : settings_(settings) {
  if (!(settings.window_s > 0) || !(settings.step_s > 0) || !(settings.window_s / settings.step_s < 1e6)) {
    throw std::invalid_argument("passivity: window and step must be positive, and a window at most 1e6 steps");
  }
  window_.resize(static_cast<std::size_t>(std::max(1L, std::lround(settings.window_s / settings.step_s))));
  summary_.window_s = settings.window_s;
}

void PassivityObserver::add(double time_s, const StylusPose& hub, const NeedleState& needle) {
  Mark now{.time_s = time_s, .way = last_.way, .work = needle.hand_work, .hub = hub, .force = needle.wrench.force};
  now.peak_force = now.force.norm();
  if (steps_ > 0) {
    const Vector3d axis = hub.orientation * Vector3d::UnitZ();
    now.way += axis.dot(hub.position - last_.hub.position);
  }
  slide(now);
  farthest_.peak_force = std::max(farthest_.peak_force, now.peak_force);
  for (std::size_t i = reversal_count_; i > 0 && reversals_[i - 1].peak_force < now.peak_force; --i) {
    reversals_[i - 1].peak_force = now.peak_force;  // no earlier one has seen less
  }

  if (steps_++ == 0) {
    farthest_ = now;
  } else if (direction_ == 0) {
    if (std::abs(now.way - farthest_.way) > settings_.reversal) {
      direction_ = now.way > farthest_.way ? 1 : -1;
      reversals_[reversal_count_++] = farthest_;
      farthest_ = now;
    }
  } else {
    if (direction_ * (now.way - farthest_.way) >= 0) farthest_ = now;
    if (direction_ * (farthest_.way - now.way) > settings_.reversal) turn_round(now);
    close_passed(now);
  }
  last_ = now;
}

void PassivityObserver::slide(const Mark& now) {
  std::array<double, 2>& oldest = window_[steps_ % window_.size()];
  const auto [then_s, then_work] = steps_ >= window_.size() ? oldest : window_.front();
  if (steps_ > 0 && now.work - then_work < summary_.least_window.work) {
    summary_.least_window = {.work = now.work - then_work, .from_s = then_s, .to_s = now.time_s};
  }
  oldest = {now.time_s, now.work};
}

// What is left of the way back is closed at the mean of the forces at both ends.
void PassivityObserver::close(const Mark& begin, const Mark& turn, const Mark& end) {
  const double stroke = std::abs(turn.way - begin.way);
  if (stroke < settings_.least_stroke) return;
  const Vector3d gap = begin.hub.position - end.hub.position;
  if (gap.norm() > settings_.most_gap ||
      begin.hub.orientation.angularDistance(end.hub.orientation) > settings_.most_turned) {
    ++summary_.open;
    return;
  }
  const double work = end.work - begin.work - 0.5 * (begin.force + end.force).dot(gap);
  if (summary_.cycles++ == 0 || work < summary_.least_cycle.work) {
    summary_.least_cycle = {
        .work = work, .from_s = begin.time_s, .to_s = end.time_s, .stroke = stroke, .peak_force = begin.peak_force};
  }
}

// The hub is beyond an earlier reversal, so the cycle between that and the one after it is closed.
void PassivityObserver::close_passed(const Mark& now) {
  while (reversal_count_ >= 2) {
    const Mark& begin = reversals_[reversal_count_ - 2];
    if (direction_ * (now.way - begin.way) < 0) return;
    close(begin, reversals_[reversal_count_ - 1], now);
    reversal_count_ -= 2;
  }
}

// The farthest point of the way was a reversal. One that is where the reversal before the last was closes its cycle.
void PassivityObserver::turn_round(const Mark& now) {
  if (reversal_count_ >= 2) {
    const Mark& begin = reversals_[reversal_count_ - 2];
    if (std::abs(farthest_.way - begin.way) <= kSame) {
      close(begin, reversals_[reversal_count_ - 1], farthest_);
      reversal_count_ -= 2;
    }
  }
  if (reversal_count_ == kReversals) {
    std::shift_left(reversals_.begin(), reversals_.end(), 1);
    --reversal_count_;
  }
  reversals_[reversal_count_++] = farthest_;
  direction_ = -direction_;
  farthest_ = now;
}

}  // namespace stylet::physics
