// What the quality control of ultrasound scanners measures, on arrays of numbers. It knows nothing of the simulator.
#pragma once

#include <Eigen/Core>

#include <span>

namespace stylet::reference {

/// An image, or a part of one: rows along the beam, columns across it.
using Patch = Eigen::Ref<const Eigen::MatrixXd, 0, Eigen::OuterStride<>>;

struct Moments {
  double mean = 0;
  double deviation = 0;  ///< of the population
};
Moments moments(std::span<const double> values);

/// How an envelope without coherent echoes is distributed (R. F. Wagner et al., IEEE Trans. Sonics Ultrason. 30,
/// 1983): Rayleigh's law, signal-to-noise ratio sqrt(pi / (4 - pi)) = 1.913, 5.57 dB deviation of its logarithm.
struct SpeckleStatistics {
  double signal_to_noise = 0;   ///< mean over deviation of the amplitude
  double log_deviation_db = 0;  ///< of 20 log10 amplitude
  double nakagami_m = 0;        ///< squared mean over variance of the intensity; 1: Rayleigh
};
/// @param amplitude  all positive
SpeckleStatistics speckle_statistics(std::span<const double> amplitude);

/// Signal-to-noise ratio of the root of a mean of `looks` independent intensities.
double rayleigh_signal_to_noise(double looks);

/// Distance of the distribution of amplitudes from Rayleigh's law with the same power: the statistic of Kolmogorov
/// and Smirnov, corrected for the number of samples and for the power being their own (M. A. Stephens, JASA 69, 1974,
/// the exponential law of the intensity with unknown mean). Above 1.094 in 5 %, above 1.308 in 1 % of all cases.
/// @param amplitude  independent of each other, at least 5
double rayleigh_distance(std::span<const double> amplitude);
inline constexpr double kRayleighDistanceOfOnePercent = 1.308;

/// Every row over its mean: what changes with depth alone is gone.
Eigen::MatrixXd without_depth_trend(const Patch& amplitude);

/// Full width at half maximum of the autocovariance of an intensity along an axis, in samples: for a Gaussian point
/// spread function that of its amplitude. NaN where it does not fall to a half within the patch.
enum class Axis { axial, lateral };
double speckle_width(const Patch& intensity, Axis axis);

/// y = level + slope x, least squares. At least two different x.
struct Line {
  double slope = 0;
  double level = 0;
};
Line fit_line(std::span<const double> x, std::span<const double> y);

double decibels(double power_ratio);

/// Mean power of `inside` over that of `outside`, dB.
double contrast_db(std::span<const double> inside, std::span<const double> outside);

/// Generalised contrast-to-noise ratio, 0..1: one minus the overlap of the two distributions of amplitude, by
/// histograms of 100 bins over all of them (A. Rodriguez-Molares et al., IEEE Trans. UFFC 67, 2020).
double generalised_contrast(std::span<const double> inside, std::span<const double> outside);

/// Centroid (x: column, y: row) of the power above that of half of the highest amplitude, in samples.
Eigen::Vector2d echo_centre(const Patch& amplitude);

/// Normalised correlation of two images of one size, about their means.
double correlation(const Patch& a, const Patch& b);

/// Where a window of one image is found in another.
struct Match {
  Eigen::Vector2d shift = Eigen::Vector2d::Zero();  ///< x: columns, y: rows; of the correlation's parabolic peak
  double correlation = 0;                           ///< normalised, with the second image interpolated there
};
/// Compares the window of `first` of (2 half.y + 1) rows and (2 half.x + 1) columns around `centre` with all of
/// `second` that are at most `reach` away.
/// @throws std::invalid_argument  a window would leave the image
Match track(const Patch& first, const Patch& second, const Eigen::Vector2i& centre, const Eigen::Vector2i& half,
            int reach);

}  // namespace stylet::reference
