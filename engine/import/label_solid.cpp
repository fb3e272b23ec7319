#include "engine/import/label_solid.h"

#include "engine/files/error.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace stylet::import {
namespace {

constexpr int kMargin = 3;     // voxels around the labels
constexpr double kFull = 1e9;  // squared distance of what has no other side, voxels^2

/// Squared distance transform of one line: lower envelope of parabolas (Felzenszwalb and Huttenlocher 2012).
/// @param step  between samples, m
void transform_line(std::vector<double>& f, double step, std::vector<double>& out, std::vector<int>& at,
                    std::vector<double>& from) {
  const int n = static_cast<int>(f.size());
  int k = 0;
  at[0] = 0;
  from[0] = -std::numeric_limits<double>::infinity();
  from[1] = std::numeric_limits<double>::infinity();
  for (int q = 1; q < n; ++q) {
    const auto meet = [&](int p) {
      const double s2 = step * step;
      return ((f[q] + s2 * q * q) - (f[p] + s2 * p * p)) / (2 * s2 * (q - p));
    };
    double s = meet(at[k]);
    while (s <= from[k]) s = meet(at[--k]);
    ++k;
    at[k] = q;
    from[k] = s;
    from[static_cast<std::size_t>(k) + 1] = std::numeric_limits<double>::infinity();
  }
  k = 0;
  for (int q = 0; q < n; ++q) {
    while (from[static_cast<std::size_t>(k) + 1] < q) ++k;
    const double d = step * (q - at[k]);
    out[q] = d * d + f[at[k]];
  }
}

}  // namespace

