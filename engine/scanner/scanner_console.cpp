#include "engine/scanner/scanner_console.h"

#include <type_traits>

namespace stylet::scanner {
namespace {

void turn(double& knob, double value, bool relative) {
  knob = relative ? knob + value : value;
}

}  // namespace

ScannerConsole::ScannerConsole(const content::Probe& probe)
    : probe_(probe), preset_(ultrasound::preset_from_name(probe.preset)) {
  controls_ = ultrasound::ScannerControls::of(probe, ultrasound::preset_settings(preset_, probe).persistence);
}

void ScannerConsole::set_preset(ultrasound::Preset preset) {
  preset_ = preset;
  controls_.persistence = ultrasound::preset_settings(preset, probe_).persistence;
}

void ScannerConsole::apply(const Command& command) {
  std::visit(
      [this](const auto& c) {
        using C = std::decay_t<decltype(c)>;
        if constexpr (std::is_same_v<C, SetDepth>)
          turn(controls_.depth, c.m, c.relative);
        else if constexpr (std::is_same_v<C, SetGain>)
          turn(controls_.gain_db, c.db, c.relative);
        else if constexpr (std::is_same_v<C, SetFocus>)
          turn(controls_.focus, c.m, c.relative);
        else if constexpr (std::is_same_v<C, SetFrequency>)
          turn(controls_.frequency_hz, c.hz, c.relative);
        else if constexpr (std::is_same_v<C, SetDynamicRange>)
          turn(controls_.dynamic_range_db, c.db, c.relative);
        else if constexpr (std::is_same_v<C, SetPersistence>)
          turn(controls_.persistence, c.share, c.relative);
        else if constexpr (std::is_same_v<C, SetTgc>) {
          slider_ = c.slider;
          turn(controls_.tgc_db.at(c.slider), c.db, c.relative);
        } else if constexpr (std::is_same_v<C, LevelTgc>)
          controls_.tgc_db = {};
        else if constexpr (std::is_same_v<C, SetPreset>) {
          const bool raw = preset_ == ultrasound::Preset::raw;
          set_preset(c.to.value_or(raw ? ultrasound::Preset::clinical : ultrasound::Preset::raw));
        } else if constexpr (std::is_same_v<C, Freeze>)
          frozen_ = c.on.value_or(!frozen_);
        else if constexpr (std::is_same_v<C, Reset>)
          *this = ScannerConsole(probe_);
        else
          static_assert(std::is_same_v<C, Point> || std::is_same_v<C, RemoveMeasure> || std::is_same_v<C, SaveImage>,
                        "turns no knob");
      },
      command);
  limited_ = ultrasound::limit(controls_, probe_);
}

}  // namespace stylet::scanner
