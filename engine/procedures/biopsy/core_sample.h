// What a biopsy needle brings back.
#pragma once

#include "engine/content/tissue_locator.h"
#include "engine/state/frame_state.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace stylet::procedures::biopsy {

/// An 18G automatic needle: its stylet shoots ahead of the tip, and what lies in the notch behind the stylet's own
/// tip is cut off. Engineering values within what makers give: throw 10 to 25 mm, notch 17 to 20 mm of a throw of 22
/// mm.
struct CoreSettings {
  double throw_length = 0.022;  ///< m
  double dead_length = 0.005;   ///< of the stylet's tip, in front of the notch, m
  double bore = 0.0009;         ///< diameter of the core, m
};

/// Points of a slice of a core, each for the same area.
inline constexpr int kPointsOfSlice = 24;

/// What lies in a core: how many points of each of its slices, from the tip on, are of each tissue [slices x
/// tissues]. The core is the cylinder from the tip to throw_length - dead_length ahead of it, in the tissue as it
/// lies at that moment: it does not give way to a needle that is shot.
/// @param tissue       update() was called with that moment
/// @param tissues      Scene::tissues.size()
/// @param orientation  of the tip, +Z ahead
std::vector<std::uint8_t> core_points(content::TissueLocator& tissue, std::size_t tissues, const Eigen::Vector3d& tip,
                                      const Eigen::Quaterniond& orientation, const CoreSettings& settings = {});

/// Share of the core's volume by tissue [tissues], sum 1. @param points  as of core_points()
std::vector<double> core_content(std::span<const std::uint8_t> points, std::size_t tissues);

/// The core as it lies in a dish: slices that are alike are one piece of each tissue in them, those of targets on one
/// side, so that a border that was met at a slant is seen as one. Areas are shares of the volume.
/// @param points   as of core_points()
/// @param targets  whether a tissue is one of a target [tissues]
std::vector<state::CorePiece> core_pieces(std::span<const std::uint8_t> points, const std::vector<bool>& targets);

}  // namespace stylet::procedures::biopsy
