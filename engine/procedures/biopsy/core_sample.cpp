#include "engine/procedures/biopsy/core_sample.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace stylet::procedures::biopsy {
namespace {

constexpr double kSlice = 0.25e-3;  // m, along the core: a quarter of a usual voxel

}  // namespace

std::vector<std::uint8_t> core_points(content::TissueLocator& tissue, std::size_t tissues, const Eigen::Vector3d& tip,
                                      const Eigen::Quaterniond& orientation, const CoreSettings& settings) {
  const double length = std::max(settings.throw_length - settings.dead_length, 0.0);
  const int slices = std::max(1, static_cast<int>(std::ceil(length / kSlice)));
  constexpr double kGolden = std::numbers::pi * (3 - 2.23606797749979);  // a sunflower's angle: even over the disc
  std::vector<std::uint8_t> points(static_cast<std::size_t>(slices) * tissues, 0);
  for (int s = 0; s < slices; ++s) {
    for (int p = 0; p < kPointsOfSlice; ++p) {
      const double radius = settings.bore / 2 * std::sqrt((p + 0.5) / kPointsOfSlice);
      const Eigen::Vector3d offset(radius * std::cos(p * kGolden), radius * std::sin(p * kGolden),
                                   (s + 0.5) * length / slices);
      const content::TissuePlace place = tissue.find(tip + orientation * offset);
      ++points[static_cast<std::size_t>(s) * tissues + static_cast<std::size_t>(place.tissue)];
    }
  }
  return points;
}

std::vector<double> core_content(std::span<const std::uint8_t> points, std::size_t tissues) {
  std::vector<double> shares(tissues, 0.0);
  const double share = static_cast<double>(tissues) / (static_cast<double>(points.size()) * kPointsOfSlice);
  for (std::size_t i = 0; i < points.size(); ++i) {
    // One by one, as they were summed in every recording.
    for (int p = 0; p < points[i]; ++p) shares[i % tissues] += share;
  }
  return shares;
}

std::vector<state::CorePiece> core_pieces(std::span<const std::uint8_t> points, const std::vector<bool>& targets) {
  std::vector<state::CorePiece> pieces;
  const std::size_t tissues = targets.size(), slices = points.size() / tissues;
  const auto slice = [&](std::size_t s) { return points.subspan(s * tissues, tissues); };
  for (std::size_t first = 0, end = 0; first < slices; first = end) {
    while (end < slices && std::ranges::equal(slice(end), slice(first))) ++end;
    int across = 0;
    for (const bool target : {true, false}) {
      for (std::size_t t = 0; t < tissues; ++t) {
        const int count = slice(first)[t];
        if (count == 0 || targets[t] != target) continue;
        pieces.push_back({.from = static_cast<float>(first) / static_cast<float>(slices),
                          .to = static_cast<float>(end) / static_cast<float>(slices),
                          .low = static_cast<float>(across) / kPointsOfSlice,
                          .high = static_cast<float>(across + count) / kPointsOfSlice,
                          .tissue = static_cast<int>(t),
                          .target = target});
        across += count;
      }
    }
  }
  return pieces;
}

}  // namespace stylet::procedures::biopsy
