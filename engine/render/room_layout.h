// Where things stand in the operating room: table, drape, lamp, ultrasound machine, and eyes. Found from the scene
// alone.
#pragma once

#include "engine/content/scene.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <array>

namespace stylet::render {

inline constexpr const char* kSkin = "skin";  ///< name of the tissue that is draped

/// Where the cloth leaves the trunk, down to the mattress: rad round the trunk, either side of its top.
inline constexpr double kDrapeLeaves = 1.85;

/// The table's frame: origin on the mattress under the middle of the patient, +X across to the patient's left, +Y
/// along to the head, +Z up. All lengths are metres in this frame but where said otherwise.
struct RoomLayout {
  Eigen::Isometry3d patient_from_table = Eigen::Isometry3d::Identity();

  /// The trunk's cross-section: an ellipse that fits the skin. Where the scene has no skin (a phantom) nothing is
  /// draped, and this is the ellipse in the bounding box.
  bool draped = false;
  Eigen::Vector2d trunk_centre{0, 0.11};  ///< x, z
  Eigen::Vector2d trunk_half{0.17, 0.11};
  std::array<double, 2> trunk_y{-0.1, 0.1};  ///< ends of the patient's surfaces

  /// Opening of the drape: a rounded rectangle on the trunk, in metres round its ellipse and along y.
  double field_angle = 0;  ///< of its middle, rad from straight up; to the patient's left is positive
  double field_y = 0;
  Eigen::Vector2d field_half{0.07, 0.07};  ///< round, along
  double field_corner = 0.02;              ///< radius

  double floor_z = -0.88;
  Eigen::Vector3d room_min{-2.7, -3.1, -0.88};  ///< floor and walls
  Eigen::Vector3d room_max{2.7, 2.5, 1.95};
  Eigen::Vector3d table_min{-0.27, -1.42, -0.08};  ///< mattress
  Eigen::Vector3d table_max{0.27, 0.78, 0};

  Eigen::Vector3d lamp{0, 0, 1.15};     ///< middle of the surgical lamp's face
  Eigen::Vector3d lamp_axis{0, 0, -1};  ///< unit, to the field

  double trainee_side = -1;  ///< -1: the trainee stands at the patient's right, +1: left
  Eigen::Isometry3d table_from_screen =
      Eigen::Isometry3d::Identity();  ///< its middle; +X right, +Y up, +Z to the eyes
  Eigen::Vector2d screen_half{0.22, 0.165};
  /// The monitor that tells of the session, hung from the ceiling; as the screen.
  Eigen::Isometry3d table_from_panel = Eigen::Isometry3d::Identity();
  Eigen::Vector2d panel_half{0.36, 0.18};
  Eigen::Vector3d cable_port{0, 0, 0};  ///< of the machine, where the probe's cable ends
  Eigen::Vector3d cable_way{1, 0, 0};   ///< unit, level, out of it

  /// Point of the trunk's ellipse, grown by `offset`.
  Eigen::Vector3d trunk_point(double angle, double y, double offset = 0) const;
  /// Angle of the direction from the trunk's middle to a point, as the ellipse counts it.
  double trunk_angle(const Eigen::Vector3d& in_table) const;
  /// Place from the field's middle, m: round the trunk, along it.
  Eigen::Vector2d in_field(double angle, double y) const;
  /// Distance from the field's border, m: negative in the opening.
  double outside_field(double angle, double y) const;
  /// Corners of the picture on the screen, and on the panel, in the patient frame: upper left, upper right, lower
  /// right, lower left.
  std::array<Eigen::Vector3d, 4> screen_corners() const;
  std::array<Eigen::Vector3d, 4> panel_corners() const;

  /// What a trainee who stands at the table sees, and the whole room from near its corner. Patient frame.
  content::Camera standing_camera() const;
  content::Camera room_camera() const;
};

/// @param scene  room_from_patient says which way is up; the skin gives the trunk, the probe and the start of the
/// motion
///               the field, the scenario's camera the trainee's side
RoomLayout room_layout(const content::Scene& scene);

}  // namespace stylet::render
