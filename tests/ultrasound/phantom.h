// Virtual test objects: scenes made of simple shapes, for tests that know what must be seen.
#pragma once

#include "engine/content/scene.h"
#include "engine/state/frame_state.h"
#include "tools/reference/ultrasound_phantom.h"

#include <functional>

namespace stylet::test {

/// Labels of the phantom's tissues.
enum PhantomTissue : std::uint8_t {
  kOutside,
  kBackground,  ///< liver-like: 0.5 dB/cm/MHz
  kFluid,       ///< no backscatter, 0.06 dB/cm/MHz
  kBone,
  kBright,  ///< background + 6 dB
  kDark,    ///< background - 8 dB
  kWall,    ///< fibrous: higher impedance and backscatter
  kMuscle,  ///< layered, with septa
  kFroth,   ///< gas bubbles
  kPhantomTissues,
};

/// A block 160 mm wide and deep and 60 mm thick under a probe at its top face, probe frame = patient frame: the face
/// at the origin, z into the block.
/// @param shape  label at a point (x, y, z), m; where it returns kOutside there is nothing
content::Scene block_phantom(const std::function<PhantomTissue(const Eigen::Vector3f&)>& shape);

using reference::at_rest;
using reference::make_deformable;
using reference::place_needle;

/// Everything at once: two tissues, a cyst, a walled vessel, a dark lesion, a bone rod, a needle.
content::Scene tour_phantom();
state::FrameState tour_state(const content::Scene& scene);

}  // namespace stylet::test
