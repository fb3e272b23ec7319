// What a viscoelastic element remembers: the strains that its fading stresses have caught up with.
#pragma once

#include "physics/tissue/closest_rotation.h"

#include <array>

namespace stylet::physics {

/// Symmetric matrices of four points: xx, yy, zz, yz, xz, xy.
using LaneSymmetric = std::array<Lanes, 6>;

/// alpha_i of eq. 46 of an element's points, in the frame that turns with them.
struct StrainMemory {
  StrainMemory() {
    for (LaneSymmetric& term : alpha) term.fill(Lanes::Zero());
  }
  std::array<LaneSymmetric, 2> alpha;
};

}  // namespace stylet::physics
