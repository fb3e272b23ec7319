// An ultrasound image that a trainee keeps: the scanner's screen as it was, with its scales and measures.
#pragma once

#include <string>
#include <vector>

namespace stylet::scanner {

struct SavedImage {
  std::string png;                  ///< the file
  double time_s = 0;                ///< of the session, of what it shows
  double depth = 0;                 ///< m
  double metres_per_pixel = 0;      ///< of the body
  std::vector<double> distances{};  ///< measured on it, m
};

/// Those of a session, in order; they outlive a device that is lost. Their files come with its results.
using SavedImages = std::vector<SavedImage>;

/// More are not kept.
inline constexpr std::size_t kMostSavedImages = 99;

/// "ultrasound-01.png" of number 1.
std::string saved_image_name(std::size_t number);

}  // namespace stylet::scanner
