// The thumb of the hand with the probe on the scanner's knobs: stick up and down turns the gain, right and left the
// depth; the trigger freezes the image.
#pragma once

#include "engine/headset/headset_controllers.h"
#include "engine/immersive/thumb.h"
#include "engine/scanner/command.h"

#include <vector>

namespace stylet::immersive {

/// Thread: the display's.
class ThumbOnScanner {
public:
  /// With each frame: what the thumb asks for. A stick that is held turns further.
  /// @param time_s  of the display
  std::vector<scanner::Command> commands(const headset::Hands& hands, double time_s);

private:
  Thumb thumb_;
};

}  // namespace stylet::immersive
