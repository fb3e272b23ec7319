#include "tools/stylet/hid_device.h"

#include "engine/content/device_profile.h"
#include "engine/content/error.h"
#include "engine/content/motion.h"
#include "engine/session/motion_of_recording.h"

#include <fmt/format.h>

#include <charconv>
#include <set>
#include <utility>
#include <vector>

namespace stylet::tools {
namespace {

using haptic::hid::HidDeviceSummary;
using haptic::hid::DeviceKind;
using haptic::hid::DeviceProfile;

std::optional<std::uint16_t> hexadecimal(const std::string& text) {
  std::uint16_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value, 16);
  if (text.empty() || error != std::errc{} || end != text.data() + text.size()) return {};
  return value;
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
  std::string reason;  ///< why it cannot be used
};

Candidate candidate(const HidDeviceSummary& device, const std::vector<DeviceProfile>& profiles) {
  Candidate found{.device = device, .profile = {}};
  try {
    const auto described = haptic::hid::parse_report_descriptor(haptic::hid::report_descriptor(device.path));
    found.profile = content::choose_profile(profiles, {device.vendor_id, device.product_id, device.product},
                                            haptic::hid::kind_of(described));
    const auto descriptor = haptic::hid::with_vendor_reports(described, found.profile);
    const haptic::hid::StylusMap map(descriptor, found.profile);
    const haptic::hid::ForceOutput output(descriptor, found.profile);
    found.kind = map.kind();
    found.rank = rank(map.kind(), output.way() != haptic::hid::ForceOutput::Way::kNone);
    found.reason = map.reason();
  } catch (const std::exception& error) {
    found.reason = error.what();
  }
  return found;
}

Candidate choose(const HidChoice& choice) {
  const std::vector<DeviceProfile> profiles = content::load_device_profiles();
  Candidate best;
  std::string reasons;
  std::set<std::string> seen;  // hidapi lists a device once for each of its usages
  for (const HidDeviceSummary& device : haptic::hid::list_hid_devices()) {
    const bool meant =
        choice.vendor_id == 0 || (device.vendor_id == choice.vendor_id && device.product_id == choice.product_id);
    if (!meant || !seen.insert(device.path).second) continue;
    const Candidate found = candidate(device, profiles);
    if (found.rank == 0) reasons += fmt::format("; {} {}: {}", device.path, device.product, found.reason);
    if (found.rank > best.rank) best = found;
  }
  if (best.rank > 0) return best;
  const std::string what = choice.vendor_id == 0
                               ? "--device hid"
                               : fmt::format("--device hid:{:04x}:{:04x}", choice.vendor_id, choice.product_id);
  if (seen.empty()) {
    throw content::ContentError(what +
                                ": no such device is connected; plug it in, `stylet devices` lists what is there");
  }
  throw content::ContentError(
      fmt::format("{}: nothing that can lead a needle; see `stylet devices`{}", what, reasons));
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

}  // namespace

std::optional<HidChoice> hid_choice(const std::string& description) {
  if (description == "hid") return HidChoice{};
  if (!description.starts_with("hid:")) return {};
  const std::string rest = description.substr(4);
  const std::size_t colon = rest.find(':');
  const auto vendor = hexadecimal(rest.substr(0, colon));
  const auto product = colon == std::string::npos ? std::nullopt : hexadecimal(rest.substr(colon + 1));
  if (!vendor || !product || *vendor == 0) {
    throw content::ContentError(fmt::format(
        "--device {}: say hid or hid:VID:PID with hexadecimal numbers, such as hid:1209:0001", description));
  }
  return HidChoice{*vendor, *product};
}

std::unique_ptr<haptic::hid::HidStylus> open_hid_stylus(const HidChoice& choice, const content::Scene& scene,
                                                        const Eigen::Vector3d& entry, const Eigen::Vector3d& target,
                                                        haptic::hid::ReportLog* log) {
  const Candidate chosen = choose(choice);
  haptic::hid::HidStylusSettings settings{.device = chosen.device, .profile = chosen.profile, .log = log};
  const Eigen::Vector3d axis = (target - entry).normalized();
  const Eigen::Quaterniond first = scene.motion.stylus.front().pose.orientation;
  settings.workspace.start = entry - scene.needle.length * axis;
  settings.workspace.start_orientation =
      (Eigen::Quaterniond::FromTwoVectors(first * Eigen::Vector3d::UnitZ(), axis) * first).normalized();
  settings.workspace.patient_from_device = chosen.kind == DeviceKind::kPen
                                               ? patient_from_tablet(settings.workspace.start_orientation, scene)
                                               : patient_from_hand(scene);
  return std::make_unique<haptic::hid::HidStylus>(settings);
}

void StylusWatch::look() {
  if (stylus_ == nullptr || stylus_->connected() == connected_) return;
  connected_ = !connected_;
  fmt::print(stderr, "\nstylet: {}: {}\n", stylus_->name(),
             connected_ ? "back; the needle is taken up where it is"
                        : "gone; force off, the needle stays where it is; plug it in again");
}

void write_hand(const session::Recording& recording, const haptic::hid::HidStylus* stylus,
                haptic::hid::ReportLog& log, std::int64_t begin_ns, const std::filesystem::path& file) {
  content::Motion motion = session::motion_of(recording);
  if (motion.stylus.size() < 2) {
    throw content::ContentError(
        fmt::format("{}: not written, the session was too short for a motion", file.string()));
  }
  content::RawReports raw;
  if (stylus != nullptr) {
    raw.device = stylus->name();
    raw.report_descriptor = stylus->report_descriptor();
  }
  for (haptic::hid::LoggedReport& report : log.take()) {
    if (report.arrived_ns < begin_ns) continue;
    raw.reports.push_back(
        {.time_s = static_cast<double>(report.arrived_ns - begin_ns) * 1e-9, .bytes = std::move(report.bytes)});
  }
  content::write_motion(motion, file.stem().string(), file, 9, raw);
}

std::string hid_summary(const haptic::hid::HidStylus& stylus) {
  const haptic::hid::HidStylusCounters& c = stylus.counters();
  const auto& force = c.force;
  return fmt::format(
      "{}: {} reports, {} missing, {} discarded, {} gaps; {} forces written, {} superseded, {} failed; pose to force "
      "{:.0f} us median, {:.0f} us p99",
      stylus.name(), c.stream.reports.load(), c.stream.missing.load(), c.stream.discarded.load(),
      c.stream.gaps.load(), force.written.load(), force.superseded.load(), force.failed.load(),
      1e6 * force.pose_to_force.quantile(0.5), 1e6 * force.pose_to_force.quantile(0.99));
}

}  // namespace stylet::tools
