// The course of a training session: briefing, procedure, sampling, debrief. A state machine without clock, device or
// file: what it is told decides what it does.
//
//   briefing ──start──▶ procedure ──an action of the kind──▶ sampling ──finish──▶ debrief
//                           ◀──── ready again, while more is wanted ────┘
//   finish leads to the debrief from any stage but the briefing; reset ends the session from anywhere.
#pragma once

#include "engine/content/exercise.h"
#include "engine/procedures/interface/procedure.h"

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace stylet::training {

using procedures::Action;
using procedures::Events;
using procedures::Situation;
using procedures::Stage;

/// As in events and scenarios: "briefing".
const char* stage_name(Stage stage);

/// Names of the events that a flow makes (recording::EventRecord::name).
namespace flow_event {
inline constexpr std::string_view kStage = "stage";  ///< field: stage
inline constexpr std::string_view kPaused = "paused";
inline constexpr std::string_view kResumed = "resumed";
inline constexpr std::string_view kRefused = "refused";  ///< fields: action, reason
inline constexpr std::string_view kReset = "reset";      ///< the trainee begins again
}  // namespace flow_event

/// The stage that an event kStage enters; empty: it is another event.
std::string_view stage_of(const recording::EventRecord& event);

/// What is to be shown.
struct FlowState {
  Stage stage = Stage::briefing;
  double stage_s = 0;  ///< session time since it began
  bool paused = false;
  std::string prompt;             ///< what to do now, one sentence
  std::string hint;               ///< the scenario's; may be empty
  std::string refusal;            ///< why the last action was not done; empty after kRefusalShown and a success
  std::vector<Action> possible;   ///< now; reset is always
  std::optional<Action> trigger;  ///< of the procedure: what button 1 asks for; none: there is no procedure
};

/// @thread one at a time
class Flow {
public:
  /// @param exercise   outlives this
  /// @param automatic  starts by itself: nobody is there to read the briefing, as with a recorded motion
  /// @param procedure  of the exercise, outlives this; null: nothing is sampled or destroyed
  /// @param controls   of the device in use
  Flow(const content::Exercise& exercise, std::size_t targets, bool automatic, procedures::Procedure* procedure,
       procedures::Controls controls = {});

  /// Goes on to the moment of `now`; does what was asked for, in order, then what follows by itself.
  /// @return what happened, for the recording
  Events step(const Situation& now, std::span<const Action> actions);

  const FlowState& state() const { return state_; }
  bool reset_asked_for() const { return reset_; }
  /// Targets that the procedure was done in.
  const std::vector<bool>& treated() const { return treated_; }

  static constexpr double kRestSpeed = 0.003;  ///< m/s; slower is a needle at rest
  static constexpr double kRestTime = 0.25;    ///< s
  static constexpr double kRefusalShown = 4;   ///< s

private:
  /// Why `action` cannot be done now; empty: it can.
  std::string reason_against(Action action, const Situation& now) const;
  void act(Action action, const Situation& now, Events& events);
  void enter(Stage stage, const Situation& now, Events& events);
  void go_on(const Situation& now, Events& events);
  int target_at_tip(const Situation& now) const;
  std::string prompt(const Situation& now) const;
  std::string hint(const Situation& now) const;

  const content::Exercise& exercise_;
  bool automatic_;
  procedures::Procedure* procedure_;
  procedures::Controls controls_;
  FlowState state_;
  std::vector<bool> treated_;
  bool reset_ = false;
  bool went_in_ = false;       // the needle, into the patient
  std::uint32_t presses_ = 0;  // seen
  double now_s_ = 0;
  double stage_began_s_ = 0;
  double resting_s_ = 0;  // for how long the tip has rested
  double refused_s_ = 0;  // when
};

}  // namespace stylet::training
