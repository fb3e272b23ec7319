// A session on disk: every input of every step and what it consumed, so that replay gives the same bits.
//
//   file    := magic[8]  header-length u32  header JSON  checksum u32  record*
//   record  := type u8  length u32  payload[length]  checksum u32
//
// All numbers are little-endian, packed without gaps; doubles are raw IEEE 754 bits. A checksum is the CRC-32C of
// everything in its header or record before it. The order of the records of one loop is the order of its steps; the
// two loops' records are interleaved as they were drained. The last record of a whole recording is `end`.
//
// Version 2 has typed fields in its events where version 1 has one text, and the volumes of cavities in its
// simulation steps. Version 3 has the breath in its simulation steps: it is held when a trainee asks for it.
#pragma once

#include "engine/recording/event.h"
#include "physics/messages/messages.h"

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace stylet::recording {

/// Files of this version are written, those up to it are read.
inline constexpr std::uint64_t kRecordingVersion = 3;

/// What the recording was made with.
struct RecordingHeader {
  std::string build;                 ///< commit and flags of the binary
  std::string scenario;              ///< path as given
  std::uint64_t scenario_hash = 0;   ///< of the scenario's bytes; replay warns when it differs
  std::string settings_json = "{}";  ///< a JSON object: coupling, rates, threaded or lockstep, device, ...
};

/// One haptic step: its input, and the patch it consumed.
struct HapticStepRecord {
  std::uint64_t step = 0;
  double time_s = 0;
  double dt_s = 0;
  physics::StylusPose pose{};
  std::uint32_t buttons = 0;
  bool valid = false;             ///< of the stylus sample
  std::uint64_t patch_epoch = 0;  ///< TissuePatch consumed
};

/// Volume wanted of each of a scene's cavities over that when full.
using CavityShares = std::array<double, physics::kMaxCavities>;
constexpr CavityShares full_cavities() {
  CavityShares shares{};
  shares.fill(1);
  return shares;
}

/// One simulation step: its input, the needle state it consumed, and what the factorisation thread did.
struct SimulationStepRecord {
  std::uint64_t step = 0;
  double time_s = 0;
  std::uint64_t needle_step = 0;   ///< haptic step whose NeedleState was consumed
  bool factor_taken = false;       ///< a finished factorisation was swapped in before this step
  bool factor_requested = false;   ///< a new one was asked for in this step
  std::uint64_t factor_epoch = 0;  ///< factorisation in use
  physics::RigidPose probe;
  CavityShares cavity_shares = full_cavities();
  double inspiration = -1;  ///< share of a full one; negative, in versions 1 and 2: as the scene breathes
};

enum class LoopName : std::uint8_t { haptic, simulation };

/// Chained state hash of one loop after a step.
struct HashRecord {
  LoopName loop = LoopName::haptic;
  bool final = false;  ///< after the last step of the session
  std::uint64_t step = 0;
  std::uint64_t hash = 0;
};

/// The last record.
struct EndRecord {
  std::uint64_t haptic_steps = 0;
  std::uint64_t simulation_steps = 0;
  std::uint64_t lost_records = 0;  ///< dropped because a ring was full: the recording cannot be replayed
};

/// A recording in memory.
struct Recording {
  RecordingHeader header;
  std::vector<HapticStepRecord> haptic;
  std::vector<SimulationStepRecord> simulation;
  std::vector<HashRecord> hashes;
  std::vector<EventRecord> events;
  std::optional<EndRecord> end;
  std::uint64_t usable_bytes = 0;  ///< from the start of the file; the rest is a record cut short
  std::uint64_t file_bytes = 0;

  /// All that was recorded is there.
  bool complete() const { return end.has_value() && end->lost_records == 0 && usable_bytes == file_bytes; }
  /// One line for the user: "complete, 12000 haptic and 600 simulation steps", or what is missing.
  std::string condition() const;
};

struct RecordingLimits {
  std::uint64_t max_file_bytes = std::uint64_t{4} << 30;
  std::uint32_t max_header_bytes = 1u << 20;
};

/// Reads a recording. A tail cut short or of zeros (power cut, killed process) is left out and shows in usable_bytes.
/// @throws files::ContentError  "file: byte N: what is wrong; what to do" for anything else that is not as written
Recording read_recording(const std::filesystem::path& path, const RecordingLimits& limits = {});

/// The same from memory. @param name  stands for the file in messages
Recording parse_recording(std::span<const std::uint8_t> bytes, const std::string& name,
                          const RecordingLimits& limits = {});

}  // namespace stylet::recording
