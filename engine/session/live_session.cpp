#include "engine/session/live_session.h"

#include "engine/session/lockstep.h"
#include "engine/session/needle_base.h"
#include "engine/session/replay.h"

#include <algorithm>

namespace stylet::session {

namespace {

constexpr double kLongestTrace = 600;  // s of force kept of a session without an end

physics::StylusPose first_pose(haptic::Device& device) {
  const haptic::StylusSample sample = device.read(0);
  return {sample.position, sample.orientation};
}

RecordingHeader recording_header(const content::Scene& scene, const haptic::Device& device,
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
                                                    .haptic_hz = scene.rates.haptic_hz})};
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
      frames_(scene),
      needle_(frames_.buffer().make_frame()),
      loops_(scene, settings.coupling, start_, listeners(), base_) {}

std::vector<StepListener*> LiveSession::listeners() {
  std::vector<StepListener*> all{&hash_, &recorder_, &force_, &frames_, &needle_};
  all.insert(all.end(), settings_.listeners.begin(), settings_.listeners.end());
  return all;
}

RunStatistics LiveSession::run_in_lockstep(const RunProgress& progress) {
  const RunStatistics run = run_lockstep(loops_, device_, scene_, settings_.duration_s, [&](double share) {
    writer_.drain();
    if (progress) progress(share);
  });
  if (progress) progress(1);
  finish();
  return run;
}

void LiveSession::start() {
  writer_.start_background();
  threads_.emplace(loops_, device_, scene_,
                   ThreadedSettings{.duration_s = settings_.duration_s, .probe = settings_.probe});
}

RunStatistics LiveSession::stop() {
  threads_->stop();
  finish();
  return threads_->statistics();
}

void LiveSession::finish() {
  recorder_.finish();
  writer_.finish();
}

}  // namespace stylet::session
