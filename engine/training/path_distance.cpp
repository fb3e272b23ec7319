#include "engine/training/path_distance.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

namespace stylet::training {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

double distance_to(const Eigen::Vector3d& x, const Path& polyline) {
  double nearest = polyline.empty() ? kInfinite : (x - polyline.front()).squaredNorm();
  for (std::size_t i = 1; i < polyline.size(); ++i) {
    const Eigen::Vector3d along = polyline[i] - polyline[i - 1];
    const Eigen::Vector3d from = x - polyline[i - 1];
    const double length = along.squaredNorm();
    const double share = length > 0 ? std::clamp(from.dot(along) / length, 0.0, 1.0) : 0.0;
    nearest = std::min(nearest, (from - share * along).squaredNorm());
  }
  return std::sqrt(nearest);
}

double farthest(const Path& path, const Path& from) {
  double largest = path.empty() ? kInfinite : 0;
  for (const Eigen::Vector3d& x : path) largest = std::max(largest, distance_to(x, from));
  return largest;
}

}  // namespace

Path resampled(std::span<const double> times, std::span<const Eigen::Vector3d> points, std::size_t count) {
  Path path;
  if (times.empty() || count == 0) return path;
  path.reserve(count);
  std::size_t after = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const double share = count > 1 ? static_cast<double>(k) / static_cast<double>(count - 1) : 0;
    const double t = times.front() + share * (times.back() - times.front());
    while (after + 1 < times.size() && times[after] < t) ++after;
    const std::size_t before = after > 0 ? after - 1 : 0;
    const double span = times[after] - times[before];
    const double along = span > 0 ? std::clamp((t - times[before]) / span, 0.0, 1.0) : 0.0;
    path.push_back(points[before] + along * (points[after] - points[before]));
  }
  return path;
}

double path_rms(const Path& path, const Path& reference) {
  if (path.empty()) return kInfinite;
  double sum = 0;
  for (const Eigen::Vector3d& x : path) sum += std::pow(distance_to(x, reference), 2);
  return std::sqrt(sum / static_cast<double>(path.size()));
}

double hausdorff(const Path& a, const Path& b) {
  return std::max(farthest(a, b), farthest(b, a));
}

double frechet(const Path& a, const Path& b) {
  if (a.empty() || b.empty()) return kInfinite;
  std::vector<double> before(b.size(), kInfinite), now(b.size());  // leash of the walks up to (i, j)
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < b.size(); ++j) {
      double way = std::min(before[j], j > 0 ? std::min(before[j - 1], now[j - 1]) : kInfinite);
      if (i == 0 && j == 0) way = 0;
      now[j] = std::max(way, (a[i] - b[j]).norm());
    }
    std::swap(before, now);
  }
  return before.back();
}

double dynamic_time_warping(const Path& a, const Path& b) {
  struct Way {
    double sum = kInfinite;
    double pairs = 0;
  };
  if (a.empty() || b.empty()) return kInfinite;
  std::vector<Way> before(b.size()), now(b.size());  // least sums of the matches up to (i, j)
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < b.size(); ++j) {
      Way way = before[j];
      if (j > 0 && before[j - 1].sum <= way.sum) way = before[j - 1];
      if (j > 0 && now[j - 1].sum < way.sum) way = now[j - 1];
      if (i == 0 && j == 0) way = {.sum = 0};
      now[j] = {.sum = way.sum + (a[i] - b[j]).norm(), .pairs = way.pairs + 1};
    }
    std::swap(before, now);
  }
  return before.back().sum / before.back().pairs;
}

}  // namespace stylet::training
