// What a viscoelastic element remembers: the strains that its fading stresses have caught up with.
#pragma once

#include "physics/tissue/closest_rotation.h"

#include <array>
#include <span>

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

/// A step of what relaxes, from what is remembered now: that stays, for the step may have to be taken again.
struct Relaxing {
  double dt = 0;                    ///< h of eq. 46, s
  std::span<StrainMemory> after{};  ///< [memory_count()] written where an element has a law; empty: nothing relaxes
};

}  // namespace stylet::physics
