// The scene of a scenario, with what a user wants otherwise than its files have it.
#pragma once

#include "engine/app/observer.h"
#include "engine/content/scene.h"
#include "physics/loops/haptic_loop.h"

#include <optional>
#include <string>

namespace stylet::app {

/// The scene of a scenario named as a user does; its warnings are noted. @throws files::ContentError, Stopped
content::Scene load_scene(const std::string& name, Observer& observer);

/// Of the ultrasound machine; what is not set is as the probe's file has it.
struct ScannerSettings {
  std::string preset{};
  std::optional<double> depth_mm{};
  std::optional<double> gain_db{};
};
/// Sets up the probe of `scene`. @throws files::ContentError  out of the probe's limits, which the message names
void set_scanner(content::Scene& scene, const ScannerSettings& settings);

/// Instead of the scenario's. @throws files::ContentError  out of range, or no multiple of the simulation's rate
void set_haptic_rate(content::Scene& scene, double haptic_hz);

/// The coupling named, or the scenario's where none is. @throws files::ContentError
physics::Coupling chosen_coupling(const std::string& name, const content::Scene& scene);

}  // namespace stylet::app
