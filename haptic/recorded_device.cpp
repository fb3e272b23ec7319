#include "haptic/recorded_device.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace stylet::haptic {
namespace {

void check_track(const std::vector<StylusSample>& track) {
  if (track.empty()) throw std::invalid_argument("stylus track: it is empty; give at least one sample");
  for (std::size_t i = 0; i < track.size(); ++i) {
    const StylusSample& s = track[i];
    const std::string where = "stylus track: sample " + std::to_string(i) + ": ";
    if (!std::isfinite(s.time_s) || !s.position.allFinite() || !s.orientation.coeffs().allFinite()) {
      throw std::invalid_argument(where + "a value is not finite");
    }
    if (!(s.orientation.norm() > 1e-6)) throw std::invalid_argument(where + "the orientation is a zero quaternion");
    if (i > 0 && !(s.time_s > track[i - 1].time_s)) {
      throw std::invalid_argument(where + "its time is not later than the one before");
    }
  }
}

/// Slope at a sample between two intervals of lengths h0, h1 and mean slopes d0, d1: zero at an extremum, else the
/// weighted harmonic mean of Fritsch & Butland 1984, which keeps the interpolant monotone in both intervals.
double monotone_slope(double h0, double d0, double h1, double d1) {
  if (!(d0 * d1 > 0)) return 0;
  const double w0 = 2 * h1 + h0;
  const double w1 = h1 + 2 * h0;
  return (w0 + w1) / (w0 / d0 + w1 / d1);
}

}  // namespace

RecordedDevice::RecordedDevice(std::vector<StylusSample> track, DeviceLimits limits, std::string name)
    : name_(std::move(name)), limits_(limits), track_(std::move(track)) {
  check_track(track_);
  const std::size_t n = track_.size();
  keys_.resize(n);
  slopes_.assign(n, Key::Zero());
  for (std::size_t i = 0; i < n; ++i) {
    Eigen::Vector4d q = track_[i].orientation.normalized().coeffs();
    // q and -q are the same rotation: take the one on the side of its predecessor, so that the way between is short.
    if (i > 0 && q.dot(keys_[i - 1].tail<4>()) < 0) q = -q;
    keys_[i] << track_[i].position, q;
  }
  for (std::size_t i = 1; i + 1 < n; ++i) {
    const double h0 = track_[i].time_s - track_[i - 1].time_s;
    const double h1 = track_[i + 1].time_s - track_[i].time_s;
    for (int c = 0; c < 7; ++c) {
      slopes_[i][c] =
          monotone_slope(h0, (keys_[i][c] - keys_[i - 1][c]) / h0, h1, (keys_[i + 1][c] - keys_[i][c]) / h1);
    }
  }
}

StylusSample RecordedDevice::read(double now_s) {
  const auto after = std::upper_bound(track_.begin(), track_.end(), now_s,
                                      [](double t, const StylusSample& s) { return t < s.time_s; });
  // The sample at or before the time; the first where there is none.
  const std::size_t i = after == track_.begin() ? 0 : static_cast<std::size_t>(after - track_.begin()) - 1;
  StylusSample out = track_[i];
  out.time_s = now_s;
  Key key = keys_[i];
  if (now_s > track_[i].time_s && i + 1 < track_.size()) {
    const double h = track_[i + 1].time_s - track_[i].time_s;
    const double s = (now_s - track_[i].time_s) / h;
    key = keys_[i] + (s * s * (3 - 2 * s)) * (keys_[i + 1] - keys_[i]) +
          h * s * (1 - s) * ((1 - s) * slopes_[i] - s * slopes_[i + 1]);
  }
  out.position = key.head<3>();
  out.orientation = Eigen::Quaterniond(Eigen::Vector4d(key.tail<4>())).normalized();
  return out;
}

}  // namespace stylet::haptic
