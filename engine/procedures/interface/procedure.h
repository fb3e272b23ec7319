// A kind of procedure and one that is under way: all that the rest of the engine knows of biopsies, ablations, ...
//
// A kind is one folder, engine/procedures/KIND, and one row of the table in engine/procedures/kinds.cpp.
#pragma once

#include "engine/content/metric_table.h"
#include "engine/content/scene.h"
#include "engine/content/tissue_locator.h"
#include "engine/files/json_reader.h"
#include "engine/procedures/interface/course.h"
#include "engine/recording/recording.h"
#include "engine/sound/cue.h"
#include "engine/state/frame_state.h"
#include "physics/tissue/cavity.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace stylet::procedures {

/// A simulation step as a procedure sees it. Patient frame, SI.
struct Step {
  double time_s = 0;
  std::uint64_t haptic_step = 0;  ///< that it consumed
  Eigen::Vector3d tip;
  Eigen::Quaterniond orientation;  ///< of the tip, +Z ahead
  bool in_tissue = false;
  content::TissuePlace at_tip;     ///< where the tip is in tissue, or the needle works with a bare part
  content::TissueLocator& tissue;  ///< of this step
  std::span<const physics::CavityState> cavities{};  ///< [cavities of the scene]
  std::span<const double> cavity_shares{};           ///< [cavities of the scene, or more] how full they were to be
  std::span<const Eigen::Vector3d> targets{};        ///< [Scene::targets] centers, as the tissue carries them
};

/// What a prompt goes by. Stages procedure and sampling, with the needle in the patient.
struct PromptInput {
  Stage stage = Stage::procedure;
  bool in_target = false;  ///< the tip, or the part that works
  bool treated = false;    ///< and that target has had its sample
  Controls controls{};
};

/// A procedure of a session that runs. Its making allocates; observe() runs on the simulation thread, all else on
/// the one thread that follows the course.
class Procedure {
public:
  virtual ~Procedure() = default;

  /// Memory for observe(), made three times at the start. Null: nothing is observed.
  virtual std::unique_ptr<Observation> make_observation() const { return nullptr; }
  /// Takes from a step what the course needs. Simulation thread; no allocation.
  virtual void observe(const Step&, Observation*) {}
  /// Before each step: how full the scene's cavities are to be, 1: full. Simulation thread.
  virtual void fill_cavities(std::span<double> /*shares*/) {}

  /// Its own actions.
  virtual std::span<const Action> actions() const = 0;
  /// The one that button 1 asks for now, which is the one that begins where the exercise does so by itself.
  virtual Action trigger() const = 0;
  /// Why `action`, one of actions(), cannot be done; empty: it can.
  virtual std::string reason_against(Action action, const Situation& now) const = 0;
  /// Does it. What happened goes to `events`. The course enters the stage of sampling unless the action only stops.
  virtual void act(Action action, const Situation& now, Events& events) = 0;
  virtual bool only_stops(Action) const { return false; }
  /// Session time passes.
  virtual void pass(double /*elapsed_s*/) {}
  /// What follows by itself, unless the session is paused.
  virtual void go_on(const Situation&, Events&) {}
  /// In the stage of sampling: the needle is ready again and more is wanted, so the course goes back.
  virtual bool wants_more(const Situation&) const { return false; }
  /// The trainee has finished: ends what is under way.
  virtual void finish(const Situation&, Events&) {}
  /// Results of what was done before, as they come in.
  virtual void catch_up(const Situation&, Events&) {}

  /// Samples taken, for the scenario's hints.
  virtual int samples() const { return 0; }
  /// How often the instrument has kicked the hand that holds it.
  virtual std::uint32_t recoils() const { return 0; }
  /// What to do now: one sentence.
  virtual std::string prompt(const PromptInput& input) const = 0;
  /// Adds what it shows to the pictures.
  virtual void show(state::FrameState&) const {}
  /// What was sampled or destroyed, some lines for the terminal; empty: nothing.
  virtual std::string result_in_words() const { return {}; }
};

/// The same of a recorded session: from its events and the steps of its replay.
class ProcedureReplay {
public:
  virtual ~ProcedureReplay() = default;
  /// A step of the replay. The replay's thread.
  virtual void observe(const Step&, const Situation&) {}
  /// What was to be seen at a time of the session, as far as the replay has come. One thread, which may be another
  /// than the replay's; going back in time is allowed.
  virtual void show_at(double time_s, state::FrameState& frame) = 0;
};

/// An event as the debrief tells it.
struct DebriefEntry {
  std::string title{};
  std::string detail{};
};

/// A moment worth a picture, and in what words.
struct Still {
  double time_s = 0;
  std::string_view words{};  ///< "at the end of the heating"
};

class Kind {
public:
  virtual ~Kind() = default;
  /// Value of "kind" in a scenario's "sampling".
  virtual std::string_view name() const = 0;
  /// Reads the keys of "sampling" that are the kind's own, and fills those of the base that are for pictures.
  virtual std::unique_ptr<content::ProcedurePlan> read(files::JsonObject& sampling) const = 0;
  /// Its own keys of "sampling".
  virtual std::vector<files::Key> keys() const = 0;

  /// @param scene  outlives what is made
  virtual std::unique_ptr<Procedure> begin(const content::Scene& scene) const = 0;
  virtual std::unique_ptr<ProcedureReplay> replay(const content::Scene&,
                                                  std::span<const recording::EventRecord>) const {
    return nullptr;
  }

  /// Name of the event that ends the approach: the needle is where the trainee wanted it.
  virtual std::string_view approach_event() const = 0;
  virtual std::span<const content::MetricRow> metrics() const { return {}; }
  /// Value of a metric of its own; none: nothing there to measure it on.
  virtual std::optional<double> measure(std::string_view /*metric*/, std::span<const recording::EventRecord>,
                                        const content::Scene&) const {
    return std::nullopt;
  }

  /// The stage of sampling in a debrief.
  virtual std::string_view sampling_title() const { return "Sampling"; }
  /// Of an event that is a step of the procedure: its title is a mark on the time line and a moment for a picture.
  virtual std::optional<DebriefEntry> describe_step(const recording::EventRecord&) const { return std::nullopt; }
  /// Of an event that says what came of a step.
  virtual std::optional<DebriefEntry> describe_result(const recording::EventRecord&) const { return std::nullopt; }
  /// What an event of its own sounds like.
  virtual std::optional<sound::Cue> cue_of(const recording::EventRecord&) const { return std::nullopt; }
  /// The moment that shows what was done. The events lie in [from_s, to_s]; none: nothing was.
  virtual std::optional<Still> still(std::span<const recording::EventRecord>, double /*from_s*/,
                                     double /*to_s*/) const {
    return std::nullopt;
  }
};

}  // namespace stylet::procedures