LabelSolid::LabelSolid(const LabelImage& image, std::span<const int> labels, std::size_t most_voxels)
    : voxel_from_patient_(image.patient_from_voxel.inverse()) {
  std::vector<bool> wanted(std::size_t{1} << 16, false);
  for (const int label : labels) wanted[label] = true;
  Eigen::AlignedBox3i box;
  std::size_t count = 0;
  const Eigen::Vector3i& n = image.size;
  const auto image_index = [&](int i, int j, int k) {
    return static_cast<std::size_t>(i) +
           static_cast<std::size_t>(n.x()) *
               (static_cast<std::size_t>(j) + static_cast<std::size_t>(n.y()) * static_cast<std::size_t>(k));
  };
  for (int k = 0; k < n.z(); ++k) {
    for (int j = 0; j < n.y(); ++j) {
      for (int i = 0; i < n.x(); ++i) {
        if (!wanted[image.labels[image_index(i, j, k)]]) continue;
        box.extend(Eigen::Vector3i(i, j, k));
        ++count;
      }
    }
  }
  if (count == 0) throw files::ContentError("none of the labels occurs in the volume");
  touches_rim_ = (box.min().array() == 0).any() || (box.max().array() == n.array() - 1).any();
  volume_ = static_cast<double>(count) * std::abs(image.patient_from_voxel.linear().determinant());
  first_ = box.min().array() - kMargin;
  size_ = box.sizes().array() + 2 * kMargin + 1;
  const auto index = [&](int i, int j, int k) {
    return static_cast<std::size_t>(i) +
           static_cast<std::size_t>(size_.x()) *
               (static_cast<std::size_t>(j) + static_cast<std::size_t>(size_.y()) * static_cast<std::size_t>(k));
  };
  const std::size_t total = index(0, 0, size_.z());
  if (total > most_voxels) {
    throw files::ContentError(
        fmt::format("the box around its labels has {} x {} x {} voxels, {:.3g} in all, accepted "
                    "are {:.3g}; resample the volume to larger voxels",
                    size_.x(), size_.y(), size_.z(), static_cast<double>(total), static_cast<double>(most_voxels)));
  }

  // Share of the labels, smoothed along each axis by [1 2 1] / 4.
  std::vector<float> share(total, 0);
  for (int k = 0; k < size_.z(); ++k) {
    for (int j = 0; j < size_.y(); ++j) {
      for (int i = 0; i < size_.x(); ++i) {
        const Eigen::Vector3i v = first_ + Eigen::Vector3i(i, j, k);
        if ((v.array() < 0).any() || (v.array() >= n.array()).any()) continue;
        if (wanted[image.labels[image_index(v.x(), v.y(), v.z())]]) share[index(i, j, k)] = 1;
      }
    }
  }
  const std::array<std::size_t, 3> stride{1, index(0, 1, 0), index(0, 0, 1)};
  std::vector<float> smooth(total);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    smooth = share;
    for (std::size_t v = stride[axis]; v + stride[axis] < total; ++v) {
      smooth[v] = 0.25F * share[v - stride[axis]] + 0.5F * share[v] + 0.25F * share[v + stride[axis]];
    }
    share.swap(smooth);
  }

  // Distance of voxel centres to the level 1/2. Crossings between neighbours give the distance there (by the gradient
  // of the share); from them it spreads.
  const Eigen::Vector3d spacing = image.patient_from_voxel.linear().colwise().norm().transpose();
  std::vector<double> squared(total, kFull);
  for (int k = 1; k + 1 < size_.z(); ++k) {
    for (int j = 1; j + 1 < size_.y(); ++j) {
      for (int i = 1; i + 1 < size_.x(); ++i) {
        const std::size_t v = index(i, j, k);
        Eigen::Vector3d slope;
        bool near = false;
        for (std::size_t axis = 0; axis < 3; ++axis) {
          const float before = share[v - stride[axis]], after = share[v + stride[axis]];
          slope[static_cast<Eigen::Index>(axis)] = (after - before) / (2 * spacing[static_cast<Eigen::Index>(axis)]);
          near = near || (before < 0.5F) != (share[v] < 0.5F) || (after < 0.5F) != (share[v] < 0.5F);
        }
        if (!near) continue;
        const double steepness = slope.norm();
        const double reach = spacing.maxCoeff();
        const double distance = steepness > 0 ? std::min(std::abs(share[v] - 0.5) / steepness, reach) : reach / 2;
        squared[v] = distance * distance;
      }
    }
  }
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, w = (axis + 2) % 3;
    const auto length = static_cast<std::size_t>(size_[axis]);
    std::vector<double> line(length), out(length), from(length + 1);
    std::vector<int> at(length);
    for (int b = 0; b < size_[w]; ++b) {
      for (int a = 0; a < size_[u]; ++a) {
        const std::size_t start = static_cast<std::size_t>(a) * stride[u] + static_cast<std::size_t>(b) * stride[w];
        for (std::size_t q = 0; q < length; ++q) line[q] = squared[start + q * stride[axis]];
        transform_line(line, spacing[axis], out, at, from);
        for (std::size_t q = 0; q < length; ++q) squared[start + q * stride[axis]] = out[q];
      }
    }
  }
  distance_.resize(total);
  for (std::size_t v = 0; v < total; ++v) {
    distance_[v] = static_cast<float>(share[v] < 0.5F ? std::sqrt(squared[v]) : -std::sqrt(squared[v]));
  }
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d low = (box.min().array() - 1).cast<double>(), high = (box.max().array() + 1).cast<double>();
    bounds_.extend(image.patient_from_voxel * Eigen::Vector3d((corner & 1) != 0 ? high.x() : low.x(),
                                                              (corner & 2) != 0 ? high.y() : low.y(),
                                                              (corner & 4) != 0 ? high.z() : low.z()));
  }
}

double LabelSolid::signed_distance(const Eigen::Vector3d& point) const {
  const Eigen::Vector3d grid = voxel_from_patient_ * point - first_.cast<double>();
  if ((grid.array() < 0).any() || (grid.array() > size_.cast<double>().array() - 1).any()) {
    return std::max(bounds_.exteriorDistance(point), 1e-6);
  }
  const Eigen::Vector3i cell = grid.array().floor().cast<int>().min(size_.array() - 2);
  const Eigen::Vector3d t = grid - cell.cast<double>();
  double sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3i d(corner & 1, corner >> 1 & 1, corner >> 2);
    const Eigen::Vector3i v = cell + d;
    const double weight =
        (d.x() != 0 ? t.x() : 1 - t.x()) * (d.y() != 0 ? t.y() : 1 - t.y()) * (d.z() != 0 ? t.z() : 1 - t.z());
    sum += weight * distance_[static_cast<std::size_t>(v.x()) +
                              static_cast<std::size_t>(size_.x()) *
                                  (static_cast<std::size_t>(v.y()) +
                                   static_cast<std::size_t>(size_.y()) * static_cast<std::size_t>(v.z()))];
  }
  return sum;
}

}  // namespace stylet::import
