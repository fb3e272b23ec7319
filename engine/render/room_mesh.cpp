#include "engine/render/room_mesh.h"

#include "engine/render/drape_mesh.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace stylet::render {

namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

void add_vertex(RoomMesh& mesh, const Vector3d& position, const Vector3d& normal) {
  mesh.positions.push_back(position.cast<float>());
  mesh.normals.push_back(normal.cast<float>());
}

/// Coordinates along an edge of a rounded box: the two roundings, and even steps between.
std::vector<double> stops(double size, double rounding) {
  const double half = size / 2;
  std::vector<double> at;
  for (const double share : {0.0, 0.3, 1.0})
    if (rounding > 0 || share == 1.0) at.push_back(-half + share * rounding);
  const int steps = std::max(1, static_cast<int>(std::ceil((size - 2 * rounding) / kLongestEdge)));
  for (int i = 1; i < steps; ++i) at.push_back(-half + rounding + (size - 2 * rounding) * i / steps);
  for (const double share : {1.0, 0.3, 0.0})
    if (rounding > 0 || share == 1.0) at.push_back(half - share * rounding);
  return at;
}

Isometry3d at(const Vector3d& position) {
  return Isometry3d(Eigen::Translation3d(position));
}

void add_box_between(RoomMesh& mesh, const Vector3d& least, const Vector3d& most, double rounding) {
  add_box(mesh, at((least + most) / 2), most - least, rounding);
}

/// A picture with its bezel round it.
void add_monitor(RoomMesh& casing, RoomMesh& picture, const Isometry3d& pose, const Eigen::Vector2d& half) {
  add_box(casing, pose * Eigen::Translation3d(0, -0.008, -0.022), {2 * half.x() + 0.044, 2 * half.y() + 0.060, 0.038},
          0.012);
  const auto cells = [](double size) { return std::max(10U, static_cast<std::uint32_t>(std::ceil(size / 0.045))); };
  const std::uint32_t columns = cells(2 * half.x()), rows = cells(2 * half.y());
  for (std::uint32_t j = 0; j <= rows; ++j)
    for (std::uint32_t i = 0; i <= columns; ++i) {
      const double u = double{1} * i / columns, v = double{1} * j / rows;
      add_vertex(picture, pose * Vector3d((2 * u - 1) * half.x(), (1 - 2 * v) * half.y(), 0), pose.linear().col(2));
      picture.coordinates.push_back({static_cast<float>(u), static_cast<float>(v)});
    }
  for (std::uint32_t j = 0; j < rows; ++j)
    for (std::uint32_t i = 0; i < columns; ++i) {
      const std::uint32_t corner = j * (columns + 1) + i, below = corner + columns + 1;
      for (const std::uint32_t index : {corner, below, below + 1, corner, below + 1, corner + 1})
        picture.indices.push_back(index);
    }
}

void add_machine(RoomMeshes& room, const RoomLayout& layout) {
  const Isometry3d& screen = layout.table_from_screen;
  const Eigen::Vector2d half = layout.screen_half;
  add_monitor(room.dark, room.screen, screen, half);

  // The cart stands upright under the monitor, turned as the monitor is.
  Isometry3d cart = at({screen.translation().x(), screen.translation().y(), layout.floor_z});
  const Vector3d front = Vector3d(screen.linear()(0, 2), screen.linear()(1, 2), 0).normalized();
  cart.linear().col(2) = Vector3d::UnitZ();
  cart.linear().col(1) = -front;
  cart.linear().col(0) = cart.linear().col(1).cross(Vector3d::UnitZ());
  const double console = screen.translation().z() - layout.floor_z - half.y() - 0.20;
  add_box(room.enamel, cart * at({0, 0.06, 0.12}), {0.46, 0.56, 0.10}, 0.035);
  add_box(room.enamel, cart * at({0, 0.12, (console + 0.10) / 2}), {0.30, 0.26, console - 0.10}, 0.05);
  add_box(room.enamel, cart * at({0, 0.02, console}), {0.48, 0.50, 0.07}, 0.03);
  const Isometry3d tilted = cart * at({0, -0.09, console + 0.046}) * Eigen::AngleAxisd(0.16, Vector3d::UnitX());
  add_box(room.dark, tilted, {0.42, 0.26, 0.022}, 0.010);
  for (int key = 0; key < 8; ++key)
    add_box(room.enamel, tilted * at({-0.165 + 0.047 * key, 0.06, 0.012}), {0.030, 0.030, 0.008}, 0.003);
  add_rod(room.enamel, tilted * Vector3d(0, -0.055, 0.006), tilted * Vector3d(0, -0.055, 0.022), 0.030);
  add_rod(room.enamel, cart * Vector3d(0, 0.14, console), screen * Vector3d(0, -0.05, -0.07), 0.024);
  add_rod(room.enamel, screen * Vector3d(0, -0.05, -0.07), screen * Vector3d(0, -0.05, -0.03), 0.045);
  for (const double x : {-0.19, 0.19})
    for (const double y : {-0.16, 0.28})
      add_rod(room.dark, cart * Vector3d(x - 0.018, y, 0.045), cart * Vector3d(x + 0.018, y, 0.045), 0.045);
}

