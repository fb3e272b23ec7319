// What there is to tell of a running session: its course, and what follows from its frames (SessionWatch).
#pragma once

#include "engine/content/scene.h"
#include "engine/content/texts.h"
#include "engine/figures/force_trace.h"
#include "engine/training/training_session.h"

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace stylet::panels {

enum class Concern : std::uint8_t { note, caution, danger };

/// A line for the instructor.
struct Warning {
  Concern concern = Concern::note;
  std::string text;
};

/// SI.
struct SessionFacts {
  std::string title{};                  ///< of the scenario
  std::string stage{};                  ///< "procedure"
  std::string prompt{};                 ///< what to do now, some lines
  std::string hint{};                   ///< for learners; empty: none
  std::string breath{};                 ///< what the patient does with it when asked; empty: nothing
  std::vector<std::string> briefing{};  ///< paragraphs, shown before the start
  double time_s = 0;
  bool paused = false;
  double insertion_depth = 0;               ///< m of needle in tissue
  double force = 0;                         ///< N, on the hand
  double force_scale = 1;                   ///< of it that the stylus is given
  double probe_force = 0;                   ///< N
  std::optional<double> target_distance{};  ///< m, tip to the target's centre
  std::optional<double> out_of_plane{};     ///< m, tip from the image plane, signed
  std::string tissue{};                     ///< at the tip
  std::vector<Warning> warnings{};
  std::span<const figures::ForceSample> force_curve{};
};

/// What people read of it in another language.
void translate(SessionFacts& facts, const content::Texts& texts);

/// Title and course. @param course  null: there is none
SessionFacts facts_of(const content::Scene& scene, const training::TrainingSession* course);

}  // namespace stylet::panels
