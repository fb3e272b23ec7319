#include "engine/render/room_layout.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

namespace stylet::render {

namespace {

using Eigen::Vector3d;

constexpr double kSkinMargin = 0.022;   // m of skin that stays under the drape where the patient's surfaces end
constexpr double kFieldMargin = 0.040;  // m of open skin round probe and needle
constexpr double kHemOnTrunk = 0.015;   // m of cloth that lies on the skin beside the field
constexpr double kWhole = 0.6;          // of the farther side, that the nearer reaches from the highest point
constexpr double kEyeHeight = 1.62;     // m over the floor

/// Axes of the table in the patient frame: up as the room has it, along towards the head where the patient lies.
Eigen::Isometry3d axes_of(const content::Scene& scene) {
  const Vector3d up = scene.room_from_patient.linear().transpose() * Vector3d::UnitY();
  Vector3d along = Vector3d::UnitY() - up.y() * up;
  if (along.norm() < 0.5) along = -Vector3d::UnitZ() + up.z() * up;  // a patient that sits or stands
  Eigen::Isometry3d axes = Eigen::Isometry3d::Identity();
  axes.linear().col(1) = along.normalized();
  axes.linear().col(2) = up;
  axes.linear().col(0) = axes.linear().col(1).cross(up);
  return axes;
}

/// Where the needle of the motion's start, pushed on straight, first meets the skin; in the table's frame.
std::optional<Vector3d> needle_entry(const content::Scene& scene, const RoomLayout& layout) {
  if (scene.motion.stylus.empty()) return {};
  const physics::StylusPose pose = scene.motion.stylus.front().pose;
  const Vector3d way = pose.orientation * Vector3d::UnitZ();
  double nearest = std::numeric_limits<double>::infinity();
  for (const content::Surface& surface : scene.surfaces) {
    if (scene.tissues[surface.tissue].name != kSkin) continue;
    for (std::size_t t = 0; t + 2 < surface.indices.size(); t += 3) {
      // Moeller and Trumbore 1997.
      const Vector3d a = surface.positions[surface.indices[t]].cast<double>();
      const Vector3d ab = surface.positions[surface.indices[t + 1]].cast<double>() - a;
      const Vector3d ac = surface.positions[surface.indices[t + 2]].cast<double>() - a;
      const Vector3d p = way.cross(ac), from = pose.position - a, q = from.cross(ab);
      const double det = ab.dot(p);
      if (det == 0) continue;
      const double u = from.dot(p) / det, v = way.dot(q) / det, along = ac.dot(q) / det;
      if (u >= 0 && v >= 0 && u + v <= 1 && along > 0) nearest = std::min(nearest, along);
    }
  }
  if (!std::isfinite(nearest)) return {};
  return layout.patient_from_table.inverse() * Vector3d(pose.position + nearest * way);
}

void place_field(const content::Scene& scene, RoomLayout& layout) {
  const Vector3d probe = layout.patient_from_table.inverse() * scene.probe.pose.position;
  const Vector3d entry = needle_entry(scene, layout).value_or(probe);
  const double round = (layout.trunk_half.x() + layout.trunk_half.y()) / 2;
  const double a = layout.trunk_angle(probe), b = layout.trunk_angle(entry);
  const double margin = (kFieldMargin + 0.006) / round, lowest = kDrapeLeaves - kHemOnTrunk / round;
  const double right = std::max(std::min(a, b) - margin, -lowest), left = std::min(std::max(a, b) + margin, lowest);
  layout.field_angle = (right + left) / 2;
  layout.field_half.x() = std::max(round * (left - right) / 2, 0.02);
  double low = std::min(probe.y(), entry.y()) - kFieldMargin, high = std::max(probe.y(), entry.y()) + kFieldMargin;
  low = std::max(low, layout.trunk_y[0] + kSkinMargin);
  high = std::min(high, layout.trunk_y[1] - kSkinMargin);
  layout.field_y = (low + high) / 2;
  layout.field_half.y() = std::max((high - low) / 2, 0.02);
}

std::array<Vector3d, 4> corners(const Eigen::Isometry3d& patient_from_picture, const Eigen::Vector2d& half) {
  std::array<Vector3d, 4> corners;
  constexpr std::array<std::array<double, 2>, 4> kSigns{{{-1, 1}, {1, 1}, {1, -1}, {-1, -1}}};
  for (std::size_t i = 0; i < 4; ++i)
    corners[i] = patient_from_picture * Vector3d(kSigns[i][0] * half.x(), kSigns[i][1] * half.y(), 0);
  return corners;
}

/// A picture at `middle` that is turned to `eye`, upright. Table's frame.
Eigen::Isometry3d turned_to(const Vector3d& eye, const Vector3d& middle) {
  Eigen::Isometry3d picture = Eigen::Isometry3d::Identity();
  picture.translation() = middle;
  const Vector3d normal = (eye - middle).normalized();
  const Vector3d right = Vector3d::UnitZ().cross(normal).normalized();
  picture.linear().col(0) = right;
  picture.linear().col(1) = normal.cross(right);
  picture.linear().col(2) = normal;
  return picture;
}

}  // namespace

Vector3d RoomLayout::trunk_point(double angle, double y, double offset) const {
  return {trunk_centre.x() + (trunk_half.x() + offset) * std::sin(angle), y,
          trunk_centre.y() + (trunk_half.y() + offset) * std::cos(angle)};
}

double RoomLayout::trunk_angle(const Vector3d& in_table) const {
  return std::atan2((in_table.x() - trunk_centre.x()) / trunk_half.x(),
                    (in_table.z() - trunk_centre.y()) / trunk_half.y());
}

Eigen::Vector2d RoomLayout::in_field(double angle, double y) const {
  const double round = (trunk_half.x() + trunk_half.y()) / 2;
  return {round * (angle - field_angle), y - field_y};
}

double RoomLayout::outside_field(double angle, double y) const {
  const Eigen::Vector2d d = in_field(angle, y).cwiseAbs() - field_half + Eigen::Vector2d::Constant(field_corner);
  return std::min(d.maxCoeff(), 0.0) + d.cwiseMax(0.0).norm() - field_corner;
}

std::array<Vector3d, 4> RoomLayout::screen_corners() const {
  return corners(patient_from_table * table_from_screen, screen_half);
}

std::array<Vector3d, 4> RoomLayout::panel_corners() const {
  return corners(patient_from_table * table_from_panel, panel_half);
}

content::Camera RoomLayout::standing_camera() const {
  const Vector3d eye(trainee_side * 0.72, field_y - 0.34, floor_z + kEyeHeight);
  const Vector3d at = 0.62 * trunk_point(field_angle, field_y) + 0.38 * table_from_screen.translation();
  return {patient_from_table * eye, patient_from_table * at, patient_from_table.linear().col(2), 0.9};
}

content::Camera RoomLayout::room_camera() const {
  const Vector3d eye(trainee_side * 2.25, field_y - 1.9, floor_z + 1.85);
  const Vector3d at(0, field_y + 0.05, -0.02);
  return {patient_from_table * eye, patient_from_table * at, patient_from_table.linear().col(2), 0.85};
}

RoomLayout room_layout(const content::Scene& scene) {
  RoomLayout layout;
  const Eigen::Isometry3d axes = axes_of(scene);
  constexpr double kFar = std::numeric_limits<double>::max();
  Vector3d least = Vector3d::Constant(kFar), most = -least, skin_top = -least;
  double skin_side_z = 0, skin_least = kFar, skin_most = -kFar, skin_bottom = kFar;
  const auto is_skin = [&](const content::Surface& surface) { return scene.tissues[surface.tissue].name == kSkin; };
  for (const content::Surface& surface : scene.surfaces) {
    const bool skin = is_skin(surface);
    layout.draped = layout.draped || (skin && !surface.positions.empty());
    for (const Eigen::Vector3f& position : surface.positions) {
      const Vector3d p = axes.inverse() * position.cast<double>();
      least = least.cwiseMin(p);
      most = most.cwiseMax(p);
      if (!skin) continue;
      if (p.z() > skin_top.z()) skin_top = p;
      skin_least = std::min(skin_least, p.x());
      skin_most = std::max(skin_most, p.x());
      skin_bottom = std::min(skin_bottom, p.z());
    }
  }
  if (least.x() > most.x()) least = Vector3d(-0.1, -0.1, 0), most = Vector3d(0.1, 0.1, 0.2);
  if (layout.draped) {
    // Half a trunk is enough: its highest point lies in the midline, its widest at half its height.
    double widest = 0;
    for (const content::Surface& surface : scene.surfaces) {
      if (!is_skin(surface)) continue;
      for (const Eigen::Vector3f& position : surface.positions) {
        const Vector3d p = axes.inverse() * position.cast<double>();
        if (std::abs(p.x() - skin_top.x()) <= widest) continue;
        widest = std::abs(p.x() - skin_top.x());
        skin_side_z = p.z();
      }
    }
    layout.trunk_centre.x() = skin_top.x();
    // Of a whole trunk the highest point need not lie in the midline, nor the widest at half its height.
    const double right = skin_top.x() - skin_least, left = skin_most - skin_top.x();
    if (std::min(left, right) > kWhole * std::max(left, right)) {
      layout.trunk_centre.x() = (skin_least + skin_most) / 2;
      widest = (skin_most - skin_least) / 2;
      skin_side_z = (skin_bottom + skin_top.z()) / 2;
    }
    layout.trunk_half = {widest, skin_top.z() - skin_side_z};
    least.z() = std::min(least.z(), skin_side_z - layout.trunk_half.y());
  } else {
    layout.trunk_centre.x() = (least.x() + most.x()) / 2;
    layout.trunk_half = {(most.x() - least.x()) / 2, (most.z() - least.z()) / 2};
    skin_side_z = (most.z() + least.z()) / 2;
  }
  layout.trunk_half = layout.trunk_half.cwiseMax(0.02);  // a plate still has a round side
  const double middle_y = (least.y() + most.y()) / 2;
  const double bottom = layout.draped ? skin_side_z - layout.trunk_half.y() + 0.006 : least.z();  // sunk in a little
  layout.patient_from_table = axes * Eigen::Translation3d(layout.trunk_centre.x(), middle_y, bottom);
  layout.trunk_centre = {0, skin_side_z - bottom};
  layout.trunk_y = {least.y() - middle_y, most.y() - middle_y};
  place_field(scene, layout);

  const Vector3d eye = layout.patient_from_table.inverse() * scene.camera.eye;
  layout.trainee_side = eye.x() > 0.02 ? 1 : -1;
  const Vector3d field = layout.trunk_point(layout.field_angle, layout.field_y);
  layout.lamp = field + Vector3d(-0.30 * layout.trainee_side, 0.32, 1.08);
  layout.lamp_axis = (field - layout.lamp).normalized();

  // The machine stands across the table, its screen turned to the trainee's eyes.
  const Vector3d screen(-layout.trainee_side * 0.74, layout.field_y + 0.30, 0.42);
  const Vector3d trainee(layout.trainee_side * 0.72, layout.field_y - 0.30, layout.floor_z + kEyeHeight);
  layout.table_from_screen = turned_to(trainee, screen);
  const Vector3d normal = layout.table_from_screen.linear().col(2);
  layout.cable_way = Vector3d(normal.x(), normal.y(), 0).normalized();
  // Seen beyond the field, beside the screen and above the cloth at the patient's neck.
  layout.table_from_panel =
      turned_to(trainee, {-layout.trainee_side * 0.16, layout.field_y + 0.74, layout.draped ? 0.68 : 0.36});
  layout.cable_port = screen + 0.25 * layout.cable_way - Vector3d(0, 0, layout.screen_half.y() + 0.20);
  return layout;
}

}  // namespace stylet::render
