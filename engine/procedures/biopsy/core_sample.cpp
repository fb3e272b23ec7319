#include "engine/procedures/biopsy/core_sample.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace stylet::procedures::biopsy {
namespace {

constexpr double kSlice = 0.25e-3;  // m, along the core: a quarter of a usual voxel
constexpr int kAcross = 24;         // points of a slice, each for the same area

}  // namespace

std::vector<double> core_content(content::TissueLocator& tissue, std::size_t tissues, const Eigen::Vector3d& tip,
                                 const Eigen::Quaterniond& orientation, const CoreSettings& settings) {
  std::vector<double> shares(tissues, 0.0);
  const double length = std::max(settings.throw_length - settings.dead_length, 0.0);
  const int slices = std::max(1, static_cast<int>(std::ceil(length / kSlice)));
  constexpr double kGolden = std::numbers::pi * (3 - 2.23606797749979);  // a sunflower's angle: even over the disc
  const double share = 1.0 / (slices * kAcross);
  for (int s = 0; s < slices; ++s) {
    for (int p = 0; p < kAcross; ++p) {
      const double radius = settings.bore / 2 * std::sqrt((p + 0.5) / kAcross);
      const Eigen::Vector3d offset(radius * std::cos(p * kGolden), radius * std::sin(p * kGolden),
                                   (s + 0.5) * length / slices);
      const content::TissuePlace place = tissue.find(tip + orientation * offset);
      shares[place.tissue] += share;
    }
  }
  return shares;
}

}  // namespace stylet::procedures::biopsy
