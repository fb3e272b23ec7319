// What can be asked of the scanner: by keys, a thumb stick, a panel, another program. SI units, as everywhere inside.
#pragma once

#include "engine/ultrasound/presets.h"

#include <cstdint>
#include <optional>
#include <variant>

namespace stylet::scanner {

// `relative`: the knob is turned by so much, else to it. Each stops at its limit.
struct SetDepth {
  double m = 0;
  bool relative = false;
};
struct SetGain {
  double db = 0;
  bool relative = false;
};
struct SetFocus {
  double m = 0;
  bool relative = false;
};
struct SetFrequency {
  double hz = 0;
  bool relative = false;
};
struct SetDynamicRange {
  double db = 0;
  bool relative = false;
};
struct SetPersistence {
  double share = 0;  ///< of the frame before
  bool relative = false;
};
struct SetTgc {
  int slider = 0;  ///< 0: the nearest
  double db = 0;
  bool relative = false;
};
struct LevelTgc {};
/// Nothing: the other one.
struct SetPreset {
  std::optional<ultrasound::Preset> to{};
};
/// Nothing: the other way than now.
struct Freeze {
  std::optional<bool> on{};
};
/// All as the probe's file has it, and live.
struct Reset {};

/// The pointer on the screen, whose left button sets the points of calipers.
struct Point {
  enum class Act : std::uint8_t { press, move, release };
  Act act = Act::move;
  double x = 0, y = 0;  ///< shares of the screen's width and height, from its upper left corner
};
struct RemoveMeasure {
  bool all = false;  ///< else the newest
};
/// The screen as it is, among the results of the session.
struct SaveImage {};

using Command = std::variant<SetDepth, SetGain, SetFocus, SetFrequency, SetDynamicRange, SetPersistence, SetTgc,
                             LevelTgc, SetPreset, Freeze, Reset, Point, RemoveMeasure, SaveImage>;

// How far a key press or a push of a thumb stick turns a knob.
inline constexpr double kDepthStep = 0.010;       // m
inline constexpr double kGainStep = 2;            // dB
inline constexpr double kFocusStep = 0.010;       // m
inline constexpr double kFrequencyStep = 0.25e6;  // Hz
inline constexpr double kDynamicRangeStep = 5;    // dB
inline constexpr double kPersistenceStep = 0.1;
inline constexpr double kTgcStep = 2;  // dB

}  // namespace stylet::scanner
