#include "engine/app/stylus.h"

#include "engine/app/hid_device.h"
#include "engine/files/error.h"
#include "engine/files/json_reader.h"
#include "engine/link/link_stylus.h"
#include "engine/session/recorded_stylus.h"
#include "haptic/hand_device.h"
#include "haptic/mouse_device.h"
#include "haptic/scripted_device.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>
#include <utility>

namespace stylet::app {

namespace {

using haptic::hid::ReportLog;

/// Where a needle without a recorded motion starts: the scenario's own first pose, aimed at its target.
struct Approach {
  Eigen::Vector3d entry;  ///< where the tip waits
  Eigen::Vector3d target;
  physics::StylusPose hub;  ///< the first pose
  Eigen::Vector3d right() const { return hub.orientation * Eigen::Vector3d::UnitX(); }
};
Approach approach(const content::Scene& scene) {
  if (scene.targets.empty() || scene.motion.stylus.empty()) {
    throw files::ContentError(fmt::format("{}: has no target or no motion to start from; use --device recorded:FILE",
                                          scene.scenario.string()));
  }
  const physics::StylusPose& hub = scene.motion.stylus.front().pose;
  return {.entry = hub.position + hub.orientation * Eigen::Vector3d(0, 0, scene.needle.length),
          .target = scene.targets.front().centre,
          .hub = hub};
}

Stylus play(const content::Motion& motion, std::string name) {
  auto device = std::make_unique<haptic::RecordedDevice>(session::recorded_stylus(motion, std::move(name)));
  const double end_s = device->end_s();
  return {.device = std::move(device), .duration_s = end_s};
}

Stylus open_recorded(const content::Scene& scene, const std::string&, ReportLog*) {
  if (scene.motion.stylus.empty()) {
    throw files::ContentError(fmt::format("{}: names no motion; say --device recorded:FILE, scripted, mouse or hid",
                                          scene.scenario.string()));
  }
  Stylus stylus = play(scene.motion, "recorded stylus");
  stylus.own_motion = true;
  return stylus;
}

Stylus open_recorded_file(const content::Scene& scene, const std::string& file, ReportLog*) {
  readers::RawReports raw;
  content::Motion motion = readers::read_motion(file, &raw);
  if (raw.frame != readers::MotionFrame::kPatient) {
    const Approach way = approach(scene);
    place_hand(motion, raw.frame, scene, way.entry, way.target);
  }
  return play(motion, "recorded stylus (" + file + ")");
}

Stylus open_scripted(const content::Scene& scene, const std::string&, ReportLog*) {
  const Approach way = approach(scene);
  auto device = std::make_unique<haptic::ScriptedDevice>(haptic::ScriptedMotion{
      .entry = way.entry, .target = way.target, .bevel = way.right(), .needle_length = scene.needle.length});
  const double duration_s = device->duration_s();
  return {.device = std::move(device), .duration_s = duration_s};
}

Stylus open_mouse(const content::Scene& scene, const std::string&, ReportLog*) {
  const Approach way = approach(scene);
  auto device = std::make_unique<haptic::MouseDevice>(haptic::MouseWorkspace{.entry = way.entry,
                                                                             .axis = way.target - way.entry,
                                                                             .right = way.right(),
                                                                             .needle_length = scene.needle.length});
  haptic::MouseDevice* mouse = device.get();
  return {.device = std::move(device), .input = {.mouse = mouse}};
}

Stylus open_hand(const content::Scene& scene, const std::string&, ReportLog*) {
  const physics::StylusPose hub = approach(scene).hub;
  auto device = std::make_unique<haptic::HandDevice>(
      haptic::HandSettings{.start = hub.position, .start_orientation = hub.orientation});
  haptic::HandDevice* hand = device.get();
  return {.device = std::move(device), .input = {.hand = hand}};
}

Stylus open_tracked(const content::Scene& scene, const std::string&, ReportLog*) {
  const physics::StylusPose hub = approach(scene).hub;
  auto device = std::make_unique<link::LinkStylus>(
      physics::RigidPose{.position = hub.position, .orientation = hub.orientation});
  link::LinkStylus* tracked = device.get();
  return {.device = std::move(device), .input = {.tracked = tracked}};
}

Stylus open_hid(const content::Scene& scene, const std::string& id, ReportLog* log) {
  const Approach way = approach(scene);
  auto device = open_hid_stylus(parse_hid_id(id, "--device hid:" + id), scene, way.entry, way.target, log);
  readers::RawReports reports{.device = device->name(), .report_descriptor = device->report_descriptor()};
  return {.device = std::move(device), .hid = std::move(reports)};
}

constexpr std::array kStyluses{
    StylusKind{.name = "hid",
               .argument = "",
               .help = "the HID device that can do most",
               .held = true,
               .in_real_time_only = true,
               .open = open_hid},
    StylusKind{.name = "hid",
               .argument = "VID:PID",
               .help = "`stylet devices` lists them",
               .held = true,
               .in_real_time_only = true,
               .open = open_hid},
    StylusKind{.name = "mouse",
               .argument = "",
               .help = "and keyboard",
               .held = true,
               .need = StylusNeed::window,
               .open = open_mouse},
    StylusKind{.name = "hand",
               .argument = "",
               .help = "the headset's right controller",
               .held = true,
               .need = StylusNeed::headset,
               .open = open_hand},
    StylusKind{.name = "link",
               .argument = "",
               .help = "NeedleToReference of --link or --link-from",
               .held = true,
               .need = StylusNeed::link,
               .open = open_tracked},
    StylusKind{.name = "recorded", .argument = "", .help = "the scenario's own motion", .open = open_recorded},
    StylusKind{.name = "recorded", .argument = "FILE", .help = "a motion file", .open = open_recorded_file},
    StylusKind{.name = "scripted", .argument = "", .help = "in, partly out and in again", .open = open_scripted},
};

/// "hid:VID:PID"
std::string form(const StylusKind& kind) {
  return *kind.argument == '\0' ? kind.name : fmt::format("{}:{}", kind.name, kind.argument);
}

/// "a, b or c"
template <typename Words>
std::string listed(const char* last, const Words& words) {
  std::string text;
  for (std::size_t i = 0; i < kStyluses.size(); ++i) {
    text += i == 0 ? "" : i + 1 < kStyluses.size() ? ", " : fmt::format(" {} ", last);
    text += words(kStyluses[i]);
  }
  return text;
}

[[noreturn]] void throw_unknown(const std::string& description, const std::string& name) {
  std::set<std::string> names;
  for (const StylusKind& kind : kStyluses) names.insert(kind.name);
  const std::string close = files::nearest(name, names);
  throw files::ContentError(fmt::format("--device {}: there is {}{}", description, listed("and", form),
                                        close.empty() ? "" : fmt::format("; did you mean \"{}\"?", close)));
}

}  // namespace

std::span<const StylusKind> stylus_kinds() {
  return kStyluses;
}

std::string stylus_help() {
  return listed("or", [](const StylusKind& kind) { return fmt::format("{} ({})", form(kind), kind.help); });
}

Stylus open_stylus(const std::string& description, const content::Scene& scene, ReportLog* log) {
  const std::string asked = description.empty() ? "recorded" : description;
  const std::size_t colon = asked.find(':');
  const bool argued = colon != std::string::npos;
  const std::string name = asked.substr(0, colon);
  const std::string argument = argued ? asked.substr(colon + 1) : "";
  const auto kind = std::ranges::find_if(
      kStyluses, [&](const StylusKind& k) { return k.name == name && (*k.argument != '\0') == argued; });
  if (kind == kStyluses.end() || (argued && argument.empty())) throw_unknown(asked, name);
  Stylus stylus = kind->open(scene, argument, log);
  stylus.kind = &*kind;
  return stylus;
}

}  // namespace stylet::app
