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

/// Where a needle without a recorded motion starts. @throws files::ContentError  the scene does not say
session::StartPose start_in(const content::Scene& scene) {
  if (scene.targets.empty() || scene.motion.stylus.empty()) {
    throw files::ContentError(fmt::format("{}: has no target or no motion to start from; use --device recorded:FILE",
                                          scene.scenario.string()));
  }
  return session::start_of(scene);
}

/// The same for somebody who holds it.
session::StartPose start_of(const StylusOpening& opening) {
  return opening.start != nullptr ? *opening.start : start_in(opening.scene);
}

Eigen::Vector3d right_of(const session::StartPose& start) {
  return start.hub.orientation * Eigen::Vector3d::UnitX();
}

Stylus play(const content::Motion& motion, std::string name) {
  auto device = std::make_unique<haptic::RecordedDevice>(session::recorded_stylus(motion, std::move(name)));
  const double end_s = device->end_s();
  return {.device = std::move(device), .duration_s = end_s};
}

Stylus open_recorded(const StylusOpening& opening) {
  const content::Scene& scene = opening.scene;
  if (scene.motion.stylus.empty()) {
    throw files::ContentError(fmt::format("{}: names no motion; say --device recorded:FILE, scripted, mouse or hid",
                                          scene.scenario.string()));
  }
  Stylus stylus = play(scene.motion, "recorded stylus");
  stylus.own_motion = true;
  return stylus;
}

Stylus open_recorded_file(const StylusOpening& opening) {
  const content::Scene& scene = opening.scene;
  const std::string& file = opening.argument;
  readers::RawReports raw;
  content::Motion motion = readers::read_motion(file, &raw);
  if (raw.frame != readers::MotionFrame::kPatient) {
    const session::StartPose way = start_in(scene);
    place_hand(motion, raw.frame, scene, way.tip, way.aim);
  }
  return play(motion, "recorded stylus (" + file + ")");
}

Stylus open_scripted(const StylusOpening& opening) {
  const session::StartPose way = start_in(opening.scene);
  auto device = std::make_unique<haptic::ScriptedDevice>(haptic::ScriptedMotion{
      .entry = way.tip, .target = way.aim, .bevel = right_of(way), .needle_length = opening.scene.needle.length});
  const double duration_s = device->duration_s();
  return {.device = std::move(device), .duration_s = duration_s};
}

Stylus open_mouse(const StylusOpening& opening) {
  const session::StartPose way = start_of(opening);
  auto device =
      std::make_unique<haptic::MouseDevice>(haptic::MouseWorkspace{.entry = way.tip,
                                                                   .axis = way.aim - way.tip,
                                                                   .right = right_of(way),
                                                                   .needle_length = opening.scene.needle.length});
  haptic::MouseDevice* mouse = device.get();
  return {.device = std::move(device), .input = {.mouse = mouse}};
}

Stylus open_hand(const StylusOpening& opening) {
  const physics::StylusPose hub = start_of(opening).hub;
  auto device = std::make_unique<haptic::HandDevice>(
      haptic::HandSettings{.start = hub.position, .start_orientation = hub.orientation});
  haptic::HandDevice* hand = device.get();
  return {.device = std::move(device), .input = {.hand = hand}};
}

Stylus open_tracked(const StylusOpening& opening) {
  const physics::StylusPose hub = start_of(opening).hub;
  auto device = std::make_unique<link::LinkStylus>(
      physics::RigidPose{.position = hub.position, .orientation = hub.orientation});
  link::LinkStylus* tracked = device.get();
  return {.device = std::move(device), .input = {.tracked = tracked}};
}

Stylus open_reporting(const StylusOpening& opening, const HidChoice& choice) {
  const session::StartPose way = start_of(opening);
  auto device = open_hid_stylus(choice, opening.scene, way.tip, way.aim, opening.log);
  readers::RawReports reports{.device = device->name(), .report_descriptor = device->report_descriptor()};
  std::string warning;
  if (!device->lets_go()) {
    warning = device->name() +
              ": its force may stay on if this computer stops (nothing says that it drops it by itself); "
              "be ready to switch it off";
  }
  const int breath_button = device->free_button();
  std::string path = device->path();
  return {.device = std::move(device),
          .breath_button = breath_button,
          .hid = std::move(reports),
          .path = std::move(path),
          .warning = std::move(warning)};
}

