#include "engine/import/label_solid.h"

#include "engine/files/error.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace stylet::import {
namespace {

constexpr int kMargin = 3;  // voxels around the labels
// A body's skin in 40 million voxels has 1.2 million faces. Of a sheet one voxel thick a voxel has two.
constexpr std::size_t kMostFaces = 2'000'000;
constexpr std::size_t kManyFaces = 200'000;
constexpr double kFacesOfNoise = 1.5;  // a voxel, of so many
constexpr float kShorter = 0.8F;       // is each further step
constexpr int kStairPasses = 2;        // passes of [1 2 1] / 4, which take the stairs off
constexpr int kWidePasses = 3;         // passes over what is missing, wide enough not to bring the stairs back
constexpr int kRestoring = 24;         // steps at most
constexpr double kRestored = 0.01;     // of the volume that lies elsewhere, where they end
constexpr float kLongestStep = 0.25F;  // voxels by which the surface moves in one
constexpr int kSamples = 3;            // of the distance in half a voxel
constexpr double kExactVolume = 2e-3;  // of the volume, by the last step
constexpr double kFull = 1e9;          // squared distance of what has no other side, voxels^2

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

/// Of voxels within to voxels without.
std::size_t count_faces(const std::vector<char>& in, std::size_t row, std::size_t plane) {
  std::size_t faces = 0;
  for (std::size_t v = plane; v < in.size(); ++v) {
    faces += (in[v] != in[v - 1] ? 1U : 0U) + (in[v] != in[v - row] ? 1U : 0U) + (in[v] != in[v - plane] ? 1U : 0U);
  }
  return faces;
}

struct VoxelGrid {
  Eigen::Vector3i size;
  std::array<std::size_t, 3> stride;
  Eigen::Vector3d spacing;  // m

  std::size_t count() const { return stride[2] * static_cast<std::size_t>(size.z()); }
};

/// visit(start) for the first voxel of every line along an axis.
template <typename Visit>
void for_each_line(const VoxelGrid& grid, int axis, const files::Pulse& pulse, Visit visit) {
  const int u = (axis + 1) % 3, w = (axis + 2) % 3;
  for (int b = 0; b < grid.size[w]; ++b) {
    pulse.now();
    for (int a = 0; a < grid.size[u]; ++a) {
      visit(static_cast<std::size_t>(a) * grid.stride[static_cast<std::size_t>(u)] +
            static_cast<std::size_t>(b) * grid.stride[static_cast<std::size_t>(w)]);
    }
  }
}

/// visit(voxel) for every voxel that has all 26 neighbours.
template <typename Visit>
void for_each_inner(const VoxelGrid& grid, const files::Pulse& pulse, Visit visit) {
  for (int k = 1; k + 1 < grid.size.z(); ++k) {
    pulse.now();
    for (int j = 1; j + 1 < grid.size.y(); ++j) {
      const std::size_t row =
          static_cast<std::size_t>(j) * grid.stride[1] + static_cast<std::size_t>(k) * grid.stride[2];
      for (int i = 1; i + 1 < grid.size.x(); ++i) visit(row + static_cast<std::size_t>(i));
    }
  }
}

/// Passes of [1 2 1] / 4 along each axis; beyond the rim lies what lies on it.
void blur(std::vector<float>& field, const VoxelGrid& grid, int passes, const files::Pulse& pulse) {
  std::vector<float> line;
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t stride = grid.stride[static_cast<std::size_t>(axis)];
    const auto length = static_cast<std::size_t>(grid.size[axis]);
    line.resize(length);
    for_each_line(grid, axis, pulse, [&](std::size_t start) {
      for (std::size_t q = 0; q < length; ++q) line[q] = field[start + q * stride];
      for (int pass = 0; pass < passes; ++pass) {
        float before = line[0];
        for (std::size_t q = 0; q < length; ++q) {
          const float here = line[q], after = line[std::min(q + 1, length - 1)];
          line[q] = 0.25F * before + 0.5F * here + 0.25F * after;
          before = here;
        }
      }
      for (std::size_t q = 0; q < length; ++q) field[start + q * stride] = line[q];
    });
  }
}

