#include "engine/ultrasound/beam_profile.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace stylet::ultrasound {
namespace {

const double kSigmaOfFwhm = 1.0 / (2.0 * std::sqrt(2.0 * std::log(2.0)));

/// Autocorrelation of the speckle field at a distance.
double speckle_correlation(double distance) {
  const double sigma = kSigmaOfFwhm * double(kSpeckleFwhm);
  return std::exp(-0.5 * distance * distance / (sigma * sigma));
}

/// The field is already correlated over kSpeckleFwhm. A Gaussian kernel of amplitude FWHM a gives white noise an
/// autocorrelation of FWHM a sqrt(2), and correlations of Gaussians add in quadrature; a kernel never gets narrower
/// than 60 % of the beam, since interfaces need it too.
double kernel_fwhm(double beam_fwhm) {
  const double quadrature = beam_fwhm * beam_fwhm - 0.5 * double(kSpeckleFwhm) * double(kSpeckleFwhm);
  return std::sqrt(std::max(quadrature, 0.36 * beam_fwhm * beam_fwhm));
}

/// Standard deviations at which a Gaussian is taken to end (1.6 % of its peak): zero weights end the passes' loops.
constexpr double kCutOff = 2.9;

/// Gaussian weights at multiples of `pitch`, one side, such that a speckle field of variance 1 keeps variance 1.
void fill(std::span<float> weights, double fwhm, double pitch) {
  const double sigma = kSigmaOfFwhm * fwhm;
  const int taps = static_cast<int>(weights.size());
  std::vector<double> w(weights.size());
  for (int i = 0; i < taps; ++i) {
    const double x = i * pitch / sigma;
    w[i] = x < kCutOff ? std::exp(-0.5 * x * x) : 0.0;
  }
  double variance = 0;
  for (int i = 1 - taps; i < taps; ++i) {
    for (int j = 1 - taps; j < taps; ++j) {
      variance += w[std::abs(i)] * w[std::abs(j)] * speckle_correlation((i - j) * pitch);
    }
  }
  for (int i = 0; i < taps; ++i) weights[i] = static_cast<float>(w[i] / std::sqrt(variance));
}

}  // namespace

double axial_fwhm(double range, double wavelength) {
  return kAxialFwhm0 * wavelength / kReferenceWavelength + kAxialFwhmSlope * range;
}

double lateral_fwhm(double range, double wavelength, double focus) {
  const double f_number = std::max<double>(kMinFNumber, (range + 0.004) / kMaxAperture);
  const double defocus = (range - focus) / kLateralFieldDepth;
  return kLateralLambdas * wavelength * f_number * std::sqrt(1 + kLateralDefocus * defocus * defocus);
}

double elevation_fwhm(double range) {
  const double defocus = (range - kElevationFocus) / kElevationFieldDepth;
  return kElevationFwhm * std::sqrt(1 + defocus * defocus);
}

BeamProfile BeamProfile::of(const ScanGeometry& scan, double wavelength, double focus, int planes) {
  BeamProfile beam;
  const double reach = kElevationReach * kSigmaOfFwhm * double(kElevationFwhm);
  beam.plane_spacing = std::min<double>(kElevationSpacing, 2 * reach / std::max(planes - 1, 1));
  beam.lateral.resize(static_cast<std::size_t>(scan.samples) * kLateralTaps);
  beam.axial.resize(static_cast<std::size_t>(scan.samples) * kAxialTaps);
  beam.elevation.resize(static_cast<std::size_t>(scan.samples) * kElevationTaps);
  for (int s = 0; s < scan.samples; ++s) {
    const double r = scan.range(s);
    const auto row = [s](std::vector<float>& table, int taps) {
      return std::span<float>(table).subspan(static_cast<std::size_t>(s) * taps, taps);
    };
    fill(row(beam.lateral, kLateralTaps), kernel_fwhm(lateral_fwhm(r, wavelength, focus)), scan.lateral_pitch(r));
    fill(row(beam.axial, kAxialTaps), kernel_fwhm(axial_fwhm(r, wavelength)), scan.sample_pitch);
    fill(row(beam.elevation, kElevationTaps).first(static_cast<std::size_t>(planes / 2 + 1)),
         kernel_fwhm(elevation_fwhm(r)), beam.plane_spacing);
  }
  return beam;
}

}  // namespace stylet::ultrasound
