// How thick the slice is that an ultrasound image shows.
#pragma once

#include "engine/content/scene.h"
#include "shaders/ultrasound_shared.h"

#include <cmath>

namespace stylet::ultrasound {

/// Distance from the elevation focus at which the slice is sqrt(2) times as thick, m. A Gaussian beam's grows with
/// its waist squared over the wavelength; of an abdominal array at 3.5 MHz it is kElevationFieldDepth.
inline double elevation_field_depth(const content::Probe& probe) {
  const double waist = probe.elevation_width / kElevationFwhm;
  return kElevationFieldDepth * waist * waist * probe.frequency_hz / 3.5e6;
}

/// Full width of the beam across the image plane at half maximum of the amplitude, m.
/// @param range  from the face, m
inline double elevation_fwhm(const content::Probe& probe, double range) {
  const double defocus = (range - probe.elevation_focus) / elevation_field_depth(probe);
  return probe.elevation_width * std::sqrt(1 + defocus * defocus);
}

}  // namespace stylet::ultrasound
