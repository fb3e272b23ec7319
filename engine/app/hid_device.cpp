#include "engine/app/hid_device.h"

#include "engine/files/error.h"
#include "engine/readers/device_profile_file.h"
#include "engine/session/motion_of_recording.h"
#include "haptic/haply/haply_transport.h"
#include "haptic/host/host_transport.h"
#include "physics/messages/messages.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <numbers>
#include <optional>
#include <set>
#include <utility>
#include <vector>

namespace stylet::app {
namespace {

using haptic::hid::DeviceKind;
using haptic::hid::DeviceProfile;
using haptic::hid::HidDeviceSummary;

std::optional<std::uint16_t> hexadecimal(const std::string& text) {
  std::uint16_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  if (text.empty() || error != std::errc{} || end != text.data() + text.size()) return {};
  return value;
}

/// "VID:PID".
std::optional<HidChoice> id_of(const std::string& text) {
  const std::size_t colon = text.find(':');
  if (colon == std::string::npos) return {};
  const auto vendor = hexadecimal(text.substr(0, colon));
  const auto product = hexadecimal(text.substr(colon + 1));
  if (!vendor || !product || *vendor == 0) return {};
  return HidChoice{*vendor, *product};
}

/// What can do more comes first.
int rank(DeviceKind kind, bool force) {
  switch (kind) {
    case DeviceKind::kStylus:
      return force ? 5 : 4;
    case DeviceKind::kSpaceMouse:
      return 3;
    case DeviceKind::kPen:
      return 2;
    case DeviceKind::kJoystick:
      return 1;
    case DeviceKind::kUnusable:
      break;
  }
  return 0;
}

struct Candidate {
  HidDeviceSummary device;
  DeviceProfile profile;
  DeviceKind kind = DeviceKind::kUnusable;
  int rank = 0;
  bool lets_go = true;  ///< of the force, when the host dies
  std::string reason;   ///< why it cannot be used
};

Candidate candidate(const HidDeviceSummary& device, const haptic::hid::DeviceSource& source,
                    const std::vector<DeviceProfile>& profiles) {
  Candidate found{.device = device, .profile = {}};
  try {
    const auto described = haptic::hid::parse_report_descriptor(source.descriptor(device.path));
    found.profile = readers::choose_profile(profiles, {device.vendor_id, device.product_id, device.product},
                                            haptic::hid::kind_of(described));
    const auto descriptor = haptic::hid::with_vendor_reports(described, found.profile);
    const haptic::hid::StylusMap map(descriptor, found.profile);
    const haptic::hid::ForceOutput output(descriptor, found.profile);
    found.kind = map.kind();
    found.rank = rank(map.kind(), output.way() != haptic::hid::ForceOutput::Way::kNone);
    found.lets_go = output.lets_go();
    found.reason = map.reason();
  } catch (const std::exception& error) {
    found.reason = error.what();
  }
  return found;
}

/// Whether it is the one at `taken`: of the pairs of an arm and a grip, ARM/GRIP, those of one arm are.
bool is_taken(const HidChoice& choice, const std::string& path) {
  if (choice.taken.empty() || choice.source == &haptic::hid::hid_source()) return path == choice.taken;
  const auto arm_of = [](const std::string& pair) { return pair.substr(0, pair.find('/')); };
  return arm_of(path) == arm_of(choice.taken);
}

/// Device frame (X right, Y up, Z towards the user) in the patient's.
Eigen::Quaterniond patient_from_hand(const content::Scene& scene) {
  const Eigen::Vector3d up = scene.room_from_patient.linear().transpose() * Eigen::Vector3d::UnitY();
  Eigen::Vector3d right = (scene.camera.look_at - scene.camera.eye).cross(scene.camera.up);
  right -= right.dot(up) * up;
  if (!(right.norm() > 1e-9)) right = up.unitOrthogonal();
  right.normalize();
  Eigen::Matrix3d axes;
  axes << right, up, right.cross(up);
  return Eigen::Quaterniond(axes);
}

/// Of a pen the Z axis goes along the needle.
Eigen::Quaterniond patient_from_tablet(const Eigen::Quaterniond& patient_from_needle, const content::Scene& scene) {
  const Eigen::Vector3d axis = patient_from_needle * Eigen::Vector3d::UnitZ();
  Eigen::Vector3d right = (scene.camera.look_at - scene.camera.eye).cross(scene.camera.up);
  right -= right.dot(axis) * axis;
  if (!(right.norm() > 1e-9)) right = axis.unitOrthogonal();
  right.normalize();
  Eigen::Matrix3d axes;
  axes << right, axis.cross(right), axis;
  return Eigen::Quaterniond(axes);
}

/// Of the needle that waits at `entry`: where the session begins.
haptic::Workspace workspace_of(const content::Scene& scene, const Eigen::Vector3d& entry,
                               const Eigen::Vector3d& target, bool tablet) {
  const Eigen::Vector3d axis = (target - entry).normalized();
  const Eigen::Quaterniond first = scene.motion.stylus.front().pose.orientation;
  haptic::Workspace workspace{.start = entry - scene.needle.length * axis};
  workspace.start_orientation =
      (physics::rotation_between(first * Eigen::Vector3d::UnitZ(), axis) * first).normalized();
  workspace.patient_from_device =
      tablet ? patient_from_tablet(workspace.start_orientation, scene) : patient_from_hand(scene);
  return workspace;
}

constexpr int kProbePriority = 79;  // below the haptic thread: the needle comes first
constexpr std::array kSources{
    NamedSource{.name = "haply",
                .source = []() -> const haptic::hid::DeviceSource& { return haptic::haply::haply_source(); }},
    NamedSource{
        .name = "force_dimension",
        .source = []() -> const haptic::hid::DeviceSource& { return haptic::host::force_dimension_source(); }},
    NamedSource{.name = "openhaptics",
                .source = []() -> const haptic::hid::DeviceSource& { return haptic::host::openhaptics_source(); }},
};

/// As the user writes it.
std::string asked_for(const HidChoice& choice) {
  if (!choice.path.empty()) return "--device " + choice.path;
  for (const NamedSource& named : kSources) {
    if (choice.source == &named.source()) return fmt::format("--device {}", named.name);
  }
  return choice.vendor_id == 0 ? "--device hid"
                               : fmt::format("--device hid:{:04x}:{:04x}", choice.vendor_id, choice.product_id);
}

}  // namespace

std::span<const NamedSource> named_sources() {
  return kSources;
}

HidChoice choice_of_source(const std::string& name, const std::string& id) {
  const auto named = std::ranges::find_if(kSources, [&](const NamedSource& source) { return name == source.name; });
  if (named == kSources.end()) throw files::ContentError(name + ": there is no such kind of device");
  return {.source = &named->source(), .path = id.empty() ? "" : fmt::format("{}:{}", name, id)};
}

HidChoice parse_device(const std::string& text) {
  const std::size_t colon = text.find(':');
  const std::string name = text.substr(0, colon);
  if (std::ranges::none_of(kSources, [&](const NamedSource& source) { return name == source.name; })) {
    return parse_hid_id(text, text);
  }
  return choice_of_source(name, colon == std::string::npos ? "" : text.substr(colon + 1));
}

HidChoice parse_hid_id(const std::string& id, const std::string& asked) {
  if (id.empty()) return {};
  if (const auto choice = id_of(id)) return *choice;
  throw files::ContentError(asked + ": is not VID:PID in hexadecimal; write such as 256f:c635");
}

readers::CalibratedDevice identity_of(const HidDeviceSummary& device) {
  return {device.vendor_id, device.product_id, device.serial_number, device.product};
}

HidDevice choose_uncalibrated(const HidChoice& choice, const std::string& asked) {
  const std::vector<DeviceProfile> profiles = readers::load_device_profiles();
  Candidate best;
  std::string reasons;
  std::set<std::string> seen;  // hidapi lists a device once for each of its usages
  for (const HidDeviceSummary& device : choice.source->list()) {
    const bool meant =
        choice.vendor_id == 0 || (device.vendor_id == choice.vendor_id && device.product_id == choice.product_id);
    if (is_taken(choice, device.path)) {
      reasons += fmt::format("; {}: leads the needle", device.path);
      continue;
    }
    if (!meant || !device.path.starts_with(choice.path) || !seen.insert(device.path).second) continue;
    const Candidate found = candidate(device, *choice.source, profiles);
    // Those of other sources were named already.
    const bool named = choice.vendor_id != 0 || choice.source != &haptic::hid::hid_source();
    if (found.rank > 0 && !found.lets_go && !named) {
      reasons += fmt::format(
          "; {} {}: its force would stay on if the computer stopped; {:04x}:{:04x} by name uses it all "
          "the same",
          device.path, device.product, device.vendor_id, device.product_id);
      continue;
    }
    if (found.rank == 0) reasons += fmt::format("; {} {}: {}", device.path, device.product, found.reason);
    if (found.rank > best.rank) best = found;
  }
  if (best.rank > 0) {
    return {.summary = best.device,
            .profile = best.profile,
            .kind = best.kind,
            .calibration = {},
            .source = choice.source};
  }
  if (seen.empty() && reasons.empty()) {
    throw files::ContentError(asked + ": " + choice.source->missing());
  }
  throw files::ContentError(
      fmt::format("{}: nothing that can lead a needle; see `stylet devices`{}", asked, reasons));
}

HidDevice choose_hid_device(const HidChoice& choice, const std::string& asked) {
  HidDevice device = choose_uncalibrated(choice, asked);
  if (const auto calibration = readers::load_calibration(identity_of(device.summary))) {
    device.calibration = *calibration;
    device.profile = haptic::hid::calibrated(device.profile, *calibration);
  }
  return device;
}

DeviceKind connected_kind() {
  try {
    return choose_uncalibrated({}, {}).kind;
  } catch (const files::ContentError&) {
    return DeviceKind::kUnusable;
  }
}

Eigen::Quaterniond turn_on_the_desk(const HidDevice& device) {
  const Eigen::Quaterniond& turn = device.calibration.user_from_device;
  if (device.kind != DeviceKind::kPen) return turn;
  const Eigen::Quaterniond tablet_from_device(Eigen::AngleAxisd(-std::numbers::pi / 2, Eigen::Vector3d::UnitX()));
  return tablet_from_device * turn * tablet_from_device.conjugate();
}

OpenHidDevice::OpenHidDevice(const HidDevice& device)
    : descriptor(device.source->descriptor(device.summary.path)),
      map(haptic::hid::with_vendor_reports(haptic::hid::parse_report_descriptor(descriptor), device.profile),
          device.profile),
      transport(device.source->open(device.summary.path)) {}

std::unique_ptr<haptic::hid::HidStylus> open_hid_stylus(const HidChoice& choice, const content::Scene& scene,
                                                        const Eigen::Vector3d& entry, const Eigen::Vector3d& target,
                                                        haptic::hid::ReportLog* log) {
  const HidDevice chosen = choose_hid_device(choice, asked_for(choice));
  const bool tablet = chosen.kind == DeviceKind::kPen;
  haptic::hid::HidStylusSettings settings{
      .device = chosen.summary, .source = chosen.source, .profile = chosen.profile, .log = log};
  settings.workspace = workspace_of(scene, entry, target, tablet);
  settings.workspace.patient_from_device = settings.workspace.patient_from_device * turn_on_the_desk(chosen);
  settings.workspace.scale = chosen.calibration.scale;
  settings.workspace.rest = chosen.calibration.rest;
  return std::make_unique<haptic::hid::HidStylus>(settings);
}

std::unique_ptr<haptic::hid::HidStylus> open_hid_probe(const HidChoice& choice, const std::string& asked,
                                                       const content::Scene& scene) {
  const HidDevice chosen = choose_hid_device(choice, asked);
  if (chosen.kind != DeviceKind::kStylus && chosen.kind != DeviceKind::kSpaceMouse) {
    throw files::ContentError(fmt::format("{}: a {} cannot hold the probe; a stylus or a space mouse can", asked,
                                          haptic::hid::name_of(chosen.kind)));
  }
  return std::make_unique<haptic::hid::HidStylus>(haptic::hid::HidStylusSettings{
      .device = chosen.summary,
      .source = chosen.source,
      .profile = chosen.profile,
      .workspace = {.patient_from_device = patient_from_hand(scene) * turn_on_the_desk(chosen),
                    .scale = chosen.calibration.scale},
      .fifo_priority = chosen.kind == DeviceKind::kStylus ? kProbePriority : 0});
}

void place_hand(content::Motion& motion, readers::MotionFrame frame, const content::Scene& scene,
                const Eigen::Vector3d& entry, const Eigen::Vector3d& target) {
  if (frame == readers::MotionFrame::kPatient) return;
  const auto workspace = workspace_of(scene, entry, target, frame == readers::MotionFrame::kTablet);
  haptic::WorkspaceMap map(workspace);
  for (content::MotionSample& sample : motion.stylus) {
    map.follow(sample.pose.position, sample.pose.orientation);
    sample.pose = {map.position(), map.orientation()};
  }
}

void write_hand(const session::LiveSession& live, const recording::Recording& recording, readers::RawReports device,
                haptic::hid::ReportLog& log, const std::filesystem::path& file) {
  content::Motion motion = session::motion_of(recording);
  if (motion.stylus.size() < 2) {
    throw files::ContentError(fmt::format("{}: not written, the session was too short for a motion", file.string()));
  }
  for (haptic::hid::LoggedReport& report : log.take()) {
    const double time_s = live.time_of(report.arrived_ns);
    if (time_s >= 0) device.reports.push_back({.time_s = time_s, .bytes = std::move(report.bytes)});
  }
  readers::write_motion(motion, file.stem().string(), file, 9, device);
}

}  // namespace stylet::app
