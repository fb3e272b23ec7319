// A live session with its course: what a window and a headless run both drive.
//
//   TrainingSession training(scene, {.automatic = true});
//   LiveSession live(scene, device, {..., .listeners = {&training.watch()}});
//   live.start();
//   while (...) training.poll(live, actions);   // every frame
//   training.end(live);
//   live.stop();
#pragma once

#include "engine/session/live_session.h"
#include "engine/training/ablation.h"
#include "engine/training/procedure_watch.h"
#include "engine/training/results.h"

#include <optional>
#include <span>
#include <vector>

namespace stylet::training {

struct TrainingSettings {
  bool automatic = false;  ///< nobody is there to start it: Flow
};

/// One thread, but for watch().
class TrainingSession {
public:
  /// Keeps a reference to `scene`.
  TrainingSession(const content::Scene& scene, const TrainingSettings& settings);

  /// To be told of the steps: LiveSettings::listeners.
  ProcedureWatch& watch() { return watch_; }

  /// Goes on to the newest simulation step: does what is asked for, pauses or resumes `live`, puts what happened on
  /// record, lets the zone grow. Once a frame, or a simulation step.
  const FlowState& poll(session::LiveSession& live, std::span<const Action> actions = {});
  /// The run is over: finishes what is under way. While `live` still records.
  void end(session::LiveSession& live);

  const FlowState& state() const { return flow_.state(); }
  /// What the tip is in: index into Scene::tissues; 0: outside.
  int tip_tissue() const { return tip_tissue_; }
  /// The trainee wants to begin anew: end() this and its LiveSession, make others on the same scene.
  bool reset_asked_for() const { return flow_.reset_asked_for(); }
  const SamplingResult& result() const { return result_; }
  /// The zone, once there is one.
  const Ablation* ablation() const { return ablation_ ? &*ablation_ : nullptr; }
  int ablated_body() const { return body_; }
  /// The same for the pictures; null before anything was heated. Until the next poll().
  const content::HeatedZone* zone() const { return zone_.version > 0 ? &zone_ : nullptr; }

private:
  void record(session::LiveSession& live, const Watched& seen, std::span<const FlowEvent> events);
  void let_zone_grow(double time_s, std::span<const FlowEvent> events);
  void take_core(session::LiveSession& live, const Watched& seen);
  void tell_ablation(session::LiveSession& live, const Watched& seen);

  const content::Scene& scene_;
  ProcedureWatch watch_;
  Flow flow_;
  std::vector<bool> target_tissue_;  // [Scene::tissues]
  std::uint32_t cores_ = 0;          // taken from the watch
  std::optional<Ablation> ablation_;
  int body_ = -1;
  int tip_tissue_ = 0;
  content::HeatedZone zone_;
  double stopped_s_ = 0;  // session time of the last stop of heating
  SamplingResult result_;
};

}  // namespace stylet::training
