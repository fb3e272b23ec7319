#include "engine/render/patient_extent.h"

#include "shaders/shared.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace stylet::render {

PatientExtent::PatientExtent(const content::LabelVolume& labels)
    : origin_(labels.origin.cast<double>()), spacing_(labels.spacing), size_(labels.size) {
  tissue_.reserve(labels.labels.size());
  for (const std::uint8_t label : labels.labels) tissue_.push_back(label != 0);
}

double PatientExtent::reach(const Eigen::Vector3d& from, const Eigen::Vector3d& along, double longest) const {
  if (tissue_.empty()) return longest;
  const Eigen::Vector3d start = (from - origin_) / spacing_;
  for (int step = static_cast<int>(longest / spacing_); step >= 0; --step) {
    const Eigen::Array3i v = (start + step * along).array().round().cast<int>();
    if ((v < 0).any() || (v >= size_.array()).any()) continue;
    if (tissue_[(static_cast<std::size_t>(v.z()) * size_.y() + v.y()) * size_.x() + v.x()]) {
      return std::min((step + 0.5) * spacing_, longest);
    }
  }
  return 0;
}

std::vector<float> fan_reach(const PatientExtent& patient, const content::Probe& probe,
                             const Eigen::Isometry3d& patient_from_probe) {
  std::vector<float> reaches;
  for (int ray = 0; ray <= kFanRays; ++ray) {
    const double across = 2.0 * ray / kFanRays - 1;
    Eigen::Vector3d face(across * probe.width / 2, 0, 0), along = Eigen::Vector3d::UnitZ();
    if (probe.convex) {
      const double angle = across * probe.field_of_view / 2;
      along = {std::sin(angle), 0, std::cos(angle)};
      face = probe.radius * (along - Eigen::Vector3d::UnitZ());
    }
    reaches.push_back(static_cast<float>(
        patient.reach(patient_from_probe * face, patient_from_probe.linear() * along, probe.depth)));
  }
  return reaches;
}

}  // namespace stylet::render
