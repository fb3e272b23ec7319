// What the soaks share: a motion without end, and how much memory the process has.
#pragma once

#include "haptic/recorded_device.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <span>
#include <string>
#include <utility>

namespace stylet::tests {

/// The track forwards, backwards, then at rest at its start; again and again.
class RepeatedMotion final : public haptic::Device {
public:
  /// @param step_s  of the simulation: a pass takes a whole number of them, so that each lays the same contacts
  RepeatedMotion(haptic::RecordedDevice track, double step_s)
      : track_(std::move(track)),
        pass_s_(std::ceil((2 * (track_.end_s() - track_.start_s()) + kRest) / step_s) * step_s) {}
  std::string name() const override { return "repeated " + track_.name(); }
  haptic::DeviceLimits limits() const override { return track_.limits(); }
  haptic::StylusSample read(double now_s) override {
    const double t = std::fmod(now_s, pass_s_);
    const double length = track_.end_s() - track_.start_s();
    return track_.read(track_.start_s() + (t < length ? t : std::max(0.0, 2 * length - t)));
  }
  void write(const Eigen::Vector3d&, const Eigen::Vector3d&) override {}
  double pass_s() const { return pass_s_; }

private:
  static constexpr double kRest = 1;  // s, at the end of a pass with the needle outside

  haptic::RecordedDevice track_;
  double pass_s_;
};

inline double resident_mib() {
  std::ifstream file("/proc/self/statm");
  double total = 0, resident = 0;
  file >> total >> resident;
  return resident * static_cast<double>(sysconf(_SC_PAGESIZE)) / (1 << 20);
}

/// How much the floor of what is resident has risen from the first quarter of the samples to the last. The allocator
/// keeps a large block that was freed, or gives it back, as it likes: single samples differ by such a block.
inline double growth(std::span<const double> samples) {
  const std::size_t quarter = (samples.size() + 3) / 4;
  return std::ranges::min(samples.last(quarter)) - std::ranges::min(samples.first(quarter));
}

/// Minutes as an environment variable has them.
inline double minutes(const char* variable, double otherwise) {
  const char* text = std::getenv(variable);
  const double value = text == nullptr ? otherwise : std::atof(text);
  return std::isfinite(value) && value > 0 ? value : otherwise;
}

}  // namespace stylet::tests
