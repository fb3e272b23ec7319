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
#include "engine/training/flow.h"
#include "engine/training/procedure_watch.h"
#include "engine/training/shown_history.h"

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>

namespace stylet::training {

struct TrainingSettings {
  bool automatic = false;           ///< nobody is there to start it: Flow
  procedures::Controls controls{};  ///< of the device in use, for the prompts
  std::function<void()> begun{};    ///< called once, when the briefing is left; where step() and poll() are called
};

/// One thread, but for watch().
class TrainingSession {
public:
  /// Keeps a reference to `scene`.
  TrainingSession(const content::Scene& scene, const TrainingSettings& settings);

  /// To be told of the steps: LiveSettings::listeners.
  ProcedureWatch& watch() { return watch_; }

  /// Goes on to the newest simulation step: does what is asked for, pauses or resumes `live`, puts what happened on
  /// record, lets the hand feel what was fired. Once a frame, or a simulation step.
  const FlowState& poll(session::LiveSession& live, std::span<const Action> actions = {});
  /// The same without a live session: what happened.
  const Events& step(std::span<const Action> actions = {});
  /// The run is over: finishes what is under way. While `live` still records.
  void end(session::LiveSession& live);

  const FlowState& state() const { return flow_.state(); }
  /// What happened at the last step() or poll().
  const Events& happened() const { return happened_; }
  /// What the tip is in: index into Scene::tissues; 0: outside.
  int tip_tissue() const { return tip_tissue_; }
  /// The trainee wants to begin anew: end() this and its LiveSession, make others on the same scene.
  bool reset_asked_for() const { return flow_.reset_asked_for(); }
  /// The procedure of the exercise; null: nothing is sampled or destroyed.
  const procedures::Procedure* procedure() const { return procedure_.get(); }
  /// How often the hand has felt the instrument kick.
  std::uint32_t recoils() const { return recoils_; }
  /// What was sampled or destroyed, some lines for the terminal; empty: nothing.
  std::string result_in_words() const { return procedure_ ? procedure_->result_in_words() : std::string(); }
  /// What the procedure showed at every time that was polled.
  const ShownHistory& shown() const { return shown_; }
  /// Adds to a frame what the procedure shows.
  void show(state::FrameState& frame) const {
    if (procedure_) procedure_->show(frame);
  }

private:
  std::unique_ptr<procedures::Procedure> procedure_;  // null: there is none
  ProcedureWatch watch_;
  Flow flow_;
  std::function<void()> begun_;  // empty: nobody wants to know, or knows
  ShownHistory shown_;
  Events happened_;
  int tip_tissue_ = 0;
  std::uint32_t recoils_ = 0;  // felt
};

}  // namespace stylet::training
