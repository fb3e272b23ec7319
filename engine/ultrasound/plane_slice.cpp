#include "engine/ultrasound/plane_slice.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace stylet::ultrasound {

PlaneSlice::PlaneSlice(const ScanGeometry& scan, std::span<const content::DeformableBody> bodies) : bodies_(bodies) {
  Eigen::Vector2d low;
  Eigen::Vector2d high;
  scan.bounds(&low, &high);
  bin_origin_ = low.cast<float>();
  const Eigen::Vector2f size = (high - low).cast<float>();
  columns_ = static_cast<int>(std::ceil(size.x() / kBinSize)) + 1;
  rows_ = static_cast<int>(std::ceil(size.y() / kBinSize)) + 1;
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

      // Bounding box of the cut polygon: the crossings of the edges.
      Eigen::Vector2f low = Eigen::Vector2f::Constant(std::numeric_limits<float>::max());
      Eigen::Vector2f high = -low;
      for (int i = 0; i < 4; ++i) {
        for (int j = i + 1; j < 4; ++j) {
          if ((p[i]->y() > 0) == (p[j]->y() > 0)) continue;
          const float t = p[i]->y() / (p[i]->y() - p[j]->y());
          const Eigen::Vector3f crossing = *p[i] + t * (*p[j] - *p[i]);
          const Eigen::Vector2f xz(crossing.x(), crossing.z());
          low = low.cwiseMin(xz);
          high = high.cwiseMax(xz);
        }
      }
      const auto bin = [&](const Eigen::Vector2f& xz) -> Eigen::Vector2i {
        return ((xz - bin_origin_) / kBinSize).array().floor().cast<int>();
      };
      if (!low.allFinite() || !high.allFinite()) continue;
      const Eigen::Vector2i first = bin(low.cwiseMax(bin_origin_)).cwiseMax(0);
      const Eigen::Vector2f far = bin_origin_ + kBinSize * Eigen::Vector2f(float(columns_), float(rows_));
      const Eigen::Vector2i last = bin(high.cwiseMin(far)).cwiseMin(Eigen::Vector2i(columns_ - 1, rows_ - 1));
      if (first.x() > last.x() || first.y() > last.y()) continue;

      Eigen::Matrix3f edges;
      for (int i = 0; i < 3; ++i) edges.col(i) = *p[i + 1] - *p[0];
      const float volume = edges.determinant();
      if (!(std::abs(volume) > 1e-15F)) continue;  // 6 V of a sliver below a tenth of a micrometre: it has no inside
      const Eigen::Matrix3f gradient = edges.inverse();
      CutTet cut;
      float sum[4] = {0, 0, 0, 0};
      for (int i = 0; i < 3; ++i) {
        const Eigen::Vector3f g = gradient.row(i);
        const float at_origin = -g.dot(*p[0]);
        cut.barycentric[i + 1] = {at_origin, g.x(), g.y(), g.z()};
        sum[0] += at_origin;
        for (int k = 0; k < 3; ++k) sum[k + 1] += g[k];
      }
      cut.barycentric[0] = {1 - sum[0], -sum[1], -sum[2], -sum[3]};
      for (int i = 0; i < 4; ++i) {
        const Eigen::Vector3f rest = mesh.nodes[tet[i]].cast<float>();
        cut.rest[i] = {rest.x(), rest.y(), rest.z(), static_cast<float>(body)};
      }
      tets_.push_back(cut);
      boxes_.push_back({first.x(), last.x(), first.y(), last.y()});
    }
  }

  // Counting sort of the tetrahedra into the bins they touch.
  starts_.assign(static_cast<std::size_t>(columns_) * rows_ + 1, 0);
  const auto each_bin = [&](const Box& box, auto&& visit) {
    for (int row = box.first_row; row <= box.last_row; ++row) {
      for (int column = box.first_column; column <= box.last_column; ++column) {
        visit(static_cast<std::size_t>(row) * columns_ + column);
      }
    }
  };
  for (const Box& box : boxes_) each_bin(box, [&](std::size_t b) { ++starts_[b + 1]; });
  for (std::size_t b = 1; b < starts_.size(); ++b) starts_[b] += starts_[b - 1];
  entries_.resize(starts_.back());
  std::vector<std::uint32_t> next(starts_.begin(), starts_.end() - 1);
  for (std::size_t i = 0; i < boxes_.size(); ++i) {
    each_bin(boxes_[i], [&](std::size_t b) { entries_[next[b]++] = static_cast<std::uint32_t>(i); });
  }
}

}  // namespace stylet::ultrasound
