// Mouse and keys move the needle as the screen shows it, wherever the camera is.
#pragma once

#include "engine/content/scene.h"
#include "haptic/mouse_device.h"

namespace stylet::desktop {

/// The move by which the needle goes on the screen where `asked` says: its right and up are the screen's, its tilts
/// the way of the hub there, rad. Where sideways motion is seen foreshortened it is faster, up to kFastest times;
/// where that is not enough, with the needle pointing along the drag, the needle goes along its axis, and a tilt is
/// slower. Twist and advance stay as they are. Pure.
/// @param motion  what moves do to the needle as it is held
haptic::NeedleMove as_on_screen(const haptic::NeedleMove& asked, const haptic::NeedleMotion& motion,
                                const content::Camera& camera);

/// Of sideways motion, times what was asked for: an engineering value.
inline constexpr double kFastest = 1.5;

}  // namespace stylet::desktop
