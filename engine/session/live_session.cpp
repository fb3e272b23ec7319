#include "engine/session/live_session.h"

#include "engine/session/force_scale.h"
#include "engine/session/lockstep.h"
#include "engine/session/needle_base.h"
#include "engine/session/replay.h"
#include "engine/session/threaded_run.h"

#include <algorithm>
#include <chrono>
#include <thread>

namespace stylet::session {

namespace {

constexpr std::chrono::milliseconds kLook{1};
constexpr double kLongestTrace = 600;  // s of force kept of a session without an end

physics::StylusPose first_pose(haptic::Device& device) {
  const haptic::StylusSample sample = device.read(0);
  return {sample.position, sample.orientation};
}

recording::RecordingHeader recording_header(const content::Scene& scene, const haptic::Device& device,
                                            const LiveSettings& settings, const physics::StylusPose& start,
                                            const physics::NeedleBase& base) {
  return {.build = settings.build,
          .scenario = scene.scenario.string(),
          .scenario_hash = file_hash(scene.scenario),
          .settings_json = to_json(RecordedSettings{.coupling = settings.coupling,
                                                    .mode = settings.lockstep ? "lockstep" : "threaded",
                                                    .device = device.name(),
                                                    .start = start,
                                                    .base = base,
                                                    .haptic_hz = scene.rates.haptic_hz,
                                                    .start_seed = settings.start_seed,
                                                    .force_scale = force_scale(scene.hand_force, device.limits())})};
}

}  // namespace

LiveSession::LiveSession(const content::Scene& scene, haptic::Device& device, const LiveSettings& settings)
    : scene_(scene),
      device_(device),
      settings_(settings),
      start_(first_pose(device)),
      base_(needle_base(device.limits(), scene.rates.haptic_hz)),
      writer_(settings.recording, recording_header(scene, device, settings, start_, base_)),
      recorder_(writer_, hash_, scene),
      force_(scene, std::min(settings.duration_s, kLongestTrace)),
      frames_(scene, force_scale(scene.hand_force, device.limits())),
      needle_(frames_.buffer().make_frame()),
      loops_(scene, settings.coupling, start_, listeners(), base_) {}

std::vector<StepListener*> LiveSession::listeners() {
  std::vector<StepListener*> all{&hash_, &recorder_, &force_, &frames_, &needle_};
  all.insert(all.end(), settings_.listeners.begin(), settings_.listeners.end());
  return all;
}

void LiveSession::start() {
  if (settings_.lockstep) {
    schedule_ = std::make_unique<LockstepRun>(
        loops_, device_, scene_, LockstepSettings{.duration_s = settings_.duration_s, .probe = settings_.probe});
    return;
  }
  writer_.start_background();
  schedule_ = std::make_unique<ThreadedRun>(
      loops_, device_, scene_, ThreadedSettings{.duration_s = settings_.duration_s, .probe = settings_.probe});
}

void LiveSession::advance(double by_s) {
  if (!settings_.lockstep) return;
  schedule_->advance(by_s);
  writer_.drain();
}

void LiveSession::wait() {
  while (!finished()) {
    settings_.lockstep ? advance(1 / scene_.rates.simulation_hz) : std::this_thread::sleep_for(kLook);
  }
}

RunStatistics LiveSession::run_in_lockstep(const RunProgress& progress) {
  start();
  while (!finished()) {
    if (progress) progress(time_s() / settings_.duration_s);
    advance(1 / scene_.rates.simulation_hz);
  }
  if (progress) progress(1);
  return stop();
}

std::optional<ForceOutput> LiveSession::force_output(const RunStatistics& run) const {
  const haptic::DeviceLimits limits = device_.limits();
  if (!limits.renders_force) return std::nullopt;
  return ForceOutput{.scale = force_scale(scene_.hand_force, limits),
                     .max_force = limits.max_force_n,
                     .clipped_s = run.guard.clipped_s,
                     .clipped_times = run.guard.clipped_times};
}

RunStatistics LiveSession::stop() {
  schedule_->stop();
  recorder_.finish();
  writer_.finish();
  return schedule_->statistics();
}

}  // namespace stylet::session