/// Monitor of the session: an arm behind it, and a pole up to the ceiling.
void add_panel(RoomMeshes& room, const RoomLayout& layout) {
  const Isometry3d& panel = layout.table_from_panel;
  add_monitor(room.panel_case, room.panel_picture, panel, layout.panel_half);
  const Vector3d back = panel * Vector3d(0, 0, -0.04), joint = panel * Vector3d(0, 0, -0.10);
  const Vector3d foot = joint + Vector3d(-0.22 * layout.trainee_side, 0.10, 0);
  add_rod(room.panel_arm, back, joint, 0.045);
  add_rod(room.panel_arm, joint, foot, 0.020);
  add_rod(room.panel_arm, foot - Vector3d(0, 0, 0.05), {foot.x(), foot.y(), layout.room_max.z()}, 0.026);
}

void add_table(RoomMeshes& room, const RoomLayout& layout) {
  const Vector3d least = layout.table_min, most = layout.table_max;
  add_box_between(room.mattress, least, most, 0.025);
  add_box_between(room.enamel, {least.x() + 0.01, least.y() + 0.02, least.z() - 0.045},
                  {most.x() - 0.01, most.y() - 0.02, least.z() - 0.002}, 0.012);
  for (const double side : {-1.0, 1.0}) {
    const double x = side * (most.x() + 0.012);
    add_box_between(room.steel, {x - 0.005, least.y() + 0.10, least.z() - 0.035},
                    {x + 0.005, most.y() - 0.10, least.z() - 0.005}, 0.003);
  }
  const double middle = (least.y() + most.y()) / 2;
  add_box_between(room.enamel, {-0.16, middle - 0.22, layout.floor_z + 0.10},
                  {0.16, middle + 0.22, least.z() - 0.045}, 0.05);
  add_box_between(room.enamel, {-0.24, middle - 0.45, layout.floor_z + 0.01},
                  {0.24, middle + 0.45, layout.floor_z + 0.11}, 0.04);
}

void add_lamp(RoomMeshes& room, const RoomLayout& layout) {
  constexpr double kLampRadius = 0.30;
  const Vector3d back = layout.lamp - 0.075 * layout.lamp_axis;
  add_rod(room.enamel, layout.lamp - 0.002 * layout.lamp_axis, back, kLampRadius);
  add_rod(room.enamel, back, back - 0.05 * layout.lamp_axis, 0.14);
  add_rod(room.glow, layout.lamp, layout.lamp - 0.001 * layout.lamp_axis, kLampRadius - 0.03);
  const Vector3d knee = back - 0.10 * layout.lamp_axis + Vector3d(0, 0.05, 0.12);
  const Vector3d shoulder(knee.x(), knee.y() + 0.75, layout.room_max.z() - 0.18);
  add_rod(room.enamel, back - 0.04 * layout.lamp_axis, knee, 0.022);
  add_rod(room.enamel, knee, shoulder, 0.028);
  add_rod(room.enamel, shoulder - Vector3d(0, 0, 0.06), {shoulder.x(), shoulder.y(), layout.room_max.z()}, 0.045);
}

/// A test object stands in a tray: clear as it is, it would seem to float.
void add_tray(RoomMeshes& room, const RoomLayout& layout) {
  constexpr double kMargin = 0.014, kWall = 0.003, kRim = 0.011;
  const double x = layout.trunk_half.x() + kMargin, low = layout.trunk_y[0] - kMargin,
               high = layout.trunk_y[1] + kMargin;
  add_box_between(room.steel, {-x, low, -0.004}, {x, high, 0.0006}, 0.001);
  for (const double side : {-1.0, 1.0}) {
    add_box_between(room.steel, {side * x - kWall, low - kWall, 0}, {side * x + kWall, high + kWall, kRim}, 0.0015);
    const double y = side > 0 ? high : low;
    add_box_between(room.steel, {-x, y - kWall, 0}, {x, y + kWall, kRim}, 0.0015);
  }
}

}  // namespace