/// Signed distance to the faces between voxels within and without, m.
std::vector<float> distance_to_faces(const std::vector<char>& in, const VoxelGrid& grid, const files::Pulse& pulse) {
  std::vector<double> squared(grid.count(), kFull);
  for_each_inner(grid, pulse, [&](std::size_t v) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t step = grid.stride[axis];
      if (in[v - step] == in[v] && in[v + step] == in[v]) continue;
      const double half = grid.spacing[static_cast<Eigen::Index>(axis)] / 2;
      squared[v] = std::min(squared[v], half * half);
    }
  });
  for (int axis = 0; axis < 3; ++axis) {
    const std::size_t stride = grid.stride[static_cast<std::size_t>(axis)];
    const auto length = static_cast<std::size_t>(grid.size[axis]);
    std::vector<double> line(length), out(length), from(length + 1);
    std::vector<int> at(length);
    for_each_line(grid, axis, pulse, [&](std::size_t start) {
      for (std::size_t q = 0; q < length; ++q) line[q] = squared[start + q * stride];
      transform_line(line, grid.spacing[axis], out, at, from);
      for (std::size_t q = 0; q < length; ++q) squared[start + q * stride] = out[q];
    });
  }
  std::vector<float> distance(grid.count());
  for (std::size_t v = 0; v < distance.size(); ++v) {
    distance[v] = static_cast<float>(in[v] == 0 ? std::sqrt(squared[v]) : -std::sqrt(squared[v]));
  }
  return distance;
}

/// The part of a voxel in which the distance, interpolated between the centres of voxels, is negative.
float part_within(const std::vector<float>& distance, const VoxelGrid& grid, std::size_t v) {
  constexpr int n = kSamples;  // along an axis of an octant
  const float here = distance[v];
  float sum = 0;
  for (int octant = 0; octant < 8; ++octant) {
    std::array<std::ptrdiff_t, 3> to;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const auto step = static_cast<std::ptrdiff_t>(grid.stride[axis]);
      to[axis] = (octant >> axis & 1) != 0 ? step : -step;
    }
    std::array<float, 8> corner;
    const float* const centre = &distance[v];
    for (std::size_t c = 0; c < 8; ++c) {
      corner[c] = centre[((c & 1) != 0 ? to[0] : 0) + ((c & 2) != 0 ? to[1] : 0) + ((c & 4) != 0 ? to[2] : 0)];
    }
    // A sample stands for the part of its cell within, were the surface a plane across it.
    const float width =
        std::max((std::abs(corner[1] - here) + std::abs(corner[2] - here) + std::abs(corner[4] - here)) / (2 * n),
                 std::numeric_limits<float>::min());
    const auto [least, most] = std::minmax_element(corner.begin(), corner.end());
    if (*least >= width / 2) continue;
    if (*most <= -width / 2) {
      sum += n * n * n;
      continue;
    }
    for (int k = 0; k < n; ++k) {
      const float z = (static_cast<float>(k) + 0.5F) / (2 * n);
      std::array<float, 4> face;
      for (std::size_t c = 0; c < 4; ++c) face[c] = corner[c] + z * (corner[c + 4] - corner[c]);
      for (int j = 0; j < n; ++j) {
        const float y = (static_cast<float>(j) + 0.5F) / (2 * n);
        const float low = face[0] + y * (face[2] - face[0]), high = face[1] + y * (face[3] - face[1]);
        for (int i = 0; i < n; ++i) {
          const float x = (static_cast<float>(i) + 0.5F) / (2 * n);
          sum += std::clamp(0.5F - (low + x * (high - low)) / width, 0.0F, 1.0F);
        }
      }
    }
  }
  return sum / (8 * n * n * n);
}

