// What stands in the room, as triangles: table, lamp, ultrasound machine, and the cloth over the patient.
#pragma once

#include "engine/content/scene.h"
#include "engine/render/room_layout.h"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <vector>

namespace stylet::render {

/// A mesh in the table's frame, m; counter-clockwise from outside.
struct RoomMesh {
  std::vector<Eigen::Vector3f> positions;
  std::vector<Eigen::Vector3f> normals;           ///< unit, outward
  std::vector<std::array<float, 2>> coordinates;  ///< one a vertex, or empty: what a material wants to know
  std::vector<std::uint32_t> indices;
};

/// No triangle is longer than this, m. Large ones would do but for lavapipe of Mesa 22.3.6, which draws what covers a
/// whole tile of 64 x 64 pixels into the first view only.
inline constexpr double kLongestEdge = 0.05;

/// Box with rounded edges. @param rounding  radius of the edges, less than half the smallest side
void add_box(RoomMesh& mesh, const Eigen::Isometry3d& pose, const Eigen::Vector3d& size, double rounding);
/// Rod between two points, with flat ends.
void add_rod(RoomMesh& mesh, const Eigen::Vector3d& from, const Eigen::Vector3d& to, double radius);

struct RoomMeshes {
  RoomMesh mattress;
  RoomMesh enamel;         ///< painted metal and plastic: lamp, table's foot, machine
  RoomMesh dark;           ///< bezel, keyboard, wheels
  RoomMesh steel;          ///< rails and poles
  RoomMesh glow;           ///< the lamp's face
  RoomMesh screen;         ///< coordinates: of the picture, (0, 0) upper left
  RoomMesh panel_arm;      ///< of the monitor that tells of the session
  RoomMesh panel_case;     ///< its bezel
  RoomMesh panel_picture;  ///< coordinates as those of the screen
  RoomMesh drape;          ///< coordinates: RoomLayout::in_field. Empty: no skin
  RoomMesh lining;         ///< skin where the patient has none under the cloth
  RoomMesh cavity;         ///< inside of the trunk, seen from within where the patient is cut open. Empty: no skin
  RoomMesh cut;            ///< its ends
};

/// @param skin  as drape_mesh() has it
RoomMeshes room_meshes(const RoomLayout& layout, const std::vector<Eigen::Vector3f>& skin);

}  // namespace stylet::render
