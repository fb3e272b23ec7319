// What loops over elements share: scratch, and counts.
#pragma once

#include "physics/tissue/companion.h"

#include <Eigen/Core>

#include <vector>

namespace stylet::physics {

/// What a loop over the elements needs beside its result. One a thread.
struct ElementScratch {
  Companion* companion = nullptr;      ///< takes a part of the loop; the bits do not know of it
  std::vector<Eigen::Matrix3Xd> sums;  // [runs] forces of a run, and room for larger bodies': no fresh memory
};

struct ElementCount {
  int inverted = 0;  ///< as update_rotations()
  int squeezed = 0;  ///< as internal_forces()
};

}  // namespace stylet::physics
