// The sterile sheet over the patient, and the trunk it lies on.
#pragma once

#include "engine/render/room_layout.h"
#include "engine/render/room_mesh.h"

#include <Eigen/Core>

#include <cstdint>
#include <span>
#include <vector>

namespace stylet::render {

// The sheet is hung over a bar between patient and anaesthetist: its half width, height and place, table's frame, m.
inline constexpr double kScreenHalfWidth = 0.36;
inline constexpr double kScreenHeight = 0.44;
inline constexpr double kScreenY = 0.47;

/// How far the cloth keeps off the skin, m.
inline constexpr double kDrapeOffset = 0.005;

/// A sheet over trunk and legs, down both sides of the table, and up to the bar at the head. It clings to the trunk
/// (as the film round a field does) and falls in folds elsewhere. All of it, the opening of the field too: the shader
/// leaves that out, by the coordinates.
/// @param skin  points on it, a centimeter apart at most, patient frame: the cloth lies on its outside, and as the
///              trunk's ellipse has it where there is none
RoomMesh drape_mesh(const RoomLayout& layout, const std::vector<Eigen::Vector3f>& skin);

/// Skin under the cloth, a little below the patient's own and to some way past the ends of the trunk: what one sees
/// where his surfaces have none, or a gap. Without coordinates. @param skin  as drape_mesh() has it
RoomMesh lining_mesh(const RoomLayout& layout, const std::vector<Eigen::Vector3f>& skin);

/// Points of a ring of the cavity's wall, the first once more as the last.
inline constexpr std::uint32_t kCavityRing = 49;

/// Rings round the inside of the trunk. @param along  where, m along the table; ascending
/// @return  [along, kCavityRing], table's frame
std::vector<Eigen::Vector3f> cavity_rings(const RoomLayout& layout, const std::vector<Eigen::Vector3f>& skin,
                                          double below_skin, std::span<const double> along);

/// Inner side of the trunk from end to end, below cloth and skin, in cavity_rings(); triangles face inwards.
RoomMesh cavity_mesh(const RoomLayout& layout, const std::vector<Eigen::Vector3f>& skin);

/// What closes it where the patient's surfaces end: the tissue that a scan goes through there. Triangles face
/// inwards.
RoomMesh cut_mesh(const RoomLayout& layout, const std::vector<Eigen::Vector3f>& skin);

}  // namespace stylet::render
