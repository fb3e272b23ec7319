// Pulse and beam: the separable Gaussian point-spread function at every depth, as tables of weights.
//
// Convolving a complex Gaussian field with it gives speckle of the right size; normalising each table by the variance
// it gives that field (not by its own energy) keeps the speckle of a homogeneous medium at one level over all depths,
// so that what remains is attenuation.
#pragma once

#include "engine/ultrasound/scan_geometry.h"
#include "engine/ultrasound/slice_thickness.h"
#include "shaders/ultrasound_shared.h"

#include <vector>

namespace stylet::ultrasound {

static_assert(kElevationRow == kMaxPlanes / 2 + 2);
/// Wavelength at which the pulse has the length of kAxialFwhm0, m; it is as many cycles at any other.
inline constexpr double kReferenceWavelength = 1540 / 3.5e6;

/// Full widths at half maximum of the amplitude, m.
double axial_fwhm(double range, double wavelength = kReferenceWavelength);
/// @param focus  of the transmitted beam, m
/// @param f_number  least depth over width of the receiving aperture
double lateral_fwhm(double range, double wavelength, double focus = kLateralFocus, double f_number = kMinFNumber);
/// Times that the speckle of a probe is finer than kSpeckleFwhm: as its slice is thinner than kElevationFwhm, so that
/// as many sub-planes fill it.
double speckle_grain(const content::Probe& probe);
// elevation_fwhm(): slice_thickness.h

/// Weights of one side, centre first, by sample. A weight of zero ends the sum: none beyond it counts.
/// Across the slice the planes spread with the beam; the last of a row is their spacing, m.
struct BeamProfile {
  std::vector<float> lateral;    ///< [samples][kLateralTaps]    over lines
  std::vector<float> axial;      ///< [samples][kAxialTaps]      over samples
  std::vector<float> elevation;  ///< [samples][kElevationRow]   over sub-planes

  /// @param wavelength  m
  /// @param focus       m
  /// @param planes      sub-planes across the slice thickness: odd, at most kMaxPlanes
  static BeamProfile of(const ScanGeometry& scan, const content::Probe& probe, double wavelength, double focus,
                        int planes);
};

}  // namespace stylet::ultrasound
