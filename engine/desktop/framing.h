// Where the camera of the 3-D view starts, so that no panel hides the needle. Pure.
#pragma once

#include "engine/content/scene.h"
#include "engine/desktop/layout.h"

#include <Eigen/Core>

#include <span>

namespace stylet::desktop {

/// A point in the window, pixels from its upper left corner. @param[out] depth  along the camera's axis, m
Eigen::Vector2d projected(const content::Camera& camera, const Eigen::Vector3d& point, int width, int height,
                          double* depth = nullptr);

/// `camera` moved aside, and back where that is not enough, as little as it takes for the needle and what the camera
/// looks at to lie beside the panels and inside the window; where nothing does it, what comes closest.
/// @param needle  points of it, patient frame, m
/// @param layout  of a window of that size, pixels
content::Camera framed(const content::Camera& camera, std::span<const Eigen::Vector3f> needle, const Layout& layout,
                       int width, int height);

}  // namespace stylet::desktop
