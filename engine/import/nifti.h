// Label volumes from NIfTI-1 and NIfTI-2 (.nii, .nii.gz): which organ each voxel belongs to, in any orientation.
#pragma once

#include "engine/files/pulse.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <vector>

namespace stylet::import {

/// Voxel (i, j, k), x fastest: labels[i + size.x * (j + size.y * k)]; its centre is patient_from_voxel * (i, j, k).
struct LabelImage {
  Eigen::Vector3i size = Eigen::Vector3i::Zero();
  Eigen::Affine3d patient_from_voxel = Eigen::Affine3d::Identity();  ///< metres
  std::vector<std::uint16_t> labels;
  std::map<int, std::string> names{};  ///< of labels, where the file has them: a table of its header extension
  std::vector<std::string> warnings;   ///< one line each: what was assumed

  /// Voxels of each label that occurs, 0 included.
  std::map<std::uint16_t, std::size_t> counts() const;
};

/// Caps that keep a bad file from exhausting memory or time.
struct NiftiLimits {
  std::size_t file_bytes = 1024u << 20;
  std::size_t voxels = 250'000'000;  ///< two bytes each in memory; a whole body at 0.8 x 0.8 x 1 mm is 200 million
  std::size_t labels = 2000;         ///< different ones: more is an image, not a segmentation
};

/// Whether these bytes are a NIfTI file, gzipped or not (a gzipped file counts).
bool looks_like_nifti(std::span<const std::byte> bytes);

/// @param name  stands for the file in messages
/// @throws files::ContentError  damaged, not three-dimensional, over the limits, values that are no labels
/// @param pulse  called often meanwhile; may throw to end it
LabelImage read_nifti_labels(std::span<const std::byte> bytes, const std::filesystem::path& name,
                             const NiftiLimits& limits = {}, const files::Pulse& pulse = {});

}  // namespace stylet::import
