// What a biopsy needle brings back.
#pragma once

#include "engine/content/tissue_locator.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

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

/// Share of the core's volume by tissue [tissues], sum 1. The core is the cylinder from the tip to throw_length -
/// dead_length ahead of it, in the tissue as it lies at that moment: it does not give way to a needle that is shot.
/// @param tissue       update() was called with that moment
/// @param tissues      Scene::tissues.size()
/// @param orientation  of the tip, +Z ahead
std::vector<double> core_content(content::TissueLocator& tissue, std::size_t tissues, const Eigen::Vector3d& tip,
                                 const Eigen::Quaterniond& orientation, const CoreSettings& settings = {});

}  // namespace stylet::procedures::biopsy
