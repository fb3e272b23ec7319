// The tetrahedra that the image plane cuts, sorted into bins of the plane, ready for a point query on the GPU.
#pragma once

#include "engine/content/scene.h"
#include "engine/state/frame_state.h"
#include "engine/ultrasound/scan_geometry.h"
#include "shaders/ultrasound_shared.h"

#include <Eigen/Geometry>

#include <span>
#include <vector>

namespace stylet::ultrasound {

/// Cut tetrahedra inside the sector and the bins of the plane they touch. Arrays keep their capacity between frames.
class PlaneSlice {
public:
  /// @param scan  whose bounding box is covered by the bins
  PlaneSlice(const ScanGeometry& scan, std::span<const content::DeformableBody> bodies);

  /// Cuts `state`'s bodies with the plane y = 0 of the probe. A bin lists its tetrahedra by body, then by index: a
  /// point query that takes the first hit gives the same answer on every run.
  void cut(const state::FrameState& state, const Eigen::Isometry3f& probe_from_patient);

  std::span<const CutTet> tets() const { return tets_; }
  /// Bin b holds entries()[starts()[b]] ... entries()[starts()[b + 1] - 1], indices into tets(). Row-major over (x,
  /// z).
  std::span<const std::uint32_t> starts() const { return starts_; }
  std::span<const std::uint32_t> entries() const { return entries_; }

  Eigen::Vector2f bin_origin() const { return bin_origin_; }
  float bin_size() const { return kBinSize; }
  int columns() const { return columns_; }
  int rows() const { return rows_; }

private:
  static constexpr float kBinSize = 0.004F;
  struct Box {
    int first_column, last_column, first_row, last_row;
  };

  std::span<const content::DeformableBody> bodies_;
  Eigen::Vector2f bin_origin_;
  int columns_;
  int rows_;
  std::vector<Eigen::Vector3f> nodes_;  ///< of one body, probe frame
  std::vector<CutTet> tets_;
  std::vector<Box> boxes_;
  std::vector<std::uint32_t> starts_;
  std::vector<std::uint32_t> entries_;
};

}  // namespace stylet::ultrasound
