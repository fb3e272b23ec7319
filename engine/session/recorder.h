// Puts a session on record while it runs.
#pragma once

#include "engine/recording/recording_writer.h"
#include "engine/session/coupled_loops.h"
#include "engine/session/step_hash.h"

#include <array>
#include <numbers>
#include <span>

namespace stylet::session {

/// Writes every step, and the chained hash of each loop every so many steps. `hash` must be told of a step before
/// this. Events: "entered" and "left" (a body), "puncture" (puncture_event.h), "buttons", "needle_bent" by so
/// many degrees in all, at first and whenever it is kBendStep more; of a device that renders force, "safety" with the
/// name of an OutputFlag when a limit acts that has not acted for kQuiet.
class Recorder final : public StepListener {
public:
  static constexpr std::uint64_t kHapticStepsPerHash = 100;
  static constexpr std::uint64_t kSimulationStepsPerHash = 10;

  static constexpr const char* kSafetyEvent = "safety";
  static constexpr const char* kSafetyLimit = "limit";  ///< its field: the name of the OutputFlag
  static constexpr double kQuiet = 0.5;                 ///< s
  static constexpr const char* kBentEvent = "needle_bent";
  static constexpr const char* kBentBy = "by";                 ///< its field, degrees
  static constexpr double kBendStep = std::numbers::pi / 180;  ///< rad

  Recorder(recording::RecordingWriter& writer, const StepHash& hash, const content::Scene& scene)
      : writer_(writer), hash_(hash), scene_(scene) {}

  void haptic_stepped(const recording::HapticStepRecord& record, const physics::NeedleState& needle) override;
  void simulation_stepped(const recording::SimulationStepRecord& record, const physics::SimulationReport& report,
                          const physics::TissueState&, const physics::NeedleState&) override;
  void force_sent(double time_s, std::uint64_t step, const haptic::GuardedWrench& out) override;
  /// Writes the final hashes. The loops must have stopped.
  void finish();

private:
  static constexpr std::array<double, haptic::kOutputFlagCount> never() {
    std::array<double, haptic::kOutputFlagCount> times{};
    times.fill(-1e300);
    return times;
  }

  recording::RecordingWriter& writer_;
  const StepHash& hash_;
  const content::Scene& scene_;
  std::uint64_t haptic_step_ = 0;
  std::uint64_t simulation_step_ = 0;
  bool inside_ = false;
  std::uint32_t punctures_ = 0;
  std::uint32_t buttons_ = 0;
  double bent_ = 0;                                                   // as told last, rad
  std::array<double, haptic::kOutputFlagCount> limited_s_ = never();  // when each last acted
};

/// Most that a recording's events say the needle was bent by, degrees; 0: it was not.
double needle_bent_deg(std::span<const recording::EventRecord> events);

}  // namespace stylet::session
