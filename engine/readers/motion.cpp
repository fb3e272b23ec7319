#include "engine/readers/motion.h"

#include "engine/files/json_reader.h"
#include "engine/readers/motion_file.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <fstream>
#include <iterator>
#include <optional>
#include <utility>

namespace stylet::readers {
namespace {

namespace key = files::key;
using files::Key;
using nlohmann::json;

/// Row of a track: [t, px, py, pz, qw, qx, qy, qz] or the same with buttons.
constexpr std::size_t kPoseNumbers = 8;
constexpr std::string_view kFrames[] = {"patient", "hand", "tablet"};  // of MotionFrame
constexpr double kLongest = 24 * 3600;                                 ///< s
constexpr double kFarthest = 100;                                      ///< m
constexpr std::size_t kLongestReport = 16384;                          ///< bytes, and of a report descriptor

constexpr struct {
  Key stylus = key::rows("stylus", {kPoseNumbers, kPoseNumbers + 1}, {},
                         "poses of the needle's hub: [t, px, py, pz, qw, qx, qy, qz], s and m, with optional buttons "
                         "(bits; bit 0 is the trigger)")
                   .count({2, -1});
  Key probe = key::rows("probe", {kPoseNumbers, kPoseNumbers + 1}, {},
                        "the same of the probe's face; absent: it stays where the scenario puts it")
                  .optional();
  Key reports = key::rows("reports", {2, 2}, {},
                          "what the HID device sent: [t, \"bytes in hexadecimal\"], times not decreasing")
                    .optional()
                    .schema(R"({"items": {"items": null, "prefixItems":
                      [{"type": "number"}, {"type": "string", "pattern": "^([0-9a-fA-F]{2}){1,16384}$"}]}})");
} kTracks;

constexpr struct {
  Key name = key::text("name", "of the device");
  Key report_descriptor = key::text("report_descriptor", "in hexadecimal: what the reports mean");
} kRecordedDevice;

constexpr struct {
  Key name = key::note("name", "shown to the user");
  Key licence = key::kLicence;
  Key source = key::kSource;
  Key frame = key::choice(
                  "frame", [] { return files::Names(std::begin(kFrames), std::end(kFrames)); },
                  "of the stylus: patient, or how the hand went from where it began, which a session lays to its "
                  "patient: hand (right, up, near), tablet (right, near, along the needle)")
                  .otherwise(kFrames[0]);
  Key tracks = key::object("tracks", files::table_of<kTracks>,
                           "one track a device, times strictly increasing from 0 to 86400 s");
  Key device =
      key::object("device", files::table_of<kRecordedDevice>, "the HID device that made the reports").optional();
} kMotion;

/// Problems of one row; empty: none.
std::string check_row(const json& row, double previous, content::MotionSample& sample) {
  if (!row.is_array() || (row.size() != kPoseNumbers && row.size() != kPoseNumbers + 1)) {
    return "is not [t, px, py, pz, qw, qx, qy, qz] with optional buttons";
  }
  for (const json& value : row) {
    if (!value.is_number() || !std::isfinite(value.get<double>())) return "holds something that is no finite number";
  }
  const auto number = [&](std::size_t i) { return row[i].get<double>(); };
  sample.time_s = number(0);
  if (sample.time_s < 0 || sample.time_s > kLongest) {
    return fmt::format("time is {:g} s, accepted is 0 to {:g}", sample.time_s, kLongest);
  }
  if (!(sample.time_s > previous)) {
    return fmt::format("time {:g} s does not come after {:g} s; sort the samples by time", sample.time_s, previous);
  }
  sample.pose.position = {number(1), number(2), number(3)};
  if (sample.pose.position.cwiseAbs().maxCoeff() > kFarthest) {
    return fmt::format("position is farther than {:g} m; positions are metres in the patient frame", kFarthest);
  }
  const Eigen::Quaterniond q(number(4), number(5), number(6), number(7));
  if (std::abs(q.norm() - 1) > 1e-3)
    return fmt::format("quaternion has norm {:.4g}, expected 1 [w, x, y, z]", q.norm());
  sample.pose.orientation = q.normalized();
  sample.buttons = 0;
  if (row.size() > kPoseNumbers) {
    const double buttons = number(kPoseNumbers);
    if (buttons < 0 || buttons > 4294967295.0 || buttons != std::floor(buttons)) {
      return "buttons are not a whole number from 0 to 2^32 - 1";
    }
    sample.buttons = static_cast<std::uint32_t>(buttons);
  }
  return {};
}

