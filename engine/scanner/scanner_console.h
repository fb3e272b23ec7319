// The scanner's keyboard: which key turns which knob, and what the knobs stand at.
#pragma once

#include "engine/content/probe_placement.h"
#include "engine/content/scene.h"
#include "engine/ultrasound/presets.h"
#include "engine/ultrasound/scanner_controls.h"

#include <string>
#include <vector>

namespace stylet::scanner {

/// What the keys of a window did to scanner and probe. No window, no GPU.
class ScannerConsole {
public:
  /// Knobs as the probe's file has them.
  explicit ScannerConsole(const content::Probe& probe);

  /// @param key       letters and digits as ASCII capitals, else a key code of GLFW
  /// @param repeated  by a key that is held: turns knobs further, switches nothing
  /// @return          whether the key means something here
  bool press(int key, bool shift, bool repeated = false);
  /// The mouse moved the probe.
  void move_probe(const content::ProbeMove& by);

  void set_preset(ultrasound::Preset preset);
  /// Turns all knobs at once, each within its limits.
  void set_controls(const ultrasound::ScannerControls& controls);

  const content::Probe& probe() const { return probe_; }
  const ultrasound::ScannerControls& controls() const { return controls_; }
  ultrasound::Preset preset() const { return preset_; }
  bool frozen() const { return frozen_; }
  bool help() const { return help_; }
  /// TGC slider that was moved last, -1: none yet.
  int slider() const { return slider_; }
  /// What the last key could not do: "depth limited to 300 mm"; empty: it did.
  const std::string& limited() const { return limited_; }
  /// What the keys moved the probe by since this was asked last.
  content::ProbeMove take_probe_move();
  /// Whether the probe was sent back to the scene's pose since this was asked last.
  bool take_probe_release();

  /// The keys and what they do, a line each.
  static const std::vector<std::string>& help_lines();

private:
  bool turn_knob(int key, double way);
  bool move_probe(int key, bool shift);

  content::Probe probe_;
  ultrasound::ScannerControls controls_;
  ultrasound::Preset preset_;
  bool frozen_ = false;
  bool help_ = false;
  int slider_ = -1;
  std::string limited_;
  content::ProbeMove move_;
  bool release_ = false;
};

}  // namespace stylet::scanner
