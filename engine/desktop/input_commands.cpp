#include "engine/desktop/input_commands.h"

#include "engine/desktop/key_table.h"

#include <cmath>

namespace stylet::desktop {
namespace {

// The mouse across the window's height.
constexpr double kNeedlePerHeight = 0.10;  // m
constexpr double kTiltPerHeight = 1.5;     // rad
constexpr double kSlidePerHeight = 0.1;    // m
constexpr double kTurnPerHeight = 1.0;     // rad
constexpr double kOrbitPerHeight = 3.0;    // rad

// A notch of the wheel.
constexpr double kAdvancePerNotch = 0.002;  // m
constexpr double kZoomPerNotch = 0.9;

haptic::NeedleMove needle_move(const view::Input& input) {
  haptic::NeedleMove move{.advance_m = input.advance * kAdvancePerNotch};
  if (input.shift) {
    move.tilt_right_rad = input.drag_x * kTiltPerHeight;
    move.tilt_up_rad = -input.drag_y * kTiltPerHeight;
  } else {
    move.right_m = input.drag_x * kNeedlePerHeight;
    move.up_m = -input.drag_y * kNeedlePerHeight;
  }
  return move;
}

content::ProbeMove probe_move(const view::Input& input) {
  return {.lateral = input.slide_x * kSlidePerHeight,
          .elevation = -input.slide_y * kSlidePerHeight,
          .tilt = -input.turn_y * kTurnPerHeight,
          .rock = input.turn_x * kTurnPerHeight};
}

}  // namespace

std::optional<Command> command_of(const view::Stroke& stroke) {
  for (const KeyLine& line : key_table()) {
    for (const KeyBinding& binding : line.keys) {
      if (binding.key != stroke.key) continue;
      if (stroke.repeated && !line.repeats) return std::nullopt;
      return stroke.shift && binding.with_shift ? binding.with_shift : binding.command;
    }
  }
  return std::nullopt;
}

std::vector<Command> commands_of(const view::Input& input) {
  std::vector<Command> commands;
  if (input.close) commands.emplace_back(EndSession{});
  if (input.drag_x != 0 || input.drag_y != 0 || input.advance != 0) commands.emplace_back(needle_move(input));
  if (input.orbit_x != 0 || input.orbit_y != 0 || input.zoom != 0) {
    commands.emplace_back(view::CameraCommand(view::Orbit{.yaw = input.orbit_x * kOrbitPerHeight,
                                                          .pitch = input.orbit_y * kOrbitPerHeight,
                                                          .zoom = std::pow(kZoomPerNotch, input.zoom)}));
  }
  for (const view::Stroke& stroke : input.strokes) {
    if (std::optional<Command> command = command_of(stroke)) commands.push_back(*std::move(command));
  }
  if (const content::ProbeMove move = probe_move(input); !(move == content::ProbeMove{})) {
    commands.emplace_back(session::ProbeCommand(move));
  }
  return commands;
}

}  // namespace stylet::desktop
