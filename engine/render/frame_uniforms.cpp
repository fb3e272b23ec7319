#include "engine/render/frame_uniforms.h"

#include "engine/render/shadow_pass.h"
#include "engine/render/window_sides.h"

#include <Eigen/LU>

#include <algorithm>

namespace stylet::render {

namespace {

constexpr double kLamp = 0.88;      // over pi, at the field
constexpr float kEyeLight = 0.09F;  // over pi: what the lamp leaves dark is still seen
constexpr float kOrganLight = 0.26F;

vec4 pack(const Eigen::Vector3d& v, double w) {
  return {static_cast<float>(v.x()), static_cast<float>(v.y()), static_cast<float>(v.z()), static_cast<float>(w)};
}

mat4 pack(const Eigen::Matrix4d& m) {
  mat4 columns;
  for (int i = 0; i < 16; ++i) columns[i] = static_cast<float>(m(i % 4, i / 4));
  return columns;
}

vec4 rectangle(const Eigen::Vector2d& least, const Eigen::Vector2d& most) {
  return {static_cast<float>(least.x()), static_cast<float>(least.y()), static_cast<float>(most.x()),
          static_cast<float>(most.y())};
}

}  // namespace

FrameUniforms frame_uniforms(const state::FrameState& state, const std::vector<Eye>& eyes, const RoomLayout& layout,
                             std::span<const Eigen::Vector3f> cavity, const content::Probe& probe,
                             const Eigen::Vector3d& focus, double radius, const ViewOptions& options) {
  FrameUniforms u{};
  Eigen::Vector3d between_eyes = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < 2; ++i) {
    const Eye& eye = eyes[std::min(i, eyes.size() - 1)];
    u.clip_from_patient[i] = pack(eye.clip_from_patient);
    u.patient_from_clip[i] = pack(Eigen::Matrix4d(eye.clip_from_patient.inverse()));
    u.eye[i] = pack(eye.position, 1);
    between_eyes += eye.position / 2;
  }
  Eigen::Isometry3d patient_from_probe = Eigen::Isometry3d::Identity();
  patient_from_probe.translate(state.probe_position.cast<double>());
  patient_from_probe.rotate(state.probe_orientation.cast<double>().normalized());
  u.patient_from_probe = pack(patient_from_probe.matrix());
  u.probe_from_patient = pack(patient_from_probe.inverse().matrix());
  u.breath = {state.breath.x(), state.breath.y(), state.breath.z(), 0};

  const Eigen::Isometry3d& patient_from_table = layout.patient_from_table;
  u.table_from_patient = pack(patient_from_table.inverse().matrix());
  u.light_clip_from_patient = pack(lamp_eye(layout).clip_from_patient);
  u.up = pack(patient_from_table.linear().col(2), 0);
  u.along = pack(patient_from_table.linear().col(1), 0);
  u.lamp = pack(patient_from_table * layout.lamp, kLamp);
  const double reach = (layout.trunk_point(layout.field_angle, layout.field_y) - layout.lamp).norm();
  u.lamp_axis = pack(patient_from_table.linear() * layout.lamp_axis, reach);
  u.eye_light = {kEyeLight, kOrganLight, 0, 0};
  u.room_min = pack(layout.room_min, 0);
  u.room_max = pack(layout.room_max, 0);
  u.table_foot = rectangle(layout.table_min.head<2>(), layout.table_max.head<2>());
  const Eigen::Vector2d cart = layout.table_from_screen.translation().head<2>();
  u.cart_foot = rectangle(cart - Eigen::Vector2d(0.24, 0.24), cart + Eigen::Vector2d(0.24, 0.24));

  u.field = pack({layout.field_half.x(), layout.field_half.y(), layout.field_corner}, 0);
  const WindowSides sides = window_sides(layout, cavity, patient_from_table.inverse() * between_eyes,
                                         patient_from_table.inverse() * focus, radius);
  const double to_patient = patient_from_table.linear().col(1).dot(patient_from_table.translation());
  u.trunk = pack({sides.along[0] + to_patient, sides.along[1] + to_patient, 0}, 0);
  for (std::size_t i = 0; i < 3; ++i) {
    const Eigen::Vector3d normal = patient_from_table.linear() * sides.planes[i].head<3>();
    u.sides[i] = pack(normal, sides.planes[i].w() - normal.dot(patient_from_table.translation()));
  }
  u.focus = pack(focus, radius);
  const Eigen::Vector3d towards_eyes = between_eyes - focus;
  u.focus_axis = pack(towards_eyes.normalized(), std::max(towards_eyes.norm(), 1e-3));
  u.fan = {static_cast<float>(probe.convex ? probe.radius : 0),
           static_cast<float>(probe.convex ? probe.field_of_view / 2 : probe.width / 2),
           static_cast<float>(probe.depth), probe.convex ? 1.0F : 0.0F};
  if (const PlaneTexture& plane = options.plane; plane.image != nullptr && plane.metres_per_pixel > 0) {
    const VkExtent3D size = plane.image->extent();
    u.fan_image = {static_cast<float>(plane.origin.x()), static_cast<float>(plane.origin.y()),
                   static_cast<float>(1 / (plane.metres_per_pixel * size.width)),
                   static_cast<float>(1 / (plane.metres_per_pixel * size.height))};
  }
  u.see = {static_cast<std::uint32_t>(options.see_through), 0, 0, 0};
  return u;
}

}  // namespace stylet::render
