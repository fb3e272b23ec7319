#include "engine/ultrasound/presets.h"

#include "engine/files/error.h"

#include <fmt/format.h>

namespace stylet::ultrasound {

ImagerSettings preset_settings(Preset preset) {
  if (preset == Preset::raw) return {.looks = 1, .line_oversampling = 1, .haze = false, .texture = false};
  return {.persistence = 0.3};
}

ImagerSettings preset_settings(Preset preset, const content::Probe& probe) {
  ImagerSettings settings = preset_settings(preset);
  if (preset == Preset::clinical) settings.persistence = probe.persistence.value_or(settings.persistence);
  return settings;
}

ImagerSettings still_settings(const content::Probe& probe) {
  ImagerSettings settings = preset_settings(preset_from_name(probe.preset));
  settings.persistence = 0;
  return settings;
}

const char* preset_name(Preset preset) {
  return preset == Preset::raw ? "raw" : "clinical";
}

Preset preset_from_name(const std::string& name) {
  for (const Preset preset : {Preset::clinical, Preset::raw}) {
    if (name == preset_name(preset)) return preset;
  }
  throw files::ContentError(fmt::format("ultrasound preset \"{}\": there is clinical and raw", name));
}

}  // namespace stylet::ultrasound
