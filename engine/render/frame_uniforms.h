// What the shaders are told about a frame.
#pragma once

#include "engine/content/scene.h"
#include "engine/render/camera.h"
#include "engine/render/room_layout.h"
#include "engine/render/view_options.h"
#include "engine/state/frame_state.h"
#include "shaders/shared.h"

#include <Eigen/Core>

#include <span>
#include <vector>

namespace stylet::render {

/// All that comes of scene and eyes; the renderer adds what its own images say (shadow, viewport).
/// @param eyes    one or two
/// @param cavity  rings of its wall as Geometry has them
/// @param focus   what the window of the covers shows, patient frame; `radius` of the window, m
FrameUniforms frame_uniforms(const state::FrameState& state, const std::vector<Eye>& eyes, const RoomLayout& layout,
                             std::span<const Eigen::Vector3f> cavity, const content::Probe& probe,
                             const Eigen::Vector3d& focus, double radius, const ViewOptions& options);

}  // namespace stylet::render
