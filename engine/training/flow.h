// The course of a training session: briefing, procedure, sampling, debrief. A state machine without clock, device or
// file: what it is told decides what it does.
//
//   briefing ──start──▶ procedure ──fire, ablation_start──▶ sampling ──finish──▶ debrief
//                           ◀──── cocked again, while cores are wanted ────┘
//   finish leads to the debrief from any stage but the briefing; reset ends the session from anywhere.
#pragma once

#include "engine/content/exercise.h"

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace stylet::training {

enum class Stage : std::uint8_t { briefing, procedure, sampling, debrief };
enum class Action : std::uint8_t { start, fire, ablation_start, ablation_stop, pause, resume, reset, finish };
inline constexpr int kActionCount = 8;

/// As in events and scenarios: "briefing", "ablation_start".
const char* stage_name(Stage stage);
const char* action_name(Action action);

/// Names of the events that a flow makes (recording::EventRecord::name).
namespace flow_event {
inline constexpr std::string_view kStage = "stage";                       ///< detail: its name
inline constexpr std::string_view kBiopsyFired = "biopsy_fired";          ///< detail: number of the core
inline constexpr std::string_view kAblationStarted = "ablation_started";  ///< heating begins
inline constexpr std::string_view kAblationStopped = "ablation_stopped";  ///< detail: seconds heated
inline constexpr std::string_view kPaused = "paused";
inline constexpr std::string_view kResumed = "resumed";
inline constexpr std::string_view kRefused = "refused";  ///< detail: action, and why
inline constexpr std::string_view kReset = "reset";      ///< the trainee begins again
}  // namespace flow_event

/// What a flow is told of the session at a moment. SI.
struct FlowInput {
  double time_s = 0;       ///< session time; stands while paused
  bool in_tissue = false;  ///< the tip
  double depth = 0;        ///< of needle in tissue, m
  double speed = 0;        ///< of the tip against the target, m/s
  double off_plane = 0;    ///< from the tip to the image plane, m
  double force = 0;        ///< on the hand, N
  bool probe_lifted = false;
  std::uint32_t presses = 0;               ///< of button 1 of the stylus since the start
  std::vector<double> target_distances{};  ///< [targets] to the target's surface from the tip, of an electrode from
                                           ///< its bare part, m; negative inside
};

struct FlowEvent {
  std::string_view name;  ///< one of flow_event
  std::string detail;
};

/// What is to be shown.
struct FlowState {
  Stage stage = Stage::briefing;
  double stage_s = 0;  ///< session time since it began
  bool paused = false;
  bool heating = false;
  double heated_s = 0;           ///< by the tissue's clock: session time times AblationPlan::time_factor
  int samples = 0;               ///< cores taken
  std::string prompt;            ///< what to do now, one sentence
  std::string hint;              ///< the scenario's; may be empty
  std::string refusal;           ///< why the last action was not done; empty after kRefusalShown and a success
  std::vector<Action> possible;  ///< now; reset is always
};

/// @thread one at a time
class Flow {
public:
  /// @param exercise   outlives this
  /// @param automatic  starts by itself: nobody is there to read the briefing, as with a recorded motion
  Flow(const content::Exercise& exercise, std::size_t targets, bool automatic);

  /// Goes on to the moment of `input`; does what was asked for, in order, then what follows by itself.
  /// @return what happened, for the recording
  std::vector<FlowEvent> step(const FlowInput& input, std::span<const Action> actions);

  const FlowState& state() const { return state_; }
  bool reset_asked_for() const { return reset_; }
  /// Targets that a core was fired in or an ablation begun in.
  const std::vector<bool>& treated() const { return treated_; }

  static constexpr double kRestSpeed = 0.003;  ///< m/s; slower is a needle at rest
  static constexpr double kRestTime = 0.25;    ///< s
  static constexpr double kCocking = 1.0;      ///< s until the gun can be fired again
  static constexpr double kRefusalShown = 4;   ///< s

private:
  using Events = std::vector<FlowEvent>;
  /// Why `action` cannot be done now; empty: it can.
  std::string reason_against(Action action, const FlowInput& input) const;
  void act(Action action, const FlowInput& input, Events& events);
  void enter(Stage stage, double time_s, Events& events);
  void stop_heating(Events& events);
  void go_on(const FlowInput& input, Events& events);
  int target_at_tip(const FlowInput& input) const;
  std::string prompt(const FlowInput& input) const;
  std::string hint(const FlowInput& input) const;

  const content::Exercise& exercise_;
  bool automatic_;
  FlowState state_;
  std::vector<bool> treated_;
  bool reset_ = false;
  std::uint32_t presses_ = 0;  // seen
  double now_s_ = 0;
  double stage_began_s_ = 0;
  double resting_s_ = 0;  // for how long the tip has rested
  double fired_s_ = 0;    // when
  double refused_s_ = 0;  // when
};

}  // namespace stylet::training
