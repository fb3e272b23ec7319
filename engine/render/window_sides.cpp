#include "engine/render/window_sides.h"

#include "engine/render/drape_mesh.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace stylet::render {

namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::Vector4d;

constexpr double kBeforeEnd = 0.008;  // m of whole skin before an end of the trunk, at least
constexpr double kOverEnd = 0.028;    // m from the cloth down to what closes the cavity, and some for the round of it
constexpr double kBeforeSide = 0.010;  // m that lines of sight keep off the cavity's outline
constexpr double kWhereWide = 0.7;     // of its radius: farther along the trunk the window is narrower than its sides

Vector2d across(const Vector3d& x) {
  return {x.x(), x.z()};
}

/// Angles between which a ring is seen across the trunk, from the direction of its middle on.
struct Span {
  double least = 0, most = 0;
};
Span seen(std::span<const Eigen::Vector3f> ring, const Vector2d& eye, const Vector2d& way) {
  Span span;
  for (const Eigen::Vector3f& position : ring) {
    const Vector2d to = across(position.cast<double>()) - eye;
    const double angle = std::atan2(way.x() * to.y() - way.y() * to.x(), way.dot(to));
    span.least = std::min(span.least, angle);
    span.most = std::max(span.most, angle);
  }
  return span;
}

}  // namespace

WindowSides window_sides(const RoomLayout& layout, std::span<const Eigen::Vector3f> cavity, const Vector3d& eye,
                         const Vector3d& focus, double radius) {
  WindowSides sides;
  if (cavity.empty()) return sides;
  const Vector2d way = layout.trunk_centre - across(eye);
  // The narrowest of the rings at whose sides the window may end.
  Span span{-std::numbers::pi, std::numbers::pi};
  for (std::size_t first = 0; first < cavity.size(); first += kCavityRing) {
    const std::span<const Eigen::Vector3f> ring = cavity.subspan(first, kCavityRing);
    if (std::abs(static_cast<double>(ring.front().y()) - focus.y()) > kWhereWide * radius) continue;
    const Span of_ring = seen(ring, across(eye), way);
    if (of_ring.most - of_ring.least > 0.9 * std::numbers::pi) continue;  // the eye is over an end, or in it
    span = {std::max(span.least, of_ring.least), std::min(span.most, of_ring.most)};
  }
  const auto through_eye = [&](const Vector3d& normal) {
    Vector4d plane;
    plane << normal, kBeforeSide - normal.dot(eye);
    return plane;
  };
  if (span.most < std::numbers::pi) {
    const double middle = std::atan2(way.y(), way.x());
    const double most = middle + span.most, least = middle + span.least;
    sides.planes[0] = through_eye({-std::sin(most), 0, std::cos(most)});
    sides.planes[1] = through_eye({std::sin(least), 0, -std::cos(least)});
  }
  for (std::size_t end = 0; end < 2; ++end) {
    const double outwards = end == 0 ? -1 : 1;
    if (outwards * (eye.y() - layout.trunk_y[end]) <= 0) {
      // A flat line of sight goes far along the trunk until it is below the skin.
      const Vector3d to_eye = eye - focus;
      const double flat = outwards * -to_eye.y() / across(to_eye).norm();
      sides.along[end] = layout.trunk_y[end] - outwards * std::max(kBeforeEnd, kOverEnd * flat);
      continue;
    }
    const Vector3d at(0, layout.trunk_y[end], layout.trunk_centre.y());
    Vector3d below = Vector3d::UnitX().cross(Vector3d(at - Vector3d(0, eye.y(), eye.z()))).normalized();
    if (below.z() > 0) below = -below;
    sides.planes[2] = through_eye(below);
  }
  return sides;
}

}  // namespace stylet::render
