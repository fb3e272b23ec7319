// A camera turned round what it looks at.
#pragma once

#include "engine/content/scene.h"

#include <variant>

namespace stylet::view {

/// @param yaw    rad to the right about the camera's up
/// @param pitch  rad upwards; stops 5 degrees short of looking along `up`
/// @param zoom   factor on the distance; the distance stays within 5 cm ... 5 m
content::Camera orbited(const content::Camera& camera, double yaw, double pitch, double zoom = 1);

/// As orbited().
struct Orbit {
  double yaw = 0;
  double pitch = 0;
  double zoom = 1;
};
struct ResetCamera {};
using CameraCommand = std::variant<Orbit, ResetCamera>;

/// @param home  where a reset puts it
content::Camera after(const CameraCommand& command, const content::Camera& camera, const content::Camera& home);

}  // namespace stylet::view
