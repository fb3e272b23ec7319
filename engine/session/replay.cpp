#include "engine/session/replay.h"

#include "engine/files/error.h"
#include "haptic/denormals.h"
#include "haptic/paced_loop.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <array>
#include <fstream>
#include <iterator>
#include <map>
#include <span>

namespace stylet::session {

namespace {

// The hashes of one loop, met in the order of its steps.
class HashCheck {
public:
  HashCheck(const recording::Recording& recording, recording::LoopName loop) : loop_(loop) {
    for (const recording::HashRecord& record : recording.hashes) {
      if (record.loop == loop) expected_[record.step] = record.hash;
    }
  }
  void compare(std::uint64_t step, std::uint64_t hash, ReplayResult& result) const {
    const auto found = expected_.find(step);
    if (found == expected_.end()) return;
    ++result.compared;
    if (found->second != hash && !result.divergence) result.divergence = {loop_, step, found->second, hash};
  }

private:
  recording::LoopName loop_;
  std::map<std::uint64_t, std::uint64_t> expected_;
};

[[noreturn]] void impossible(const std::string& what) {
  throw files::ContentError(
      fmt::format("recording: {}; it was not written by a session or is incomplete; record it again", what));
}

}  // namespace

ReplayableSteps replayable_steps(const recording::Recording& recording) {
  ReplayableSteps steps{.haptic = recording.haptic.size(), .simulation = recording.simulation.size()};
  if (recording.end) return steps;
  const auto last_haptic = [&] { return steps.haptic > 0 ? recording.haptic[steps.haptic - 1].step : 0; };
  const auto last_patch = [&] { return steps.simulation > 0 ? recording.simulation[steps.simulation - 1].step : 0; };
  for (ReplayableSteps before{}; before.haptic != steps.haptic || before.simulation != steps.simulation;) {
    before = steps;
    while (steps.haptic > 0 && recording.haptic[steps.haptic - 1].patch_epoch > last_patch()) --steps.haptic;
    while (steps.simulation > 0 && recording.simulation[steps.simulation - 1].needle_step > last_haptic()) {
      --steps.simulation;
    }
  }
  return steps;
}

// A simulation step consumed the needle state of a haptic step that was then complete; its patch was consumed by
// later haptic steps. So: keep each needle state that some simulation step consumed, and run the simulation steps
// just before the first haptic step that consumes their patch.
ReplayResult replay(const recording::Recording& recording, CoupledLoops& loops, const StepHash& hash,
                    const RunProgress& progress) {
  const haptic::FlushDenormals flush;
  haptic::MonotonicClock clock;
  haptic::LatencyHistogram haptic_time;
  haptic::LatencyHistogram simulation_time;
  const HashCheck haptic_hashes(recording, recording::LoopName::haptic);
  const HashCheck simulation_hashes(recording, recording::LoopName::simulation);
  const ReplayableSteps steps = replayable_steps(recording);
  const std::span haptic_steps = std::span(recording.haptic).first(steps.haptic);
  const std::span simulation_steps = std::span(recording.simulation).first(steps.simulation);
  ReplayResult result;
  result.run.mode = "replay";
  physics::TissuePatch patch = loops.make_patch();

  std::map<std::uint64_t, physics::NeedleState> kept;  // by haptic step, as long as a simulation step needs it
  std::map<std::uint64_t, int> wanted;
  for (const recording::SimulationStepRecord& record : simulation_steps) ++wanted[record.needle_step];
  const auto keep = [&](const physics::NeedleState& needle) {
    if (wanted.contains(needle.step)) physics::copy_state(needle, kept[needle.step]);
  };
  keep(loops.needle());

  std::size_t next = 0;  // simulation step
  const auto simulate = [&] {
    const recording::SimulationStepRecord& record = simulation_steps[next++];
    const auto needle = kept.find(record.needle_step);
    if (needle == kept.end()) {
      impossible(fmt::format("simulation step {} consumes haptic step {} before it was made", record.step,
                             record.needle_step));
    }
    const std::int64_t start = clock.now_ns();
    const physics::SimulationReport report = loops.simulation_step(
        record.time_s, needle->second, record.probe, record.factor_taken, record.factor_requested, patch, &record);
    simulation_time.add(clock.now_ns() - start);
    if (report.factorisation_requested) loops.worker().step();
    if (--wanted[record.needle_step] == 0) kept.erase(needle);
    simulation_hashes.compare(record.step, hash.simulation(), result);
    result.run.simulation_flags |= report.flags;
    result.run.patch_flags |= patch.flags;
    result.run.factorisations += report.factorisation_taken ? 1 : 0;
    ++result.run.simulation.steps;
  };

  const std::int64_t begin = clock.now_ns();
  for (const recording::HapticStepRecord& record : haptic_steps) {
    while (patch.epoch < record.patch_epoch) {
      if (next == simulation_steps.size()) {
        impossible(fmt::format("haptic step {} consumes patch {}, which no simulation step made", record.step,
                               record.patch_epoch));
      }
      simulate();
    }
    const std::int64_t start = clock.now_ns();
    const physics::NeedleState& needle = loops.haptic_step(record, patch);
    haptic_time.add(clock.now_ns() - start);
    haptic_hashes.compare(record.step, hash.haptic(), result);
    keep(needle);
    result.run.needle_flags |= needle.flags;
    result.run.unresolved.add(needle.flags);
    result.run.duration_s = record.time_s;
    ++result.run.haptic.steps;
    if (progress && record.step % 100 == 0) {
      progress(static_cast<double>(result.run.haptic.steps) / static_cast<double>(haptic_steps.size()));
    }
  }
  while (next < simulation_steps.size()) simulate();

  result.run.wall_s = static_cast<double>(clock.now_ns() - begin) * 1e-9;
  result.run.haptic.step_time = haptic_time.quantiles();
  result.run.simulation.step_time = simulation_time.quantiles();
  return result;
}

std::string to_json(const RecordedSettings& settings) {
  const Eigen::Vector3d& p = settings.start.position;
  const Eigen::Quaterniond& q = settings.start.orientation;
  // Doubles are written so that they read back to the same bits.
  nlohmann::json json{{"coupling", coupling_name(settings.coupling)},
                      {"mode", settings.mode},
                      {"device", settings.device},
                      {"haptic_hz", settings.haptic_hz},
                      {"start_pose", {p.x(), p.y(), p.z(), q.w(), q.x(), q.y(), q.z()}}};
  if (settings.start_seed) json["start_seed"] = *settings.start_seed;
  if (settings.force_scale != 1) json["force_scale"] = settings.force_scale;
  if (const physics::NeedleBase& base = settings.base; base.kind == physics::BaseKind::spring_damper) {
    json["base"] = {{"stiffness_n_per_m", base.stiffness},
                    {"damping_n_s_per_m", base.damping},
                    {"rotational_stiffness_nm_per_rad", base.rotational_stiffness},
                    {"rotational_damping_nm_s_per_rad", base.rotational_damping}};
  }
  return json.dump();
}

RecordedSettings recorded_settings(const recording::Recording& recording) {
  RecordedSettings settings;
  try {
    const auto json = nlohmann::json::parse(recording.header.settings_json);
    settings.coupling = coupling_from_name(json.at("coupling").get<std::string>());
    settings.mode = json.at("mode").get<std::string>();
    settings.device = json.at("device").get<std::string>();
    const auto pose = json.at("start_pose").get<std::array<double, 7>>();
    settings.start.position = {pose[0], pose[1], pose[2]};
    settings.start.orientation = {pose[3], pose[4], pose[5], pose[6]};
    settings.haptic_hz = json.value("haptic_hz", 0.0);
    settings.force_scale = json.value("force_scale", 1.0);
    if (json.contains("start_seed")) settings.start_seed = json["start_seed"].get<std::uint32_t>();
    if (const auto base = json.find("base"); base != json.end()) {
      settings.base = {.kind = physics::BaseKind::spring_damper,
                       .stiffness = base->at("stiffness_n_per_m").get<double>(),
                       .damping = base->at("damping_n_s_per_m").get<double>(),
                       .rotational_stiffness = base->at("rotational_stiffness_nm_per_rad").get<double>(),
                       .rotational_damping = base->at("rotational_damping_nm_s_per_rad").get<double>()};
    }
  } catch (const nlohmann::json::exception& error) {
    impossible(fmt::format("the settings in its header are not a session's ({})", error.what()));
  }
  return settings;
}

std::uint64_t file_hash(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return 0;
  StateHash hash;
  for (auto byte = std::istreambuf_iterator<char>(file); byte != std::istreambuf_iterator<char>(); ++byte) {
    hash.add(static_cast<std::uint64_t>(static_cast<unsigned char>(*byte)));
  }
  return hash.value();
}

}  // namespace stylet::session