std::vector<content::MotionSample> read_track(files::JsonFile& file, files::JsonObject& tracks, const Key& key) {
  std::vector<content::MotionSample> track;
  const json* rows = tracks.array(key);
  if (rows == nullptr) return track;
  if (rows->size() < static_cast<std::size_t>(key.items.min))
    tracks.problem(key, "has fewer than 2 samples; record a motion");
  double previous = -1;
  int bad = 0;
  for (std::size_t i = 0; i < rows->size() && bad < 10; ++i) {
    content::MotionSample sample;
    const std::string what = check_row((*rows)[i], previous, sample);
    if (!what.empty()) {
      file.add_problem(fmt::format("{}/{}/{}", tracks.pointer(), key.name, i), what);
      ++bad;
      continue;
    }
    previous = sample.time_s;
    track.push_back(sample);
  }
  return track;
}

/// Two hexadecimal digits a byte; nothing where it is not that.
std::optional<std::vector<std::uint8_t>> from_hex(const std::string& text) {
  if (text.size() % 2 != 0 || text.size() > 2 * kLongestReport) return {};
  std::vector<std::uint8_t> bytes(text.size() / 2);
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const char* begin = text.data() + 2 * i;
    if (std::from_chars(begin, begin + 2, bytes[i], 16).ptr != begin + 2) return {};
  }
  return bytes;
}

std::string to_hex(const std::vector<std::uint8_t>& bytes) {
  std::string text;
  text.reserve(2 * bytes.size());
  for (const std::uint8_t byte : bytes) fmt::format_to(std::back_inserter(text), "{:02x}", byte);
  return text;
}

/// Problems of one row [t, hex]; empty: none.
std::string check_report(const json& row, double previous, RawReport& report) {
  if (!row.is_array() || row.size() != 2 || !row[0].is_number() || !row[1].is_string()) {
    return "is not [t, \"bytes in hexadecimal\"]";
  }
  report.time_s = row[0].get<double>();
  if (!(report.time_s >= previous) || report.time_s > kLongest) {
    return fmt::format("time {:g} s comes before {:g} s; sort the reports by time", report.time_s, previous);
  }
  std::optional<std::vector<std::uint8_t>> bytes = from_hex(row[1].get_ref<const std::string&>());
  if (!bytes || bytes->empty()) {
    return fmt::format("report is not 1 to {} bytes of two hexadecimal digits", kLongestReport);
  }
  report.bytes = std::move(*bytes);
  return {};
}

std::vector<RawReport> read_reports(files::JsonFile& file, files::JsonObject& tracks) {
  std::vector<RawReport> track;
  const json* rows = tracks.array(kTracks.reports);
  if (rows == nullptr) return track;
  int bad = 0;
  for (std::size_t i = 0; i < rows->size() && bad < 10; ++i) {
    RawReport report;
    const std::string what = check_report((*rows)[i], track.empty() ? 0 : track.back().time_s, report);
    if (what.empty()) {
      track.push_back(std::move(report));
    } else {
      file.add_problem(fmt::format("{}/{}/{}", tracks.pointer(), kTracks.reports.name, i), what);
      ++bad;
    }
  }
  return track;
}

}  // namespace

const files::FileFormat& motion_format() {
  static const files::FileFormat format{.name = "motion",
                                        .title = "Time-stamped tracks of stylus and probe",
                                        .table = files::table_of<kMotion>,
                                        .id = "stylet-motion"};
  return format;
}

