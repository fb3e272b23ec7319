// The two ways a scanner is set up here: as a clinic sees it, and as a measurement wants it.
#pragma once

#include "engine/ultrasound/scan_model.h"

#include <cstdint>
#include <string>

namespace stylet::ultrasound {

enum class Preset : std::uint8_t {
  clinical,  ///< three looks, twice the probe's lines, haze, texture; frames persist by 0.3
  raw,       ///< one look, the probe's lines, nothing added: speckle as theory has it, every frame for itself
};

/// Settings of a preset; size of the picture, seed and noise are the defaults.
ImagerSettings preset_settings(Preset preset);
/// The same with the persistence that the probe's file may ask for; raw has none.
ImagerSettings preset_settings(Preset preset, const content::Probe& probe);

/// Of the preset that the probe's file names, without persistence: for pictures that stand for themselves.
ImagerSettings still_settings(const content::Probe& probe);

/// "clinical" or "raw".
const char* preset_name(Preset preset);
/// @throws files::ContentError  neither; names both
Preset preset_from_name(const std::string& name);

}  // namespace stylet::ultrasound
