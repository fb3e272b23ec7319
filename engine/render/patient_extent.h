// How far rays go through the patient: what lies outside has no place in the imaging plane.
#pragma once

#include "engine/content/scene.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <vector>

namespace stylet::render {

/// The patient at rest, by the voxels of the scene.
class PatientExtent {
public:
  /// Keeps no reference to `labels`.
  explicit PatientExtent(const content::LabelVolume& labels);

  /// Where a ray leaves the patient for good: behind the last tissue on it. Gas within counts as patient.
  /// @param from, along  patient frame, m; unit
  /// @return  m from `from`, at most `longest`; 0: it does not meet the patient; `longest` where there are no voxels
  double reach(const Eigen::Vector3d& from, const Eigen::Vector3d& along, double longest) const;

private:
  Eigen::Vector3d origin_;
  double spacing_;
  Eigen::Vector3i size_;
  std::vector<bool> tissue_;  // [voxels]
};

/// Rays of the imaging plane from side to side. [kFanRays + 1], m below the face
std::vector<float> fan_reach(const PatientExtent& patient, const content::Probe& probe,
                             const Eigen::Isometry3d& patient_from_probe);

}  // namespace stylet::render
