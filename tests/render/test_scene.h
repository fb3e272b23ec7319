// A small patient made of formulas: a lobed organ carried by a tetrahedral block, a vessel and a tumour inside, a
// cover of skin above, and a probe that looks at it. Tests of the 3-D view draw it.
#pragma once

#include "engine/content/scene.h"
#include "engine/state/frame_state.h"

namespace stylet::tests {

/// The organ's block is [-0.1, 0.1]^3 m, its organ centred at 0, camera in front (+Z) looking at it.
content::Scene make_test_scene();

/// The scene's rest state: nodes at rest, a straight needle from the upper right front whose tip is at the tumour.
state::FrameState rest_state(const content::Scene& scene);

/// Bends the tissue (a shear along x growing with y, and a sag) and the needle with it.
void deform(state::FrameState& state);

}  // namespace stylet::tests