/// Moves the surface until as much lies in it, near every place and in all, as there are voxels: smoothing takes from
/// what is convex and thin. Each step moves it by what is missing around, over the area of the faces around.
void restore_volume(std::vector<float>& distance, const std::vector<char>& in, std::size_t count,
                    const VoxelGrid& grid, const files::Pulse& pulse) {
  const auto voxel = static_cast<float>(grid.spacing.minCoeff());
  const float near = 2 * static_cast<float>(grid.spacing.norm());
  std::vector<float> area(grid.count(), 0);  // of a voxel's faces to the other side, in voxels per spacing
  for_each_inner(grid, pulse, [&](std::size_t v) {
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const std::size_t step = grid.stride[axis];
      const float face = voxel / static_cast<float>(grid.spacing[static_cast<Eigen::Index>(axis)]) / 2;
      area[v] += (in[v - step] != in[v] ? face : 0) + (in[v + step] != in[v] ? face : 0);
    }
  });
  blur(area, grid, kWidePasses, pulse);
  std::vector<float> missing(grid.count(), 0);
  // @return what is missing in all, voxels
  const auto measure = [&] {
    double sum = 0;
    for_each_inner(grid, pulse, [&](std::size_t v) {
      missing[v] = static_cast<float>(in[v]) - (std::abs(distance[v]) < near ? part_within(distance, grid, v)
                                                : distance[v] < 0            ? 1.0F
                                                                             : 0.0F);
      sum += static_cast<double>(missing[v]);
    });
    return sum;
  };
  float longest = kLongestStep;
  for (int step = 0; step < kRestoring; ++step, longest *= kShorter) {
    measure();
    blur(missing, grid, kWidePasses, pulse);
    double displaced = 0;
    for (const float m : missing) displaced += std::abs(static_cast<double>(m));
    if (displaced < kRestored * static_cast<double>(count)) break;
    for (std::size_t v = 0; v < distance.size(); ++v) {
      if (area[v] > 1e-3F) distance[v] -= voxel * std::clamp(missing[v] / area[v], -longest, longest);
    }
  }
  double faces = 0;
  for (const float a : area) faces += static_cast<double>(a);
  // What a thread holds changes much faster than its faces tell: half as far at most where the last step went too
  // far.
  double last = 0, most = kLongestStep;
  for (int step = 0; step < kRestoring; ++step) {
    const double left = measure();
    if (std::abs(left) < kExactVolume * static_cast<double>(count)) break;
    if (last * left < 0) most /= 2;
    last = left;
    const auto offset = static_cast<float>(std::clamp(left / faces, -most, most)) * voxel;
    for (float& d : distance) d -= offset;
  }
}

}  // namespace

LabelSolid::LabelSolid(const LabelImage& image, std::span<const int> labels, std::size_t most_voxels,
                       const files::Pulse& pulse)
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

  std::vector<char> in(total, 0);
  for (int k = 0; k < size_.z(); ++k) {
    for (int j = 0; j < size_.y(); ++j) {
      for (int i = 0; i < size_.x(); ++i) {
        const Eigen::Vector3i v = first_ + Eigen::Vector3i(i, j, k);
        if ((v.array() < 0).any() || (v.array() >= n.array()).any()) continue;
        if (wanted[image.labels[image_index(v.x(), v.y(), v.z())]]) in[index(i, j, k)] = 1;
      }
    }
  }
  if (const std::size_t faces = count_faces(in, index(0, 1, 0), index(0, 0, 1));
      faces > kMostFaces ||
      (faces > kManyFaces && static_cast<double>(faces) > kFacesOfNoise * static_cast<double>(count))) {
    throw files::ContentError(fmt::format(
        "its {} voxels have {} faces to others, as noise has and no organ; smooth the labels, take single "
        "voxels out of them, or resample the volume to larger voxels",
        count, faces));
  }
  const Eigen::Vector3d spacing = image.patient_from_voxel.linear().colwise().norm().transpose();
  const VoxelGrid grid{.size = size_, .stride = {1, index(0, 1, 0), index(0, 0, 1)}, .spacing = spacing};
  distance_ = distance_to_faces(in, grid, pulse);
  blur(distance_, grid, kStairPasses, pulse);
  restore_volume(distance_, in, count, grid, pulse);
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d low = (box.min().array() - 2).cast<double>(), high = (box.max().array() + 2).cast<double>();
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
