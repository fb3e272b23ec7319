// A camera turned round what it looks at.
#pragma once

#include "engine/content/scene.h"

namespace stylet::view {

/// @param yaw    rad to the right about the camera's up
/// @param pitch  rad upwards; stops 5 degrees short of looking along `up`
/// @param zoom   factor on the distance; the distance stays within 5 cm ... 5 m
content::Camera orbited(const content::Camera& camera, double yaw, double pitch, double zoom = 1);

}  // namespace stylet::view
