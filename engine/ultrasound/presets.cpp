#include "engine/ultrasound/presets.h"

#include "engine/content/error.h"

#include <fmt/format.h>

namespace stylet::ultrasound {

ImagerSettings preset_settings(Preset preset) {
  if (preset == Preset::raw) return {.looks = 1, .line_oversampling = 1, .haze = false, .texture = false};
  return {.persistence = 0.3};
}

const char* preset_name(Preset preset) {
  return preset == Preset::raw ? "raw" : "clinical";
}

Preset preset_from_name(const std::string& name) {
  for (const Preset preset : {Preset::clinical, Preset::raw}) {
    if (name == preset_name(preset)) return preset;
  }
  throw content::ContentError(fmt::format("ultrasound preset \"{}\": there is clinical and raw", name));
}

}  // namespace stylet::ultrasound
