#include "engine/scanner/calipers.h"

#include <fmt/format.h>

namespace stylet::scanner {

std::string distance_text(const Measure& measure) {
  return fmt::format("{:.1f} mm", measure.distance() * 1e3);
}

void Calipers::press(const Eigen::Vector2d& at) {
  if (under_way_) {
    measures_.back().to = at;
    under_way_ = false;
    return;
  }
  if (measures_.size() == kMost) measures_.erase(measures_.begin());
  measures_.push_back({at, at});
  under_way_ = true;
}

void Calipers::move(const Eigen::Vector2d& at) {
  if (under_way_) measures_.back().to = at;
}

void Calipers::release(const Eigen::Vector2d& at, double least) {
  if (!under_way_) return;
  measures_.back().to = at;
  under_way_ = measures_.back().distance() < least;
}

void Calipers::remove_last() {
  if (!measures_.empty()) measures_.pop_back();
  under_way_ = false;
}

void Calipers::clear() {
  measures_.clear();
  under_way_ = false;
}

std::vector<double> Calipers::distances() const {
  std::vector<double> distances;
  for (std::size_t i = 0; i + (under_way_ ? 1 : 0) < measures_.size(); ++i) {
    distances.push_back(measures_[i].distance());
  }
  return distances;
}

}  // namespace stylet::scanner
