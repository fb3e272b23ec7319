// The left thumb on the scanner's knobs: stick up and down turns the gain, right and left the depth; the trigger
// freezes the image.
#pragma once

#include "engine/headset/headset_controllers.h"
#include "engine/view/window.h"

#include <vector>

namespace stylet::immersive {

/// Thread: the display's.
class ThumbOnScanner {
public:
  /// With each frame: what a keyboard would have said to the scanner. A stick that is held turns further.
  /// @param time_s  of the display
  std::vector<view::Input::Stroke> strokes(const headset::Hands& hands, double time_s);

private:
  view::Input::Stroke held_;  ///< key 0: none
  double next_s_ = 0;         ///< when it repeats
};

}  // namespace stylet::immersive
