// The patient around a needle's way, with few triangles: what a page can turn by hand.
#pragma once

#include "engine/content/scene.h"
#include "engine/debrief/debrief_data.h"
#include "engine/state/frame_state.h"

#include <Eigen/Core>

#include <vector>

namespace stylet::debrief {

/// Targets, the deformable organs that hold them, their vessels, and of skin and bones what lies near, as they are at
/// `moment`. About 2500 triangles.
/// @param around  where the needle went, patient frame, m
std::vector<Outline> outlines_of(const content::Scene& scene, const state::FrameState& moment,
                                 const Eigen::Vector3d& around);

}  // namespace stylet::debrief
