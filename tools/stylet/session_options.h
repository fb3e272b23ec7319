// What `train` and `render` have in common.
#pragma once

#include "engine/content/scene.h"
#include "haptic/device.h"
#include "physics/loops/haptic_loop.h"
#include "tools/stylet/progress.h"

#include <CLI/CLI.hpp>

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

namespace stylet::link {
class LinkStylus;
}  // namespace stylet::link

namespace stylet::haptic {
class HandDevice;
class MouseDevice;
namespace hid {
class HidStylus;
class ReportLog;
}  // namespace hid
}  // namespace stylet::haptic

namespace stylet::tools {

/// One line on stderr, "stylet: warning: file:place: what".
void print_warning(const std::string& warning);

/// The scene of a scenario named as a user does, with progress; prints its warnings.
content::Scene load_scene(const std::string& name, Progress& progress);

/// A stylus made from what was said with --device, and for how long it moves.
struct Stylus {
  std::unique_ptr<haptic::Device> device;
  double duration_s = 0;                  ///< infinite: as long as the user wants
  haptic::MouseDevice* mouse = nullptr;   ///< the device, where it is the mouse
  haptic::HandDevice* hand = nullptr;     ///< the device, where it is the hand in a headset
  haptic::hid::HidStylus* hid = nullptr;  ///< the device, where it is a HID device
  link::LinkStylus* link = nullptr;       ///< the device, where it is tracked elsewhere
  bool own_motion = false;                ///< it plays the scenario's motion
  /// By somebody who begins and ends the session; else it runs by itself.
  bool held() const { return mouse != nullptr || hand != nullptr || hid != nullptr || link != nullptr; }
};

/// @param description  "" or "recorded" (the scenario's motion), "recorded:FILE", "scripted", "mouse", "hand",
/// "link",
///                     "hid" or "hid:VID:PID"
/// @throws files::ContentError, haptic::hid::HidError
/// @param log  takes the raw reports of a HID device; outlives the stylus
Stylus make_stylus(const std::string& description, const content::Scene& scene,
                   haptic::hid::ReportLog* log = nullptr);

/// The coupling named, or the scenario's where none is. @throws files::ContentError
physics::Coupling chosen_coupling(const std::string& name, const content::Scene& scene);

/// What the command line says about the scanner; the rest is as the probe's file has it.
struct ScannerOptions {
  std::string preset;
  std::optional<double> depth_mm;
  std::optional<double> gain_db;
};
void add_scanner_options(CLI::App& command, ScannerOptions& options);
/// Sets up the probe of `scene`. @throws files::ContentError  out of the probe's limits, which the message names
void set_scanner(content::Scene& scene, const ScannerOptions& options);

/// Instead of the scenario's. @throws files::ContentError  out of range, or no multiple of the simulation's rate
void set_haptic_rate(content::Scene& scene, double haptic_hz);

inline constexpr const char* kDeviceHelp =
    "Stylus: hid or hid:VID:PID (`stylet devices` lists them), mouse (and keyboard), hand (the headset's right "
    "controller), link (NeedleToReference of --link or --link-from), recorded (the scenario's own motion), "
    "recorded:FILE (a motion file) or scripted; default: ";
inline constexpr const char* kCouplingHelp = "stylet, paper-updated or paper-frozen; default: the scenario's";

}  // namespace stylet::tools
