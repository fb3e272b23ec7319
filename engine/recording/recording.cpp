#include "engine/recording/recording.h"

#include "engine/files/error.h"
#include "engine/recording/recording_format.h"

#include <fmt/core.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <fstream>
#include <stdexcept>
#include <system_error>
#include <utility>

namespace stylet::recording {
namespace {

using files::ContentError;
using format::PayloadReader;
using format::RecordType;

constexpr int kMaxHeaderDepth = 32;
constexpr double kMostCavityShare = 10;  // of its volume at rest
constexpr double kMostInspiration = 10;  // a scenario has 2 at most

[[noreturn]] void refuse(const std::string& name, std::uint64_t offset, const std::string& what) {
  throw ContentError(fmt::format("{}: byte {}: {}; record the session again", name, offset, what));
}

std::uint32_t load_u32(std::span<const std::uint8_t> bytes, std::size_t offset) {
  return PayloadReader(bytes.subspan(offset)).get<std::uint32_t>();
}

/// @param text  as stored; @param offset  of it in the file, for messages
/// @param[out] version_of_file  at most kRecordingVersion
RecordingHeader parse_header(std::string_view text, const std::string& name, std::uint64_t offset,
                             std::uint64_t& version_of_file) {
  // Values nested deeper than any settings are left out, and the header is refused: writing them out again is
  // recursive.
  bool too_deep = false;
  const auto shallow = [&too_deep](int depth, nlohmann::json::parse_event_t, nlohmann::json&) {
    too_deep = too_deep || depth > kMaxHeaderDepth;
    return depth <= kMaxHeaderDepth;
  };
  const nlohmann::json json = nlohmann::json::parse(text, shallow, /*allow_exceptions=*/false);
  if (too_deep) refuse(name, offset, "the header is nested too deeply");
  const auto string_at = [&](const char* key) -> std::string {
    const auto found = json.find(key);
    if (found == json.end() || !found->is_string()) {
      refuse(name, offset, fmt::format("the header has no text '{}'", key));
    }
    return found->get<std::string>();
  };
  if (!json.is_object()) refuse(name, offset, "the header is not a JSON object");
  if (string_at("format") != "stylet-recording") refuse(name, offset, "the header's format is not stylet-recording");
  const auto version = json.find("version");
  if (version == json.end() || !version->is_number_unsigned() || version->get<std::uint64_t>() < 1) {
    refuse(name, offset, "the header has no version");
  }
  if (version->get<std::uint64_t>() > kRecordingVersion) {
    throw ContentError(
        fmt::format("{}: byte {}: the recording is of version {}, and this program reads up to {}; open "
                    "it with the program that wrote it or a later one",
                    name, offset, version->get<std::uint64_t>(), kRecordingVersion));
  }
  version_of_file = version->get<std::uint64_t>();
  if (string_at("endianness") != "little") refuse(name, offset, "the recording is not little-endian");
  const auto settings = json.find("settings");
  if (settings == json.end() || !settings->is_object()) refuse(name, offset, "the header has no object 'settings'");
  RecordingHeader header;
  header.build = string_at("build");
  header.scenario = string_at("scenario");
  // Of a path that is no UTF-8, which `scenario` has but for people.
  if (const auto bytes = json.find("scenario_bytes"); bytes != json.end()) {
    header.scenario.clear();
    if (!bytes->is_array()) refuse(name, offset, "the header's scenario_bytes is not a list");
    for (const auto& byte : *bytes) {
      if (!byte.is_number_unsigned() || byte.get<std::uint64_t>() > 0xFF) {
        refuse(name, offset, "the header's scenario_bytes holds something that is no byte");
      }
      header.scenario += static_cast<char>(byte.get<std::uint64_t>());
    }
  }
  const std::string hash = string_at("scenario_hash");
  try {
    std::size_t used = 0;
    header.scenario_hash = std::stoull(hash, &used, 16);
    if (used != hash.size() || hash.size() != 16) throw std::invalid_argument(hash);
  } catch (const std::logic_error&) {
    refuse(name, offset, "the header's scenario_hash is not 16 hexadecimal digits");
  }
  header.settings_json = settings->dump();
  return header;
}

/// Sizes a payload of this type may have; {1, 0} for a type that does not exist.
std::pair<std::size_t, std::size_t> payload_sizes(std::uint8_t type, std::uint64_t version) {
  switch (static_cast<RecordType>(type)) {
    case RecordType::haptic_step:
      return {format::kHapticStepBytes, format::kHapticStepBytes};
    case RecordType::simulation_step:
      if (version == 1) return {format::kSimulationStepBytes1, format::kSimulationStepBytes1};
      if (version == 2) return {format::kSimulationStepBytes2, format::kSimulationStepBytes2};
      return {format::kSimulationStepBytes, format::kSimulationStepBytes};
    case RecordType::hash:
      return {format::kHashBytes, format::kHashBytes};
    case RecordType::event:
      if (version == 1) return {format::kEventBytes1, format::kEventBytes1 + 2 * kMaxEventText};
      return {format::kMinEventBytes, format::kMaxEventBytes};
    case RecordType::end:
      return {format::kEndBytes, format::kEndBytes};
  }
  return {1, 0};
}

/// A power cut may leave a file longer than what reached the disk: zeros from within this record to the end.
bool zeros_to_the_end(std::span<const std::uint8_t> bytes, std::size_t record_at) {
  const auto last = std::find_if(bytes.rbegin(), bytes.rend(), [](std::uint8_t byte) { return byte != 0; });
  const auto written = static_cast<std::size_t>(bytes.rend() - last);
  return written < bytes.size() && written < record_at + format::kMaxRecord &&
         bytes.size() - written >= std::min<std::size_t>(format::kChecksumBytes, bytes.size() - record_at);
}

/// Of a session, s: finite, and so long that nobody sits through it.
bool is_time(double time_s) {
  constexpr double kLongest = 1e6;
  return time_s >= 0 && time_s <= kLongest;
}

/// Adds one record whose checksum is right. @return false when its payload makes no sense
bool take_record(RecordType type, std::span<const std::uint8_t> payload, std::uint64_t version, Recording& out) {
  PayloadReader in(payload);
  switch (type) {
    case RecordType::haptic_step: {
      HapticStepRecord r;
      r.step = in.get<std::uint64_t>();
      r.time_s = in.get<double>();
      r.dt_s = in.get<double>();
      r.pose.position = in.get_vector();
      r.pose.orientation = in.get_quaternion();
      r.buttons = in.get<std::uint32_t>();
      r.valid = in.get_bool();
      r.patch_epoch = in.get<std::uint64_t>();
      if (!is_time(r.time_s)) return false;
      out.haptic.push_back(r);
      break;
    }
    case RecordType::simulation_step: {
      SimulationStepRecord r;
      r.step = in.get<std::uint64_t>();
      r.time_s = in.get<double>();
      r.needle_step = in.get<std::uint64_t>();
      r.factor_taken = in.get_bool();
      r.factor_requested = in.get_bool();
      r.factor_epoch = in.get<std::uint64_t>();
      r.probe.position = in.get_vector();
      r.probe.orientation = in.get_quaternion();
      if (version > 1) {
        for (double& share : r.cavity_shares) {
          share = in.get<double>();
          if (!(share >= 0 && share <= kMostCavityShare)) return false;
        }
      }
      if (version > 2) {
        r.inspiration = in.get<double>();
        if (!(r.inspiration >= -1 && r.inspiration <= kMostInspiration)) return false;
      }
      if (!is_time(r.time_s)) return false;
      out.simulation.push_back(r);
      break;
    }
    case RecordType::hash: {
      HashRecord r;
      r.loop = in.get_bool() ? LoopName::simulation : LoopName::haptic;
      r.final = in.get_bool();
      r.step = in.get<std::uint64_t>();
      r.hash = in.get<std::uint64_t>();
      out.hashes.push_back(r);
      break;
    }
    case RecordType::event: {
      EventRecord r;
      r.time_s = in.get<double>();
      r.step = in.get<std::uint64_t>();
      r.name = in.get_text();
      if (version == 1) {
        if (std::string text = in.get_text(); !text.empty()) {
          r.fields.push_back({std::string(EventRecord::kVersion1Field), std::move(text)});
        }
      } else {
        const auto fields = in.get<std::uint8_t>();
        for (int f = 0; f < fields && in.ok(); ++f) r.fields.push_back(in.get_field());
      }
      if (!is_time(r.time_s)) return false;
      out.events.push_back(std::move(r));
      break;
    }
    case RecordType::end: {
      EndRecord r;
      r.haptic_steps = in.get<std::uint64_t>();
      r.simulation_steps = in.get<std::uint64_t>();
      r.lost_records = in.get<std::uint64_t>();
      out.end = r;
      break;
    }
  }
  return in.finished();
}

}  // namespace

std::string Recording::condition() const {
  const std::string steps = fmt::format("{} haptic and {} simulation steps", haptic.size(), simulation.size());
  if (complete()) return "complete, " + steps;
  if (end.has_value() && end->lost_records > 0) {
    return fmt::format("incomplete, {}: {} records were lost because the disk was too slow", steps,
                       end->lost_records);
  }
  return fmt::format("cut short, {} in the usable {} of {} bytes", steps, usable_bytes, file_bytes);
}

Recording parse_recording(std::span<const std::uint8_t> bytes, const std::string& name,
                          const RecordingLimits& limits) {
  Recording out;
  out.file_bytes = bytes.size();
  const std::size_t text_at = format::kMagic.size() + 4;
  if (bytes.size() < text_at || !std::equal(format::kMagic.begin(), format::kMagic.end(), bytes.begin())) {
    throw ContentError(name + ": byte 0: this is not a Stylet recording; give the .rec file a session wrote");
  }
  const std::uint32_t header_bytes = load_u32(bytes, format::kMagic.size());
  if (header_bytes > limits.max_header_bytes) {
    refuse(name, format::kMagic.size(), fmt::format("a header of {} bytes is too long", header_bytes));
  }
  std::size_t at = text_at + header_bytes;
  if (bytes.size() < at + format::kChecksumBytes) refuse(name, bytes.size(), "the file ends within its header");
  if (load_u32(bytes, at) != files::crc32c(bytes.first(at))) refuse(name, 0, "the header's checksum does not match");
  const auto* text = reinterpret_cast<const char*>(bytes.data() + text_at);
  std::uint64_t version = 0;
  out.header = parse_header({text, header_bytes}, name, text_at, version);
  at += format::kChecksumBytes;
  out.usable_bytes = at;

  while (at < bytes.size()) {
    if (out.end.has_value()) refuse(name, at, "there are bytes behind the end record");
    const std::uint8_t type = bytes[at];
    const auto [shortest, longest] = payload_sizes(type, version);
    if (shortest > longest) {
      if (zeros_to_the_end(bytes, at)) break;
      refuse(name, at, fmt::format("there is no record of type {}", type));
    }
    if (bytes.size() - at < format::kFrontBytes) break;  // cut short
    const std::uint32_t length = load_u32(bytes, at + 1);
    if (length < shortest || length > longest) {
      if (zeros_to_the_end(bytes, at)) break;
      refuse(name, at, fmt::format("a record of type {} cannot have {} bytes", type, length));
    }
    const std::size_t checked = format::kFrontBytes + length;
    if (bytes.size() - at < checked + format::kChecksumBytes) break;  // cut short
    if (load_u32(bytes, at + checked) != files::crc32c(bytes.subspan(at, checked))) {
      if (zeros_to_the_end(bytes, at)) break;
      refuse(name, at, "the record's checksum does not match");
    }
    if (!take_record(static_cast<RecordType>(type), bytes.subspan(at + format::kFrontBytes, length), version, out)) {
      refuse(name, at, fmt::format("the contents of a record of type {} make no sense", type));
    }
    at += checked + format::kChecksumBytes;
    out.usable_bytes = at;
  }
  if (out.end.has_value() &&
      (out.end->haptic_steps != out.haptic.size() || out.end->simulation_steps != out.simulation.size())) {
    refuse(name, out.usable_bytes, "the end record counts other steps than the file holds");
  }
  return out;
}

Recording read_recording(const std::filesystem::path& path, const RecordingLimits& limits) {
  if (path.empty()) throw ContentError("the name of the recording is empty; give its path");
  const std::string name = path.string();
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error) throw ContentError(fmt::format("{}: cannot be read ({}); check the path", name, error.message()));
  if (size > limits.max_file_bytes) {
    throw ContentError(
        fmt::format("{}: {} bytes are too many for a recording; the limit is {}", name, size, limits.max_file_bytes));
  }
  std::ifstream file(path, std::ios::binary);
  std::vector<std::uint8_t> bytes(size);
  if (!file.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(size))) {
    throw ContentError(name + ": cannot be read; check its permissions");
  }
  return parse_recording(bytes, name, limits);
}

}  // namespace stylet::recording
