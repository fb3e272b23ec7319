// The label map in plain C++: shaders/ultrasound_label_map.comp, line by line.
#include "engine/ultrasound/reference_image.h"

#include <algorithm>
#include <cmath>

namespace stylet::ultrasound {

bool ReferenceImager::on_needle(const Eigen::Vector2f& p, float range) const {
  const FrameConstants& c = model_.constants();
  const float radius = std::max(c.needle_radius, 0.75F * c.pixel);
  const Eigen::Vector3f scale(1 / radius, 2 / static_cast<float>(elevation_fwhm(model_.scene().probe, range)),
                              1 / radius);
  for (int i = 0; i < c.needle_segments; ++i) {
    const NeedleSegment& segment = model_.needle()[i];
    const Eigen::Vector3f from(segment.from.x, segment.from.y, segment.from.z);
    const Eigen::Vector3f to(segment.to.x, segment.to.y, segment.to.z);
    const Eigen::Vector3f axis = scale.cwiseProduct(to - from);
    const Eigen::Vector3f to_p = scale.cwiseProduct(Eigen::Vector3f(p.x(), 0, p.y()) - from);
    const float t = std::clamp(to_p.dot(axis) / axis.squaredNorm(), 0.0F, 1.0F);
    if ((to_p - t * axis).squaredNorm() <= 1) return true;
  }
  return false;
}

std::vector<std::uint8_t> ReferenceImager::label_map() const {
  const FrameConstants& c = model_.constants();
  std::vector<std::uint8_t> labels(static_cast<std::size_t>(c.width) * c.height, 0);
  for (int v = 0; v < c.height; ++v) {
    for (int u = 0; u < c.width; ++u) {
      const Pixel at = pixel(u, v);
      if (!at.in_sector) continue;
      const int l = std::clamp(static_cast<int>(std::floor(at.line + 0.5F)), 0, lines_ - 1);
      const int s = std::clamp(static_cast<int>(std::floor(at.sample + 0.5F)), 0, samples_ - 1);
      int label = found_[index(l, s)];
      if (label == 0) label = c.gel_tissue;
      if (on_needle({at.x, at.z}, at.range)) label = c.filler_tissue + 1;
      labels[static_cast<std::size_t>(v) * c.width + u] = static_cast<std::uint8_t>(label);
    }
  }
  return labels;
}

}  // namespace stylet::ultrasound
