// How thick the slice is that an ultrasound image shows.
#pragma once

#include "shaders/ultrasound_shared.h"

#include <cmath>

namespace stylet::ultrasound {

/// Full width of the beam across the image plane at half maximum of the amplitude, m.
/// @param range  from the face, m
inline double elevation_fwhm(double range) {
  const double defocus = (range - kElevationFocus) / kElevationFieldDepth;
  return kElevationFwhm * std::sqrt(1 + defocus * defocus);
}

}  // namespace stylet::ultrasound
