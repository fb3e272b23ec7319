// What of a session is to be heard: the same of one that runs and of one that was recorded.
#pragma once

#include "engine/content/scene.h"
#include "engine/recording/event.h"
#include "engine/sound/cue.h"
#include "engine/training/trace.h"
#include "physics/messages/messages.h"

#include <Eigen/Core>

#include <cstdint>
#include <optional>
#include <vector>

namespace stylet::training {

/// Of a simulation step after the other: bone, warnings and the breath. One thread.
class Ear {
public:
  /// Keeps a reference to `scene`.
  explicit Ear(const content::Scene& scene) : scene_(scene) {}
  /// Goes on to a sample, later than the one before. @param[out] cues  appended to
  void step(const TraceSample& sample, std::vector<sound::Cue>& cues);

  static constexpr double kHardPush = 6;      ///< N on the hand: warns, and again after it was below kEased
  static constexpr double kEased = 5;         ///< N
  static constexpr double kKnockAgain = 0.3;  ///< s between two knocks on bone at least
  static constexpr double kWarnAgain = 1.5;   ///< s between two warnings at least
  static constexpr double kFastTip = 0.05;    ///< m/s; meets bone as loudly as can be
  static constexpr double kFullFlow = 1.2;    ///< full inspirations a second: more than quiet breathing has

private:
  bool warns(const TraceSample& sample);

  const content::Scene& scene_;
  std::optional<TraceSample> before_;
  bool on_bone_ = false;
  bool pushed_ = false;
  double knocked_s_ = -kKnockAgain;
  double warned_s_ = -kWarnAgain;
};

/// A puncture, louder the harder the tip was pushed.
sound::Cue cue_of(double time_s, const physics::Puncture& puncture);
/// What an event sounds like: a puncture, an action that was refused, a step of a procedure; none: like nothing.
std::optional<sound::Cue> cue_of(const recording::EventRecord& event);

/// All that is heard of a session, times ascending.
std::vector<sound::Cue> cues_of(const content::Scene& scene, const Trace& trace);

}  // namespace stylet::training
