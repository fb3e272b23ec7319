#include "tools/stylet/session_options.h"

#include "engine/files/error.h"
#include "engine/link/link_stylus.h"
#include "engine/readers/motion.h"
#include "engine/readers/scenario.h"
#include "engine/session/coupled_loops.h"
#include "engine/session/recorded_stylus.h"
#include "engine/ultrasound/presets.h"
#include "engine/ultrasound/scanner_controls.h"
#include "haptic/hand_device.h"
#include "haptic/mouse_device.h"
#include "haptic/scripted_device.h"
#include "tools/stylet/hid_device.h"
#include "tools/stylet/interrupt.h"

#include <fmt/format.h>

#include <limits>
#include <utility>
#include <vector>

namespace stylet::tools {

namespace {

Stylus recorded(const content::Motion& motion, std::string name) {
  auto device = std::make_unique<haptic::RecordedDevice>(session::recorded_stylus(motion, std::move(name)));
  const double end_s = device->end_s();
  return {.device = std::move(device), .duration_s = end_s};
}

// Where a needle without a recorded motion starts: the scenario's own first pose, aimed at its target.
struct Approach {
  Eigen::Vector3d entry;  ///< where the tip waits
  Eigen::Vector3d target;
};
Approach approach(const content::Scene& scene) {
  if (scene.targets.empty() || scene.motion.stylus.empty()) {
    throw files::ContentError(fmt::format("{}: has no target or no motion to start from; use --device recorded:FILE",
                                          scene.scenario.string()));
  }
  const physics::StylusPose& hub = scene.motion.stylus.front().pose;
  return {.entry = hub.position + hub.orientation * Eigen::Vector3d(0, 0, scene.needle.length),
          .target = scene.targets.front().centre};
}

}  // namespace

void print_warning(const std::string& warning) {
  fmt::print(stderr, "stylet: warning: {}\n", warning);
}

content::Scene load_scene(const std::string& name, Progress& progress) {
  std::vector<std::string> warnings;
  content::Scene scene = readers::load_scene(
      readers::find_scenario(name),
      [&](const std::string& doing, double share) {
        throw_if_interrupted();
        progress.show(doing, share);
      },
      &warnings);
  progress.done();
  for (const std::string& warning : warnings) print_warning(warning);
  return scene;
}

Stylus make_stylus(const std::string& description, const content::Scene& scene, haptic::hid::ReportLog* log) {
  if (description.empty() || description == "recorded") {
    if (scene.motion.stylus.empty()) {
      throw files::ContentError(fmt::format("{}: names no motion; say --device recorded:FILE, scripted, mouse or hid",
                                            scene.scenario.string()));
    }
    Stylus stylus = recorded(scene.motion, "recorded stylus");
    stylus.own_motion = true;
    return stylus;
  }
  constexpr const char* kRecorded = "recorded:";
  if (description.starts_with(kRecorded)) {
    const std::string file = description.substr(std::char_traits<char>::length(kRecorded));
    readers::RawReports raw;
    content::Motion motion = readers::read_motion(file, &raw);
    if (raw.frame != readers::MotionFrame::kPatient) {
      const Approach way = approach(scene);
      place_hand(motion, raw.frame, scene, way.entry, way.target);
    }
    return recorded(motion, "recorded stylus (" + file + ")");
  }
  if (description == "scripted") {
    const Approach way = approach(scene);
    auto device = std::make_unique<haptic::ScriptedDevice>(
        haptic::ScriptedMotion{.entry = way.entry,
                               .target = way.target,
                               .bevel = scene.motion.stylus.front().pose.orientation * Eigen::Vector3d::UnitX(),
                               .needle_length = scene.needle.length});
    const double duration_s = device->duration_s();
    return {.device = std::move(device), .duration_s = duration_s};
  }
  if (description == "mouse") {
    const Approach way = approach(scene);
    auto device = std::make_unique<haptic::MouseDevice>(
        haptic::MouseWorkspace{.entry = way.entry,
                               .axis = way.target - way.entry,
                               .right = scene.motion.stylus.front().pose.orientation * Eigen::Vector3d::UnitX(),
                               .needle_length = scene.needle.length});
    haptic::MouseDevice* mouse = device.get();
    return {.device = std::move(device), .duration_s = std::numeric_limits<double>::infinity(), .mouse = mouse};
  }
  if (description == "hand") {
    approach(scene);  // says what the scenario lacks
    const physics::StylusPose& hub = scene.motion.stylus.front().pose;
    auto device = std::make_unique<haptic::HandDevice>(
        haptic::HandSettings{.start = hub.position, .start_orientation = hub.orientation});
    haptic::HandDevice* hand = device.get();
    return {.device = std::move(device), .duration_s = std::numeric_limits<double>::infinity(), .hand = hand};
  }
  if (description == "link") {
    (void)approach(scene);  // says what is missing
    const physics::StylusPose& hub = scene.motion.stylus.front().pose;
    auto device = std::make_unique<link::LinkStylus>(
        physics::RigidPose{.position = hub.position, .orientation = hub.orientation});
    link::LinkStylus* tracked = device.get();
    return {.device = std::move(device), .duration_s = std::numeric_limits<double>::infinity(), .link = tracked};
  }
  if (const std::optional<HidChoice> choice = hid_choice(description)) {
    const Approach way = approach(scene);
    std::unique_ptr<haptic::hid::HidStylus> device = open_hid_stylus(*choice, scene, way.entry, way.target, log);
    haptic::hid::HidStylus* hid = device.get();
    return {.device = std::move(device), .duration_s = std::numeric_limits<double>::infinity(), .hid = hid};
  }
  throw files::ContentError(
      fmt::format("--device {}: there is recorded, recorded:FILE, scripted, mouse, hand, link, hid and hid:VID:PID",
                  description));
}

void add_scanner_options(CLI::App& command, ScannerOptions& options) {
  command.add_option("--us-preset", options.preset,
                     "Ultrasound: clinical (compounded, textured) or raw (one look, nothing added); default: the "
                     "probe's");
  command.add_option("--us-depth-mm", options.depth_mm, "Depth of the ultrasound image; default: the probe's");
  command.add_option("--us-gain-db", options.gain_db, "Gain of the ultrasound image; default: the probe's");
}

void set_scanner(content::Scene& scene, const ScannerOptions& options) {
  if (!options.preset.empty()) {
    scene.probe.preset = ultrasound::preset_name(ultrasound::preset_from_name(options.preset));
  }
  ultrasound::ScannerControls controls = ultrasound::ScannerControls::of(scene.probe, 0);
  if (options.depth_mm) controls.depth = *options.depth_mm * 1e-3;
  if (options.gain_db) controls.gain_db = *options.gain_db;
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

}  // namespace stylet::tools