void add_box(RoomMesh& mesh, const Isometry3d& pose, const Vector3d& size, double rounding) {
  const Vector3d core = size / 2 - Vector3d::Constant(rounding);
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {-1.0, 1.0}) {
      const int u_axis = (axis + 1) % 3, v_axis = (axis + 2) % 3;
      const std::vector<double> us = stops(size[u_axis], rounding), vs = stops(size[v_axis], rounding);
      const auto base = static_cast<std::uint32_t>(mesh.positions.size());
      for (const double v : vs)
        for (const double u : us) {
          Vector3d p;
          p[axis] = side * size[axis] / 2;
          p[u_axis] = u;
          p[v_axis] = v;
          const Vector3d inner = p.cwiseMax(-core).cwiseMin(core);
          Vector3d normal = p - inner;
          if (rounding > 0) {
            normal.normalize();
            p = inner + rounding * normal;
          } else {
            normal = side * Vector3d::Unit(axis);
          }
          add_vertex(mesh, pose * p, pose.linear() * normal);
        }
      const auto columns = static_cast<std::uint32_t>(us.size());
      for (std::uint32_t j = 0; j + 1 < vs.size(); ++j)
        for (std::uint32_t i = 0; i + 1 < columns; ++i) {
          const std::uint32_t a = base + j * columns + i, b = a + 1, c = b + columns, d = a + columns;
          if (side > 0)
            mesh.indices.insert(mesh.indices.end(), {a, b, c, a, c, d});
          else
            mesh.indices.insert(mesh.indices.end(), {a, c, b, a, d, c});
        }
    }
}

void add_rod(RoomMesh& mesh, const Vector3d& from, const Vector3d& to, double radius) {
  const std::uint32_t sides = radius > 0.1 ? 48 : 20;
  const Vector3d z = (to - from).normalized();
  const Vector3d x = z.unitOrthogonal(), y = z.cross(x);
  const auto rim = [&](std::uint32_t i) -> Vector3d {
    const double angle = 2 * std::numbers::pi * i / sides;
    return std::cos(angle) * x + std::sin(angle) * y;
  };
  const int sections = std::max(1, static_cast<int>(std::ceil((to - from).norm() / kLongestEdge)));
  const auto ring = [&](const Vector3d& centre, double r, const Vector3d* normal) {
    for (std::uint32_t i = 0; i < sides; ++i) add_vertex(mesh, centre + r * rim(i), normal ? *normal : rim(i));
  };
  const auto join = [&](std::uint32_t first, std::uint32_t second) {
    for (std::uint32_t i = 0; i < sides; ++i) {
      const std::uint32_t j = (i + 1) % sides;
      mesh.indices.insert(mesh.indices.end(), {first + i, first + j, second + j, first + i, second + j, second + i});
    }
  };
  auto base = static_cast<std::uint32_t>(mesh.positions.size());
  for (int s = 0; s <= sections; ++s) ring(from + (to - from) * s / sections, radius, nullptr);
  for (int s = 0; s < sections; ++s, base += sides) join(base, base + sides);
  // Ends: rings from the rim to the middle.
  const int rings = std::max(1, static_cast<int>(std::ceil(radius / kLongestEdge)));
  for (const bool far : {false, true}) {
    const Vector3d normal = far ? z : Vector3d(-z);
    base = static_cast<std::uint32_t>(mesh.positions.size());
    for (int r = 0; r <= rings; ++r) ring(far ? to : from, radius * (1 - static_cast<double>(r) / rings), &normal);
    for (int r = 0; r < rings; ++r, base += sides) far ? join(base, base + sides) : join(base + sides, base);
  }
}

RoomMeshes room_meshes(const RoomLayout& layout, const std::vector<Eigen::Vector3f>& skin) {
  RoomMeshes room;
  add_table(room, layout);
  add_machine(room, layout);
  add_panel(room, layout);
  add_lamp(room, layout);
  if (!layout.draped) add_tray(room, layout);
  if (layout.draped) {
    room.drape = drape_mesh(layout, skin);
    room.lining = lining_mesh(layout, skin);
    room.cavity = cavity_mesh(layout, skin);
    room.cut = cut_mesh(layout, skin);
    for (const double side : {-1.0, 1.0}) {
      const double x = side * (kScreenHalfWidth + 0.012);
      add_rod(room.steel, {x, kScreenY, layout.table_min.z() - 0.02}, {x, kScreenY, kScreenHeight + 0.03}, 0.009);
    }
    add_rod(room.steel, {-kScreenHalfWidth - 0.03, kScreenY, kScreenHeight - 0.022},
            {kScreenHalfWidth + 0.03, kScreenY, kScreenHeight - 0.022}, 0.007);
  }
  return room;
}

}  // namespace stylet::render
