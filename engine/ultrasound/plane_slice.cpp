#include "engine/ultrasound/plane_slice.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace stylet::ultrasound {

PlaneSlice::PlaneSlice(const ScanGeometry& scan, std::span<const content::DeformableBody> bodies)
    : bodies_(bodies),
      scan_(scan),
      columns_((scan.lines + kTile - 1) / kTile),
      rows_((scan.samples + kTile - 1) / kTile) {}

PlaneSlice::Box PlaneSlice::tiles_of(std::span<const Eigen::Vector2f> polygon) const {
  constexpr float kMost = std::numeric_limits<float>::max();
  const float radius = static_cast<float>(scan_.face_radius);
  float first_line = kMost, last_line = -kMost, first_range = kMost, last_range = -kMost;
  for (const Eigen::Vector2f& corner : polygon) {
    float across = corner.x();
    float range = corner.y();
    if (radius > 0) {
      // Beside or behind the centre of the face there is no sector; what reaches there may reach anywhere.
      if (corner.y() + radius <= 0) return {0, columns_ - 1, 0, rows_ - 1};
      across = std::atan2(corner.x(), corner.y() + radius);
      range = std::hypot(corner.x(), corner.y() + radius);
    }
    first_line = std::min(first_line, across);
    last_line = std::max(last_line, across);
    first_range = std::min(first_range, range);
    last_range = std::max(last_range, range);
  }
  // A chord comes nearer to the centre than its ends.
  if (radius > 0) first_range *= std::cos(std::min(last_line - first_line, 0.5F * kPi));
  const auto tile = [](float coordinate, int last) {
    return static_cast<int>(std::clamp(std::floor(coordinate / kTile), -1.0F, static_cast<float>(last)));
  };
  const auto line = [this](float across) {
    return (across - static_cast<float>(scan_.first_line)) / static_cast<float>(scan_.line_pitch);
  };
  const auto sample = [&](float range) { return (range - radius) / static_cast<float>(scan_.sample_pitch) - 0.5F; };
  // Half a sample more on every side, for the rounding.
  return {std::max(tile(line(first_line) - 0.5F, columns_), 0), tile(line(last_line) + 0.5F, columns_ - 1),
          std::max(tile(sample(first_range) - 0.5F, rows_), 0), tile(sample(last_range) + 0.5F, rows_ - 1)};
}

void PlaneSlice::cut(const state::FrameState& state, const Eigen::Isometry3f& probe_from_patient) {
  tets_.clear();
  boxes_.clear();
  for (std::size_t body = 0; body < bodies_.size(); ++body) {
    const physics::TetMesh& mesh = bodies_[body].mesh;
    const std::vector<Eigen::Vector3f>& deformed = state.bodies[body];
    nodes_.resize(deformed.size());
    for (std::size_t i = 0; i < deformed.size(); ++i) nodes_[i] = probe_from_patient * deformed[i];

    for (const std::array<int, 4>& tet : mesh.tets) {
      const Eigen::Vector3f* p[4];
      int above = 0;
      for (int i = 0; i < 4; ++i) {
        p[i] = &nodes_[tet[i]];
        above += p[i]->y() > 0 ? 1 : 0;
      }
      if (above == 0 || above == 4) continue;

      // The corners of the cut: where the plane crosses edges, three or four of them.
      std::array<Eigen::Vector2f, 4> polygon;
      std::size_t corners = 0;
      for (int i = 0; i < 4; ++i) {
        for (int j = i + 1; j < 4; ++j) {
          if ((p[i]->y() > 0) == (p[j]->y() > 0)) continue;
          const float t = p[i]->y() / (p[i]->y() - p[j]->y());
          const Eigen::Vector3f crossing = *p[i] + t * (*p[j] - *p[i]);
          polygon[corners++] = {crossing.x(), crossing.z()};
        }
      }
      const std::span<const Eigen::Vector2f> cut_corners(polygon.data(), corners);
      if (!std::ranges::all_of(cut_corners, [](const Eigen::Vector2f& c) { return c.allFinite(); })) continue;
      const Box box = tiles_of(cut_corners);
      if (box.empty()) continue;

      Eigen::Matrix3f edges;
      Eigen::Matrix3f rest_edges;
      const Eigen::Vector3f rest = mesh.nodes[tet[0]].cast<float>();
      for (int i = 0; i < 3; ++i) {
        edges.col(i) = *p[i + 1] - *p[0];
        rest_edges.col(i) = mesh.nodes[tet[i + 1]].cast<float>() - rest;
      }
      const float volume = edges.determinant();
      if (!(std::abs(volume) > 1e-15F)) continue;  // 6 V of a sliver below a tenth of a micrometre: it has no inside
      const Eigen::Matrix3f gradient = edges.inverse();
      const Eigen::Vector3f at_origin = -gradient * *p[0];
      // X = rest + rest_edges b, b = gradient x + at_origin.
      const Eigen::Matrix3f jacobian = rest_edges * gradient;
      const Eigen::Vector3f rest_origin = rest + rest_edges * at_origin;
      CutTet cut;
      for (int i = 0; i < 3; ++i) {
        cut.barycentric[i] = {at_origin[i], gradient(i, 0), gradient(i, 2), static_cast<float>(body)};
        cut.rest[i] = {rest_origin[i], jacobian(i, 0), jacobian(i, 2), jacobian(i, 1)};
      }
      tets_.push_back(cut);
      boxes_.push_back(box);
    }
  }

  // Counting sort of the tetrahedra into the tiles they touch.
  starts_.assign(static_cast<std::size_t>(columns_) * rows_ + 1, 0);
  const auto each_tile = [&](const Box& box, auto&& visit) {
    for (int row = box.first_row; row <= box.last_row; ++row) {
      for (int column = box.first_column; column <= box.last_column; ++column) {
        visit(static_cast<std::size_t>(row) * columns_ + column);
      }
    }
  };
  for (const Box& box : boxes_) each_tile(box, [&](std::size_t t) { ++starts_[t + 1]; });
  for (std::size_t t = 1; t < starts_.size(); ++t) starts_[t] += starts_[t - 1];
  entries_.resize(starts_.back());
  std::vector<std::uint32_t> next(starts_.begin(), starts_.end() - 1);
  for (std::size_t i = 0; i < boxes_.size(); ++i) {
    each_tile(boxes_[i], [&](std::size_t t) { entries_[next[t]++] = static_cast<std::uint32_t>(i); });
  }
}

std::optional<PlaneSlice::Place> PlaneSlice::find(const Eigen::Vector2f& p, int line, int sample) const {
  const std::size_t tile = static_cast<std::size_t>(sample / kTile) * columns_ + line / kTile;
  const auto affine = [&p](const vec4& row) { return row.x + row.y * p.x() + row.z * p.y(); };
  for (std::uint32_t e = starts_[tile]; e < starts_[tile + 1]; ++e) {
    const CutTet& tet = tets_[entries_[e]];
    const Eigen::Vector3f b(affine(tet.barycentric[0]), affine(tet.barycentric[1]), affine(tet.barycentric[2]));
    if (std::min(b.minCoeff(), 1 - b.sum()) < kInsideTet) continue;
    return Place{{affine(tet.rest[0]), affine(tet.rest[1]), affine(tet.rest[2])},
                 {tet.rest[0].w, tet.rest[1].w, tet.rest[2].w},
                 static_cast<int>(tet.barycentric[0].w)};
  }
  return {};
}

}  // namespace stylet::ultrasound
