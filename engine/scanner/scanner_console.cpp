#include "engine/scanner/scanner_console.h"

#include <numbers>
#include <utility>

namespace stylet::scanner {
namespace {

// Steps of one key press.
constexpr double kDepthStep = 0.010;       // m
constexpr double kGainStep = 2;            // dB
constexpr double kFocusStep = 0.010;       // m
constexpr double kFrequencyStep = 0.25e6;  // Hz
constexpr double kRangeStep = 5;           // dB
constexpr double kPersistenceStep = 0.1;
constexpr double kTgcStep = 2;        // dB
constexpr double kSlideStep = 0.002;  // m
constexpr double kPressStep = 0.001;
constexpr double kTurnStep = 2 * std::numbers::pi / 180;

// GLFW's codes of keys that are no characters.
constexpr int kRight = 262;
constexpr int kLeft = 263;
constexpr int kDown = 264;
constexpr int kUp = 265;
constexpr int kPageUp = 266;
constexpr int kPageDown = 267;
constexpr int kHome = 268;

}  // namespace

ScannerConsole::ScannerConsole(const content::Probe& probe)
    : probe_(probe), preset_(ultrasound::preset_from_name(probe.preset)) {
  controls_ = ultrasound::ScannerControls::of(probe, ultrasound::preset_settings(preset_, probe).persistence);
}

void ScannerConsole::set_preset(ultrasound::Preset preset) {
  preset_ = preset;
  controls_.persistence = ultrasound::preset_settings(preset, probe_).persistence;
}

void ScannerConsole::set_controls(const ultrasound::ScannerControls& controls) {
  controls_ = controls;
  limited_ = ultrasound::limit(controls_, probe_);
}

bool ScannerConsole::turn_knob(int key, double way) {
  if (key >= '1' && key < '1' + ultrasound::kTgcSliders) {
    slider_ = key - '1';
    controls_.tgc_db[static_cast<std::size_t>(slider_)] += way * kTgcStep;
    return true;
  }
  switch (key) {
    case 'D':
      controls_.depth += way * kDepthStep;
      return true;
    case 'G':
      controls_.gain_db += way * kGainStep;
      return true;
    case 'F':
      controls_.focus += way * kFocusStep;
      return true;
    case 'M':
      controls_.frequency_hz += way * kFrequencyStep;
      return true;
    case 'B':
      controls_.dynamic_range_db += way * kRangeStep;
      return true;
    case 'V':
      controls_.persistence += way * kPersistenceStep;
      return true;
    case '0':
      controls_.tgc_db = {};
      return true;
    default:
      return false;
  }
}

bool ScannerConsole::move_probe(int key, bool shift) {
  switch (key) {
    case kRight:
    case kLeft:
      (shift ? move_.rock : move_.lateral) += (key == kRight ? 1 : -1) * (shift ? kTurnStep : kSlideStep);
      return true;
    case kUp:
    case kDown:
      (shift ? move_.tilt : move_.elevation) += (key == kUp ? 1 : -1) * (shift ? kTurnStep : kSlideStep);
      return true;
    case kPageUp:
    case kPageDown:
      (shift ? move_.twist : move_.press) += (key == kPageDown ? 1 : -1) * (shift ? kTurnStep : kPressStep);
      return true;
    case kHome:
      move_ = {};
      release_ = true;
      return true;
    default:
      return false;
  }
}

void ScannerConsole::move_probe(const content::ProbeMove& by) {
  move_.lateral += by.lateral;
  move_.elevation += by.elevation;
  move_.press += by.press;
  move_.tilt += by.tilt;
  move_.rock += by.rock;
  move_.twist += by.twist;
}

bool ScannerConsole::press(int key, bool shift, bool repeated) {
  limited_.clear();
  if (move_probe(key, shift)) return true;
  if (turn_knob(key, shift ? -1 : 1)) {
    limited_ = ultrasound::limit(controls_, probe_);
    return true;
  }
  if (repeated) return false;
  switch (key) {
    case 'P':
      set_preset(preset_ == ultrasound::Preset::raw ? ultrasound::Preset::clinical : ultrasound::Preset::raw);
      return true;
    case 'C':
      *this = ScannerConsole(probe_);
      return true;
    case ' ':
      frozen_ = !frozen_;
      return true;
    case 'H':
      help_ = !help_;
      return true;
    default:
      return false;
  }
}

content::ProbeMove ScannerConsole::take_probe_move() {
  return std::exchange(move_, {});
}

bool ScannerConsole::take_probe_release() {
  return std::exchange(release_, false);
}

const std::vector<std::string>& ScannerConsole::help_lines() {
  static const std::vector<std::string> lines{
      "Scanner: with Shift the other way",
      "D  depth      G  gain      F  focus",
      "M  frequency  B  dynamic range  V  persistence",
      "1-8  TGC sliders, nearest first;  0  all level",
      "P  preset clinical / raw     C  knobs as at first",
      "Space  freeze",
      "Probe on the skin",
      "arrows  slide     Shift+arrows  rock, tilt",
      "Page Down, Up  press, lift;  with Shift  turn",
      "middle button  slide;  with Shift  rock, tilt",
      "Home  where the scenario holds it",
      "3-D view: right button, Ctrl+wheel, R",
      "H  this help     Q  end of the session",
  };
  return lines;
}

}  // namespace stylet::scanner
