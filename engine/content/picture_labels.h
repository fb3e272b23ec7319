// What the pixels of label maps mean: one numbering for the ultrasound image and the 3-D view of a scene.
#pragma once

#include "engine/content/scene.h"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace stylet::content {

// Labels that are no tissue follow the tissues: so much after their number.
inline constexpr std::uint32_t kOutsideLabel = 0;  ///< in the sector, not in the patient: gel, air
inline constexpr std::uint32_t kGapLabel = 1;      ///< where an organ has moved away; imaged as fat
inline constexpr std::uint32_t kNeedleLabel = 2;
inline constexpr std::uint32_t kProbeLabel = 3;  ///< 3-D view only

/// 0: nothing (outside the sector; no surface). Then the tissues by their row in Scene::tissues, and what is none.
struct PictureLabels {
  /// @throws ContentError  more tissues than fit into 8 bits
  explicit PictureLabels(const Scene& scene);

  std::vector<std::string> names;  ///< by index, 0 is "background"
  int outside;
  int gap;
  int needle;
  int probe;

  /// sRGB colour of a label in previews: black for 0, well apart for the others.
  static std::array<std::uint8_t, 3> colour(int label);
};

}  // namespace stylet::content
