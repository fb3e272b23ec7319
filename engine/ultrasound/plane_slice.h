// The tetrahedra that the image plane cuts, sorted into tiles of the polar grid, ready for a point query on the GPU.
#pragma once

#include "engine/content/scene.h"
#include "engine/state/frame_state.h"
#include "engine/ultrasound/scan_geometry.h"
#include "shaders/ultrasound_shared.h"

#include <Eigen/Geometry>

#include <optional>
#include <span>
#include <vector>

namespace stylet::ultrasound {

/// Cut tetrahedra inside the sector and the tiles they touch. Arrays keep their capacity between frames.
class PlaneSlice {
public:
  /// @param scan  whose lines and samples the tiles cover, kTile of each to a tile
  PlaneSlice(const ScanGeometry& scan, std::span<const content::DeformableBody> bodies);

  /// Cuts `state`'s bodies with the plane y = 0 of the probe. A tile lists its tetrahedra by body, then by index: a
  /// point query that takes the first hit gives the same answer on every run.
  void cut(const state::FrameState& state, const Eigen::Isometry3f& probe_from_patient);

  /// Where a point of the plane lies at rest.
  struct Place {
    Eigen::Vector3f position;
    Eigen::Vector3f slope;  ///< d position / d y of the probe
    int body;
  };
  /// @param p  (x, z) of the probe frame, which sample (line, sample) covers
  std::optional<Place> find(const Eigen::Vector2f& p, int line, int sample) const;

  std::span<const CutTet> tets() const { return tets_; }
  /// Tile t holds entries()[starts()[t]] ... entries()[starts()[t + 1] - 1], indices into tets().
  std::span<const std::uint32_t> starts() const { return starts_; }
  std::span<const std::uint32_t> entries() const { return entries_; }

  int columns() const { return columns_; }  ///< tiles side by side
  int rows() const { return rows_; }

private:
  struct Box {
    int first_column, last_column, first_row, last_row;
    bool empty() const { return first_column > last_column || first_row > last_row; }
  };
  Box tiles_of(std::span<const Eigen::Vector2f> polygon) const;

  std::span<const content::DeformableBody> bodies_;
  ScanGeometry scan_;
  int columns_;
  int rows_;
  std::vector<Eigen::Vector3f> nodes_;  ///< of one body, probe frame
  std::vector<CutTet> tets_;
  std::vector<Box> boxes_;
  std::vector<std::uint32_t> starts_;
  std::vector<std::uint32_t> entries_;
};

}  // namespace stylet::ultrasound
