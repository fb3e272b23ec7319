#include "engine/content/picture_labels.h"

#include "engine/files/error.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace stylet::content {

PictureLabels::PictureLabels(const Scene& scene) {
  names.emplace_back("background");
  for (std::size_t i = 1; i < scene.tissues.size(); ++i) names.push_back(scene.tissues[i].name);
  names.insert(names.end(), {"outside", "gap", "needle", "probe"});
  const auto index = [&](std::uint32_t after) { return static_cast<int>(scene.tissues.size() + after); };
  outside = index(kOutsideLabel);
  gap = index(kGapLabel);
  needle = index(kNeedleLabel);
  probe = index(kProbeLabel);
  if (names.size() > 256) {
    throw files::ContentError(fmt::format("{}: {} tissues do not fit into label maps of 8 bits; at most 252 do",
                                          scene.scenario.string(), scene.tissues.size()));
  }
}

std::array<std::uint8_t, 3> PictureLabels::colour(int label) {
  if (label == 0) return {0, 0, 0};
  // Golden angle: any few neighbours are far apart in hue.
  const double hue = std::fmod(label * 137.50776405, 360.0) / 60;
  const double value = label % 3 == 0 ? 0.7 : 1.0;
  const auto channel = [&](double n) {
    const double k = std::fmod(n + hue, 6.0);
    return static_cast<std::uint8_t>(std::lround(255 * value * (1 - 0.8 * std::max(0.0, std::min({k, 4 - k, 1.0})))));
  };
  return {channel(5), channel(3), channel(1)};
}

}  // namespace stylet::content
