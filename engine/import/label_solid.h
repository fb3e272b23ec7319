// The solid of some labels in a volume.
#pragma once

#include "engine/files/pulse.h"
#include "engine/import/nifti.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <span>
#include <vector>

namespace stylet::import {

/// Signed distance to a smooth surface between voxels with and without these labels. The distance to the faces
/// between them is smoothed by a binomial filter, which takes the stairs off, and then moved until as much lies
/// within as there are voxels, near every place and in all: smoothing alone takes from what is convex, and all of
/// what is thin.
class LabelSolid {
public:
  /// Voxels of the box around the labels, 17 bytes each while it is made: below 1 GB.
  static constexpr std::size_t kMostVoxels = 40'000'000;
  /// @param pulse  called often meanwhile; may throw to end it
  /// @throws files::ContentError  none of the labels occurs; their box has more than `most_voxels`;
  ///                            as many faces as noise
  LabelSolid(const LabelImage& image, std::span<const int> labels, std::size_t most_voxels = kMostVoxels,
             const files::Pulse& pulse = {});

  /// Metres, negative inside. Outside the volume: positive.
  double signed_distance(const Eigen::Vector3d& point) const;
  /// Of the voxels, m^3.
  double volume() const { return volume_; }
  const Eigen::AlignedBox3d& bounds() const { return bounds_; }
  /// A voxel of the labels lies on the rim of the volume.
  bool touches_rim() const { return touches_rim_; }

private:
  Eigen::Affine3d voxel_from_patient_;
  Eigen::Vector3i first_;  // voxel of the image that distance_ begins at
  Eigen::Vector3i size_;
  std::vector<float> distance_;  // [voxels of the part around the labels] signed, m
  Eigen::AlignedBox3d bounds_;   // patient frame
  double volume_ = 0;
  bool touches_rim_ = false;
};

}  // namespace stylet::import
