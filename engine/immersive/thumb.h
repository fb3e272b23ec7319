// The thumb of a hand on its stick.
#pragma once

#include <Eigen/Core>

#include <cstdint>

namespace stylet::immersive {

enum class Push : std::uint8_t { none, up, down, right, left };

/// A stick that is held pushes again and again. Thread: the display's.
class Thumb {
public:
  /// With each frame: what it pushes now.
  /// @param stick   right and up, to 1
  /// @param time_s  of the display
  Push pushes(const Eigen::Vector2f& stick, double time_s);

private:
  Push held_ = Push::none;
  double next_s_ = 0;  ///< when it pushes again
};

}  // namespace stylet::immersive
