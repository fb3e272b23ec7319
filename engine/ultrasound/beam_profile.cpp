#include "engine/ultrasound/beam_profile.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace stylet::ultrasound {
namespace {

const double kSigmaOfFwhm = 1.0 / (2.0 * std::sqrt(2.0 * std::log(2.0)));

/// Autocorrelation of the speckle field at a distance.
/// @param field_fwhm  of it
double speckle_correlation(double distance, double field_fwhm) {
  const double sigma = kSigmaOfFwhm * field_fwhm;
  return std::exp(-0.5 * distance * distance / (sigma * sigma));
}

/// The field is already correlated over its width. A Gaussian kernel of amplitude FWHM a gives white noise an
/// autocorrelation of FWHM a sqrt(2), and correlations of Gaussians add in quadrature; a kernel never gets narrower
/// than 60 % of the beam, since interfaces need it too.
double kernel_fwhm(double beam_fwhm, double field_fwhm) {
  const double quadrature = beam_fwhm * beam_fwhm - 0.5 * field_fwhm * field_fwhm;
  return std::sqrt(std::max(quadrature, 0.36 * beam_fwhm * beam_fwhm));
}

/// Standard deviations at which a Gaussian is taken to end (1.6 % of its peak): zero weights end the passes' loops.
constexpr double kCutOff = 2.9;

/// A Gaussian kernel over samples of the speckle field.
class Kernel {
public:
  /// @param taps  of one side, centre included
  Kernel(std::size_t taps, double fwhm, double pitch, double field_fwhm)
      : pitch_(pitch), field_fwhm_(field_fwhm), weights_(taps), products_(2 * taps - 1, 0.0) {
    const double sigma = kSigmaOfFwhm * fwhm;
    const int count = static_cast<int>(taps);
    for (int i = 0; i < count; ++i) {
      const double x = i * pitch / sigma;
      weights_[i] = x < kCutOff ? std::exp(-0.5 * x * x) : 0.0;
    }
    for (int i = 1 - count; i < count; ++i) {
      for (int j = i; j < count; ++j) products_[j - i] += weights_[std::abs(i)] * weights_[std::abs(j)];
    }
  }

  /// Covariance of the filtered field, of variance 1 before, with itself `lag` samples away.
  double covariance(int lag) const {
    double sum = products_[0] * speckle_correlation(lag * pitch_, field_fwhm_);
    for (int k = 1; k < static_cast<int>(products_.size()); ++k) {
      sum += products_[k] * (speckle_correlation((k - lag) * pitch_, field_fwhm_) +
                             speckle_correlation((k + lag) * pitch_, field_fwhm_));
    }
    return sum;
  }

  /// Such that a speckle field of variance 1 keeps variance 1.
  void write(std::span<float> weights) const {
    const double scale = 1 / std::sqrt(covariance(0));
    for (std::size_t i = 0; i < weights_.size(); ++i) weights[i] = static_cast<float>(weights_[i] * scale);
  }

private:
  double pitch_;
  double field_fwhm_;
  std::vector<double> weights_;
  std::vector<double> products_;  ///< sum of weights [i] * [i + k] over all taps of both sides
};

/// Weights at multiples of `pitch`, one side, that give the speckle the correlation which the beam would give it,
/// half a width away. Fitted, not computed as for kernel_fwhm(): where samples lie further apart than the field is
/// correlated over (192 lines), it adds less than in quadrature.
void fit(std::span<float> weights, double beam_fwhm, double pitch, double field_fwhm) {
  const int lag = std::max(1, static_cast<int>(std::lround(0.5 * beam_fwhm / pitch)));
  const double wanted = std::exp(-2 * std::log(2.0) * std::pow(lag * pitch / beam_fwhm, 2));
  double low = 0.6 * beam_fwhm, high = 1.6 * beam_fwhm;
  constexpr int kHalvings = 12;  // to a part in 4000
  for (int i = 0; i < kHalvings; ++i) {
    const double middle = 0.5 * (low + high);
    const Kernel kernel(weights.size(), middle, pitch, field_fwhm);
    (kernel.covariance(lag) < wanted * kernel.covariance(0) ? low : high) = middle;
  }
  Kernel(weights.size(), low, pitch, field_fwhm).write(weights);
}

}  // namespace

double axial_fwhm(double range, double wavelength) {
  return kAxialFwhm0 * wavelength / kReferenceWavelength + kAxialFwhmSlope * range;
}

double lateral_fwhm(double range, double wavelength, double focus, double f_number) {
  const double here = std::max<double>(f_number, (range + 0.004) / kMaxAperture);
  const double opening = f_number / kMinFNumber;
  const double defocus = (range - focus) / (kLateralFieldDepth * opening * opening);
  return kLateralLambdas * wavelength * here * std::sqrt(1 + kLateralDefocus * defocus * defocus);
}

double speckle_grain(const content::Probe& probe) {
  return kElevationFwhm / probe.elevation_width;
}

BeamProfile BeamProfile::of(const ScanGeometry& scan, const content::Probe& probe, double wavelength, double focus,
                            int planes) {
  BeamProfile beam;
  const double reach = kElevationReach * kSigmaOfFwhm * probe.elevation_width;
  const double grain = speckle_grain(probe);
  const double field = kSpeckleFwhm / grain;
  const double focal_spacing = std::min<double>(kElevationSpacing / grain, 2 * reach / std::max(planes - 1, 1));
  beam.lateral.resize(static_cast<std::size_t>(scan.samples) * kLateralTaps);
  beam.axial.resize(static_cast<std::size_t>(scan.samples) * kAxialTaps);
  beam.elevation.resize(static_cast<std::size_t>(scan.samples) * kElevationRow);
  for (int s = 0; s < scan.samples; ++s) {
    const double r = scan.range(s);
    const auto row = [s](std::vector<float>& table, int taps) {
      return std::span<float>(table).subspan(static_cast<std::size_t>(s) * taps, taps);
    };
    fit(row(beam.lateral, kLateralTaps), lateral_fwhm(r, wavelength, focus, probe.f_number), scan.lateral_pitch(r),
        field);
    fit(row(beam.axial, kAxialTaps), axial_fwhm(r, wavelength), scan.sample_pitch, field);
    const double width = elevation_fwhm(probe, r);
    const double spacing =
        std::min<double>(focal_spacing * width / probe.elevation_width, kMostElevationSpacing / grain);
    const std::span<float> planes_here = row(beam.elevation, kElevationRow);
    Kernel(static_cast<std::size_t>(planes / 2 + 1), kernel_fwhm(width, field), spacing, field)
        .write(planes_here.first(kElevationRow - 1));
    planes_here.back() = static_cast<float>(spacing);
  }
  return beam;
}

}  // namespace stylet::ultrasound
