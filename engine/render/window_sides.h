// Where the window into the patient ends beside the circle that it is on the screen: it shows what lies in the trunk,
// and never past it.
#pragma once

#include "engine/render/room_layout.h"

#include <Eigen/Core>

#include <array>
#include <span>

namespace stylet::render {

/// Table's frame, m.
struct WindowSides {
  /// Ends along the table.
  std::array<double, 2> along{-1e3, 1e3};
  /// Planes through the eye: normal (unit, outwards) and offset.
  std::array<Eigen::Vector4d, 3> planes{Eigen::Vector4d(0, 0, 0, -1e3), Eigen::Vector4d(0, 0, 0, -1e3),
                                        Eigen::Vector4d(0, 0, 0, -1e3)};
};

/// Within, each line of sight ends in the trunk's cavity. An end of the trunk that the eye is beyond bounds what lies
/// before it only from below: there one looks in through it.
/// @param cavity  rings of its wall (cavity_rings()); none: there are no sides
/// @param radius  of the window at the focus, m
WindowSides window_sides(const RoomLayout& layout, std::span<const Eigen::Vector3f> cavity,
                         const Eigen::Vector3d& eye, const Eigen::Vector3d& focus, double radius);

}  // namespace stylet::render