Stylus open_hid(const StylusOpening& opening) {
  return open_reporting(opening, parse_hid_id(opening.argument, "--device hid:" + opening.argument));
}

constexpr char kHaply[] = "haply";
constexpr char kForceDimension[] = "force_dimension";
constexpr char kOpenHaptics[] = "openhaptics";

/// Of named_sources().
template <const char* name>
Stylus open_source(const StylusOpening& opening) {
  return open_reporting(opening, choice_of_source(name, opening.argument));
}

void find_recorded_file(const std::string& file) {
  readers::RawReports of_a_hand;  // whose poses may be in a frame of its own
  (void)readers::read_motion(file, &of_a_hand);
}

void find_hid(const std::string& id) {
  const std::string asked = id.empty() ? "--device hid" : "--device hid:" + id;
  (void)choose_hid_device(parse_hid_id(id, asked), asked);
}

template <const char* name>
void find_source(const std::string& id) {
  (void)choose_hid_device(choice_of_source(name, id),
                          id.empty() ? fmt::format("--device {}", name) : fmt::format("--device {}:{}", name, id));
}

/// The first of a source, or one by its id.
template <const char* device>
constexpr StylusKind of_source(const char* argument, const char* help) {
  return {.name = device,
          .argument = argument,
          .help = help,
          .held = true,
          .in_real_time_only = true,
          .open = open_source<device>,
          .find = find_source<device>};
}
constexpr const char* kListed = "`stylet devices` lists them";

constexpr std::array kStyluses{
    StylusKind{.name = "hid",
               .argument = "",
               .help = "the HID device that can do most",
               .held = true,
               .in_real_time_only = true,
               .open = open_hid,
               .find = find_hid},
    StylusKind{.name = "hid",
               .argument = "VID:PID",
               .help = kListed,
               .held = true,
               .in_real_time_only = true,
               .open = open_hid,
               .find = find_hid},
    of_source<kHaply>("", "a Haply Inverse3, through its maker's service"),
    of_source<kHaply>("ID", kListed),
    of_source<kForceDimension>("", "a Force Dimension device or a Falcon, by its maker's library"),
    of_source<kForceDimension>("ID", kListed),
    of_source<kOpenHaptics>("", "a Touch or another device of 3D Systems, by its maker's library"),
    of_source<kOpenHaptics>("ID", kListed),
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
    StylusKind{.name = "recorded",
               .argument = "FILE",
               .help = "a motion file",
               .open = open_recorded_file,
               .find = find_recorded_file},
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

struct AskedFor {
  const StylusKind& kind;
  std::string argument;
};

/// @throws files::ContentError  there is no such stylus
AskedFor asked_for(const std::string& description) {
  const std::string asked = description.empty() ? "recorded" : description;
  const std::size_t colon = asked.find(':');
  const bool argued = colon != std::string::npos;
  const std::string name = asked.substr(0, colon);
  const std::string argument = argued ? asked.substr(colon + 1) : "";
  const auto kind = std::ranges::find_if(
      kStyluses, [&](const StylusKind& k) { return k.name == name && (*k.argument != '\0') == argued; });
  if (kind == kStyluses.end() || (argued && argument.empty())) throw_unknown(asked, name);
  return {*kind, argument};
}

}  // namespace

std::span<const StylusKind> stylus_kinds() {
  return kStyluses;
}

std::string stylus_help() {
  return listed("or", [](const StylusKind& kind) { return fmt::format("{} ({})", form(kind), kind.help); });
}

std::string button_words(const Stylus& stylus) {
  return stylus.breath_button > 0 ? fmt::format("button {}", stylus.breath_button) : "";
}

const StylusKind& find_stylus(const std::string& description) {
  const AskedFor asked = asked_for(description);
  if (asked.kind.find != nullptr) asked.kind.find(asked.argument);
  return asked.kind;
}

Stylus open_stylus(const std::string& description, const content::Scene& scene, ReportLog* log,
                   const session::StartPose* start) {
  const AskedFor asked = asked_for(description);
  Stylus stylus = asked.kind.open({.scene = scene, .argument = asked.argument, .log = log, .start = start});
  stylus.kind = &asked.kind;
  return stylus;
}

}  // namespace stylet::app
