#include "engine/desktop/needle_keys.h"

#include <numbers>

namespace stylet::desktop {
namespace {

constexpr double kMetresPerHeight = 0.10;  // the mouse across the window's height moves the needle so far
constexpr double kTiltPerHeight = 1.5;     // and tilts it so far
constexpr double kMetresPerNotch = 0.002;  // a notch of the wheel advances the needle so far

// Steps of one key press.
constexpr double kAdvanceStep = 0.002;  // m
constexpr double kFineStep = 0.0005;
constexpr double kMoveStep = 0.002;
constexpr double kTurnStep = 2 * std::numbers::pi / 180;
constexpr double kTwistStep = 15 * std::numbers::pi / 180;

}  // namespace

void lead_by_pointer(haptic::MouseDevice& needle, const view::Input& input) {
  if (input.shift) {
    needle.tilt(input.drag_x * kTiltPerHeight, -input.drag_y * kTiltPerHeight);
  } else {
    needle.move(input.drag_x * kMetresPerHeight, -input.drag_y * kMetresPerHeight);
  }
  needle.advance(input.advance * kMetresPerNotch);
}

bool lead_by_key(haptic::MouseDevice& needle, const view::Input::Stroke& stroke) {
  const auto sideways = [&](double right, double up) {
    if (stroke.shift) {
      needle.tilt(right * kTurnStep, up * kTurnStep);
    } else {
      needle.move(right * kMoveStep, up * kMoveStep);
    }
    return true;
  };
  const double advance = stroke.shift ? kFineStep : kAdvanceStep;
  switch (stroke.key) {
    case 'W':
      needle.advance(advance);
      return true;
    case 'S':
      needle.advance(-advance);
      return true;
    case 'I':
      return sideways(0, 1);
    case 'K':
      return sideways(0, -1);
    case 'J':
      return sideways(-1, 0);
    case 'L':
      return sideways(1, 0);
    case 'A':
      needle.twist(kTwistStep);
      return true;
    case 'E':
      needle.twist(-kTwistStep);
      return true;
    default:
      return false;
  }
}

const std::vector<std::string>& needle_help_lines() {
  static const std::vector<std::string> lines{
      "Needle",
      "W, S or wheel  in, out (Shift  by half millimetres)",
      "I J K L or left button  sideways; with Shift  tilt",
      "A, E  turn the bevel",
  };
  return lines;
}

}  // namespace stylet::desktop
