// What a course and its procedure say to each other: stages, actions, the situation, events.
#pragma once

#include "engine/recording/event.h"

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace stylet::procedures {

enum class Stage : std::uint8_t { briefing, procedure, sampling, debrief };

/// Something a trainee asks for, by the name that it has in events. Every course has those below, a kind adds its
/// own.
struct Action {
  std::string_view name;          ///< of a string that lives as long as the program
  std::string_view label = name;  ///< on a button

  bool operator==(const Action& other) const { return name == other.name; }

  static const Action start, pause, resume, reset, finish;
};
inline constexpr Action Action::start{"start", "Begin"};
inline constexpr Action Action::pause{"pause", "Pause"};
inline constexpr Action Action::resume{"resume", "Go on"};
inline constexpr Action Action::reset{"reset", "Try again"};
inline constexpr Action Action::finish{"finish", "Finish"};

/// What the trainee's device has for the steps of a course, in words: "Enter". Empty: it is said without.
struct Controls {
  std::string begin{};
  std::string act{};  ///< fire, heat, draw
  std::string finish{};
};
/// "fire", "Enter": "fire (Enter)".
std::string with_control(std::string_view what, const std::string& control);

/// What a kind takes from a simulation step for whoever follows the course.
struct Observation {
  virtual ~Observation() = default;
};

/// The moment that the course has come to. SI.
struct Situation {
  double time_s = 0;              ///< session time; stands while paused
  std::uint64_t haptic_step = 0;  ///< that the simulation step consumed
  bool in_tissue = false;         ///< the tip
  double depth = 0;               ///< of needle in tissue, m
  double speed = 0;               ///< of the tip against the target, m/s
  double off_plane = 0;           ///< from the tip to the image plane, m
  double force = 0;               ///< on the hand, N
  bool probe_lifted = false;
  std::uint32_t presses = 0;               ///< of button 1 of the stylus since the start
  std::vector<double> target_distances{};  ///< [targets] to the target's surface from what the needle works with, its
                                           ///< tip or bare part, m; negative inside
  const Observation* observation = nullptr;  ///< of the same step; null: the kind takes none

  /// The needle: its tip may be between two organs.
  bool in_patient() const { return in_tissue || depth > 0; }
};

/// The target that is nearest; -1: there is none.
int nearest_target(const Situation& situation);

/// Where the tip is that is in no tissue: "outside the patient, 68 mm from the target".
std::string place_of_free_tip(const Situation& situation);

using Events = std::vector<recording::EventRecord>;

/// An event of this moment.
inline recording::EventRecord event_at(const Situation& now, std::string_view name,
                                       std::vector<recording::Field> fields = {}) {
  return {.time_s = now.time_s, .step = now.haptic_step, .name = std::string(name), .fields = std::move(fields)};
}

}  // namespace stylet::procedures
