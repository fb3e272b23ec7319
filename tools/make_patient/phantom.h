// A training phantom: a block of agar with balls in it.
#pragma once

#include "tools/make_patient/patient.h"

#include <vector>

namespace stylet::patient {

struct PhantomBall {
  const char* name;
  const char* tissue;
  Eigen::Vector3d centre;
  double radius;
};

/// Patient frame: the upper face is z = 0, the needle and the probe work in the plane y = 0.
std::vector<PhantomBall> phantom_balls();
std::vector<Organ> make_phantom();

}  // namespace stylet::patient
