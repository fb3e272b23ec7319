// How far apart two paths are.
#pragma once

#include <Eigen/Core>

#include <span>
#include <vector>

namespace stylet::training {

using Path = std::vector<Eigen::Vector3d>;

/// `count` points evenly over the time of a motion, linear between its samples. Empty where there are no samples.
/// @param times  [points] ascending
Path resampled(std::span<const double> times, std::span<const Eigen::Vector3d> points, std::size_t count);

// All O(a * b), m; infinite where a path is empty.

/// Root mean square of the distance of a point of `path` to the polyline `reference`.
double path_rms(const Path& path, const Path& reference);
/// Largest distance of a point of one to the polyline of the other, both ways.
double hausdorff(const Path& a, const Path& b);
/// Shortest leash for two that walk along the points of each without going back: the discrete Fréchet distance, Eiter
/// and Mannila 1994.
double frechet(const Path& a, const Path& b);
/// Dynamic time warping, Sakoe and Chiba 1978: points are matched in order, each at least once, so that the sum of
/// their distances is least; that sum over the number of pairs.
double dynamic_time_warping(const Path& a, const Path& b);

}  // namespace stylet::training
