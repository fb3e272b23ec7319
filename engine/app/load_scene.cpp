#include "engine/app/load_scene.h"

#include "engine/files/error.h"
#include "engine/readers/scenario.h"
#include "engine/session/coupled_loops.h"
#include "engine/ultrasound/presets.h"
#include "engine/ultrasound/scanner_controls.h"

#include <fmt/format.h>

#include <vector>

namespace stylet::app {

content::Scene load_scene(const std::string& name, Observer& observer) {
  std::vector<std::string> warnings;
  content::Scene scene = readers::load_scene(
      readers::find_scenario(name),
      [&](const std::string& doing, double share) { show_progress(observer, doing, share); }, &warnings);
  observer.task_done();
  for (const std::string& warning : warnings) observer.note(Note::warning, warning);
  return scene;
}

void set_scanner(content::Scene& scene, const ScannerSettings& settings) {
  if (!settings.preset.empty()) {
    scene.probe.preset = ultrasound::preset_name(ultrasound::preset_from_name(settings.preset));
  }
  ultrasound::ScannerControls controls = ultrasound::ScannerControls::of(scene.probe, 0);
  if (settings.depth_mm) controls.depth = *settings.depth_mm * 1e-3;
  if (settings.gain_db) controls.gain_db = *settings.gain_db;
  if (const std::string limited = ultrasound::limit(controls, scene.probe); !limited.empty()) {
    throw files::ContentError(
        fmt::format("--us-...: beyond what the probe can do ({}); give a value within", limited));
  }
  scene.probe.depth = controls.depth;
  scene.probe.gain_db = controls.gain_db;
}

void set_haptic_rate(content::Scene& scene, double haptic_hz) {
  scene.rates.haptic_hz = haptic_hz;
  if (!(haptic_hz >= content::kMinHapticHz && haptic_hz <= content::kMaxHapticHz) || !scene.rates.in_lockstep()) {
    throw files::ContentError(
        fmt::format("haptic rate {:g}: say {:g} to {:g} Hz, a whole multiple of the simulation's {:g} Hz", haptic_hz,
                    content::kMinHapticHz, content::kMaxHapticHz, scene.rates.simulation_hz));
  }
}

physics::Coupling chosen_coupling(const std::string& name, const content::Scene& scene) {
  return session::coupling_from_name(name.empty() ? scene.coupling : name);
}

}  // namespace stylet::app
