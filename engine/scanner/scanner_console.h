// The scanner's console: what its knobs stand at, and how commands turn them.
#pragma once

#include "engine/content/scene.h"
#include "engine/scanner/command.h"
#include "engine/ultrasound/presets.h"
#include "engine/ultrasound/scanner_controls.h"

#include <string>

namespace stylet::scanner {

/// No window, no GPU.
class ScannerConsole {
public:
  /// Knobs as the probe's file has them.
  explicit ScannerConsole(const content::Probe& probe);

  void apply(const Command& command);

  const content::Probe& probe() const { return probe_; }
  const ultrasound::ScannerControls& controls() const { return controls_; }
  ultrasound::Preset preset() const { return preset_; }
  bool frozen() const { return frozen_; }
  /// TGC slider that was moved last, -1: none yet.
  int slider() const { return slider_; }
  /// What the last command could not do: "depth limited to 300 mm"; empty: it did.
  const std::string& limited() const { return limited_; }

private:
  void set_preset(ultrasound::Preset preset);

  content::Probe probe_;
  ultrasound::ScannerControls controls_;
  ultrasound::Preset preset_;
  bool frozen_ = false;
  int slider_ = -1;
  std::string limited_;
};

}  // namespace stylet::scanner
