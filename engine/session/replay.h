// A recording run again: its inputs on its schedule, which gives the same bits.
#pragma once

#include "engine/recording/recording.h"
#include "engine/session/coupled_loops.h"
#include "engine/session/run_statistics.h"
#include "engine/session/step_hash.h"

#include <cstdint>
#include <optional>
#include <string>

namespace stylet::session {

/// Where a replay first left the recording.
struct Divergence {
  recording::LoopName loop = recording::LoopName::haptic;
  std::uint64_t step = 0;
  std::uint64_t recorded = 0;
  std::uint64_t replayed = 0;
};

/// Steps that can be run again. The tail of a recording that was cut off may hold steps of one loop whose input from
/// the other is lost.
struct ReplayableSteps {
  std::size_t haptic = 0;
  std::size_t simulation = 0;
};
/// All of a recording with its end.
ReplayableSteps replayable_steps(const recording::Recording& recording);

struct ReplayResult {
  RunStatistics run;
  std::uint64_t compared = 0;            ///< hashes compared
  std::optional<Divergence> divergence;  ///< none: every hash was equal
  bool identical() const { return !divergence && compared > 0; }
};

/// Runs every replayable step with the recorded input, patch, needle state and factorisation. `hash` is one of the
/// loops' listeners and stands before those that read it.
/// @throws files::ContentError  where the recording's schedule is impossible (a step consumes what was not made
/// yet)
ReplayResult replay(const recording::Recording& recording, CoupledLoops& loops, const StepHash& hash,
                    const RunProgress& progress = {});

/// Settings of the session that made a recording.
struct RecordedSettings {
  physics::Coupling coupling = physics::Coupling::stylet;
  std::string mode{};  ///< "threaded" or "lockstep"
  std::string device{};
  physics::StylusPose start{};  ///< of the hub before the first step
  physics::NeedleBase base{};   ///< how the needle was held; prescribed where the recording does not say
  double haptic_hz = 0;         ///< 0: the scenario's, in recordings of earlier versions
  std::optional<std::uint32_t> start_seed{};  ///< of session::drawn_start(); none: as the scene has it
  double force_scale = 1;  ///< of the needle's force that went to the hand; a replay's bits do not depend on it
};
std::string to_json(const RecordedSettings& settings);
/// @throws files::ContentError  the recording's settings are not those of a session
RecordedSettings recorded_settings(const recording::Recording& recording);

/// Hash of a file's bytes, so that a replay can tell whether the scenario changed since. 0 if it cannot be read.
std::uint64_t file_hash(const std::filesystem::path& path);

}  // namespace stylet::session
