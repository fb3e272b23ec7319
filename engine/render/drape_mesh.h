// The sterile sheet over the patient, and the trunk it lies on.
#pragma once

#include "engine/render/room_layout.h"
#include "engine/render/room_mesh.h"

namespace stylet::render {

// The sheet is hung over a bar between patient and anaesthetist: its half width, height and place, table's frame, m.
inline constexpr double kScreenHalfWidth = 0.36;
inline constexpr double kScreenHeight = 0.44;
inline constexpr double kScreenY = 0.47;

/// How far the cloth keeps off the skin, m.
inline constexpr double kDrapeOffset = 0.005;

/// Where it leaves the trunk, down to the mattress: rad round the trunk, either side of its top.
inline constexpr double kDrapeLeaves = 1.85;

/// A sheet over trunk and legs, down both sides of the table, and up to the bar at the head. It clings to the trunk
/// (as the film round a field does) and falls in folds elsewhere. All of it, the opening of the field too: the shader
/// leaves that out, by the coordinates.
/// @param skin  points on it, a centimeter apart at most, patient frame: the cloth lies on its outside, and as the
///              trunk's ellipse has it where there is none
RoomMesh drape_mesh(const RoomLayout& layout, const std::vector<Eigen::Vector3f>& skin);

/// Inner side of the trunk, below cloth and skin, closed at both ends; triangles face inwards.
RoomMesh cavity_mesh(const RoomLayout& layout, const std::vector<Eigen::Vector3f>& skin);

}  // namespace stylet::render
