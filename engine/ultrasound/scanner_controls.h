// The knobs of an ultrasound scanner: what a sonographer sets while looking at the image.
#pragma once

#include "engine/content/scene.h"

#include <array>
#include <string>
#include <tuple>

namespace stylet::ultrasound {

inline constexpr int kTgcSliders = static_cast<int>(std::tuple_size_v<decltype(content::Probe::tgc_db)>);
inline constexpr double kMostPersistence = 0.95;

/// Gain, TGC, dynamic range and persistence act on the receiver alone; depth, frequency and focus on the beam.
struct ScannerControls {
  double depth = 0.160;         ///< m below the face
  double gain_db = 0;           ///< brightness of everything
  double frequency_hz = 3.5e6;  ///< within the probe's band
  double focus = 0.075;         ///< m: where the transmitted beam is narrowest, relative to its aperture
  double dynamic_range_db = 60;
  double persistence = 0;  ///< share of the frame before in what is shown
  /// Time-gain compensation: dB over the gain at the middle of each eighth of the depth, nearest first; linear
  /// between.
  std::array<double, kTgcSliders> tgc_db{};

  /// As the probe's file has them.
  static ScannerControls of(const content::Probe& probe, double persistence);
  bool operator==(const ScannerControls&) const = default;
};

/// What a control can be set to on a probe, both ends included. Same units as the control.
struct ControlLimits {
  struct Range {
    double min = 0, max = 0;
  };
  Range depth, gain_db, frequency_hz, focus, dynamic_range_db, persistence, tgc_db;

  static ControlLimits of(const content::Probe& probe);
};

/// Brings `controls` within the limits of `probe`; what is no number becomes the probe's own value.
/// @return  what was limited, to what: "depth limited to 300 mm"; empty: nothing
std::string limit(ScannerControls& controls, const content::Probe& probe);

/// dB that the sliders add. @param share  of the depth, 0 to 1
double slider_gain_db(const ScannerControls& controls, double share);

}  // namespace stylet::ultrasound
