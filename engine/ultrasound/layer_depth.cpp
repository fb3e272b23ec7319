#include "engine/ultrasound/layer_depth.h"

#include "engine/ultrasound/voxel_words.h"
#include "shaders/ultrasound_shared.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace stylet::ultrasound {
namespace {

/// Least path from outside in steps to the 26 neighbours, in cells, two sweeps (G. Borgefors, CVGIP 34, 1986, with
/// steps 3, 4, 5 over 3): within 8 % of the distance.
void sweep(std::vector<float>& depth, const Eigen::Vector3i& size, bool forward) {
  constexpr float kSteps[4] = {0, 1, 4.0F / 3, 5.0F / 3};
  const int step = forward ? -1 : 1;
  const auto at = [&size](int x, int y, int z) {
    return (static_cast<std::size_t>(z) * size.y() + y) * size.x() + static_cast<std::size_t>(x);
  };
  for (int i = 0; i < size.z(); ++i) {
    const int z = forward ? i : size.z() - 1 - i;
    for (int j = 0; j < size.y(); ++j) {
      const int y = forward ? j : size.y() - 1 - j;
      for (int k = 0; k < size.x(); ++k) {
        const int x = forward ? k : size.x() - 1 - k;
        float& here = depth[at(x, y, z)];
        const auto look = [&](int dx, int dy, int dz) {
          const int nx = x + dx, ny = y + dy, nz = z + dz;
          if (nx < 0 || ny < 0 || nz < 0 || nx >= size.x() || ny >= size.y() || nz >= size.z()) return;
          here = std::min(here, depth[at(nx, ny, nz)] + kSteps[std::abs(dx) + std::abs(dy) + std::abs(dz)]);
        };
        for (int dy = -1; dy <= 1; ++dy) {
          for (int dx = -1; dx <= 1; ++dx) look(dx, dy, step);
        }
        for (int dx = -1; dx <= 1; ++dx) look(dx, step, 0);
        look(step, 0, 0);
      }
    }
  }
}

/// Mean with both neighbours along every axis, once: rounds the facets of the steps and of the voxels off.
void smooth(std::vector<float>& depth, const Eigen::Vector3i& size) {
  const std::size_t strides[3] = {1, std::size_t(size.x()), std::size_t(size.x()) * size.y()};
  std::vector<float> before;
  for (int axis = 0; axis < 3; ++axis) {
    before = depth;
    std::size_t i = 0;
    for (int z = 0; z < size.z(); ++z) {
      for (int y = 0; y < size.y(); ++y) {
        for (int x = 0; x < size.x(); ++x, ++i) {
          const int place = axis == 0 ? x : axis == 1 ? y : z;
          const float below = before[place > 0 ? i - strides[axis] : i];
          const float above = before[place + 1 < size[axis] ? i + strides[axis] : i];
          depth[i] = 0.25F * below + 0.5F * before[i] + 0.25F * above;
        }
      }
    }
  }
}

}  // namespace

LayerDepth LayerDepth::of(const content::Scene& scene, std::span<const std::uint16_t> words) {
  LayerDepth result;
  if (std::ranges::none_of(scene.tissues, [](const content::Tissue& t) { return t.acoustics.layering > 0; })) {
    return result;
  }
  const Eigen::Vector3i voxels = scene.labels.size;
  result.size = (voxels.array() + kDepthCell - 1) / kDepthCell;
  std::vector<float> cells(static_cast<std::size_t>(result.size.prod()), std::numeric_limits<float>::max());
  std::size_t cell = 0;
  for (int z = 0; z < result.size.z(); ++z) {
    for (int y = 0; y < result.size.y(); ++y) {
      for (int x = 0; x < result.size.x(); ++x, ++cell) {
        const std::size_t voxel =
            (std::size_t(z * kDepthCell) * voxels.y() + y * kDepthCell) * voxels.x() + std::size_t(x) * kDepthCell;
        if (label_of(words[voxel]) == 0) cells[cell] = 0;
      }
    }
  }
  sweep(cells, result.size, true);
  sweep(cells, result.size, false);
  for (int i = 0; i < kDepthSmoothing; ++i) smooth(cells, result.size);
  const float units = kDepthCell * scene.labels.spacing / kDepthUnit;
  for (const float depth : cells) {
    result.depth.push_back(static_cast<std::uint16_t>(std::min(units * std::min(depth, 1e6F), 65535.0F)));
  }
  result.depth.resize((result.depth.size() + 1) / 2 * 2);
  return result;
}

float LayerDepth::at(const Eigen::Vector3f& voxel) const {
  const Eigen::Vector3f cell = voxel / float(kDepthCell);
  const Eigen::Vector3f base = cell.array().floor();
  const Eigen::Vector3f f = cell - base;
  float mixed = 0;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3i d(corner & 1, (corner >> 1) & 1, corner >> 2);
    float w = 1;
    for (int axis = 0; axis < 3; ++axis) w *= d[axis] != 0 ? f[axis] : 1 - f[axis];
    const Eigen::Array3i c = (base.cast<int>() + d).array().max(0).min(size.array() - 1);
    mixed += w * static_cast<float>(depth[(static_cast<std::size_t>(c.z()) * size.y() + c.y()) * size.x() + c.x()]);
  }
  return kDepthUnit * mixed;
}

}  // namespace stylet::ultrasound