content::Motion read_motion(files::JsonFile& file, RawReports* raw) {
  RawReports found;
  files::JsonObject root = file.root(motion_format());
  content::Motion motion;
  const std::string frame = root.choice(kMotion.frame);
  found.frame = static_cast<MotionFrame>(std::ranges::find(kFrames, frame) - std::begin(kFrames));
  if (raw == nullptr && found.frame != MotionFrame::kPatient) {
    root.problem(kMotion.frame,
                 "is the hand's; a scenario needs poses in the patient's. `stylet train SCENARIO --device "
                 "recorded:FILE --record NEW` makes them");
  }
  if (auto tracks = root.object(kMotion.tracks)) {
    motion.stylus = read_track(file, *tracks, kTracks.stylus);
    motion.probe = read_track(file, *tracks, kTracks.probe);
    found.reports = read_reports(file, *tracks);
    tracks->finish();
  }
  if (auto device = root.object(kMotion.device)) {
    found.device = device->text(kRecordedDevice.name);
    if (auto bytes = from_hex(device->text(kRecordedDevice.report_descriptor))) {
      found.report_descriptor = std::move(*bytes);
    } else {
      device->problem(kRecordedDevice.report_descriptor, "is not bytes of two hexadecimal digits");
    }
    device->finish();
  }
  root.finish();
  if (raw != nullptr) *raw = std::move(found);
  return motion;
}

content::Motion read_motion(const std::filesystem::path& path, RawReports* raw) {
  files::JsonFile file(path, kMotionLimits);
  content::Motion motion = read_motion(file, raw);
  file.throw_problems();
  return motion;
}

void write_motion(const content::Motion& motion, const std::string& name, const std::filesystem::path& path,
                  int decimals, const RawReports& raw) {
  std::string out;
  const auto write_track = [&](const char* key, const std::vector<content::MotionSample>& track) {
    out += fmt::format("    \"{}\": [", key);
    for (std::size_t i = 0; i < track.size(); ++i) {
      const auto& p = track[i].pose.position;
      const auto& q = track[i].pose.orientation;
      out += fmt::format("{}\n      [{:.{}f}", i == 0 ? "" : ",", track[i].time_s, decimals);
      for (const double value : {p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z()}) {
        out += fmt::format(", {:.{}f}", value, decimals);
      }
      if (track[i].buttons != 0) out += fmt::format(", {}", track[i].buttons);
      out += "]";
    }
    out += "\n    ]";
  };
  out += fmt::format(
      "{{\n  \"format\": \"stylet-motion\",\n  \"version\": 1,\n  \"name\": {},\n  \"licence\": \"CC0-1.0\",\n",
      json(name).dump());
  if (raw.frame != MotionFrame::kPatient) {
    out += fmt::format("  \"frame\": \"{}\",\n", kFrames[static_cast<std::size_t>(raw.frame)]);
  }
  if (!raw.report_descriptor.empty()) {
    out += fmt::format("  \"device\": {{\"name\": {}, \"report_descriptor\": \"{}\"}},\n", json(raw.device).dump(),
                       to_hex(raw.report_descriptor));
  }
  out += "  \"tracks\": {\n";
  write_track("stylus", motion.stylus);
  if (!motion.probe.empty()) {
    out += ",\n";
    write_track("probe", motion.probe);
  }
  if (!raw.reports.empty()) {
    out += ",\n    \"reports\": [";
    for (std::size_t i = 0; i < raw.reports.size(); ++i) {
      out += fmt::format("{}\n      [{:.{}f}, \"{}\"]", i == 0 ? "" : ",", raw.reports[i].time_s, decimals,
                         to_hex(raw.reports[i].bytes));
    }
    out += "\n    ]";
  }
  out += "\n  }\n}\n";
  std::ofstream file(path, std::ios::binary);
  file.write(out.data(), static_cast<std::streamsize>(out.size()));
  if (!file.flush()) {
    throw files::ContentError(fmt::format("{}: cannot be written; check folder and space", path.string()));
  }
}

content::MotionSample sample_motion(const std::vector<content::MotionSample>& track, double time_s) {
  const auto after =
      std::upper_bound(track.begin(), track.end(), time_s,
                       [](double t, const content::MotionSample& sample) { return t < sample.time_s; });
  if (after == track.begin()) return track.front();
  if (after == track.end()) return track.back();
  const content::MotionSample& a = *(after - 1);
  const content::MotionSample& b = *after;
  const double share = (time_s - a.time_s) / (b.time_s - a.time_s);
  content::MotionSample out = a;
  out.time_s = time_s;
  out.pose.position = (1 - share) * a.pose.position + share * b.pose.position;
  out.pose.orientation = a.pose.orientation.slerp(share, b.pose.orientation);
  return out;
}

}  // namespace stylet::readers
