// The patient holds the breath when asked to.
#pragma once

#include "engine/content/scene.h"
#include "engine/session/coupled_loops.h"

#include <atomic>
#include <cstdint>
#include <optional>

namespace stylet::session {

/// Breathes as the scene says but for its holds, which are made for its recorded motion. Asked for it, the patient
/// breathes out to the end and holds: there sin^4 of the breath's phase has no slope, so the organs come to rest
/// without a jerk and set out again in the same way. Let go, or after kLongest, the patient breathes on from there,
/// one whole breath at least before the next hold. The simulation steps of the recording have the breath, so a replay
/// needs none of this.
class HeldBreath final : public StepListener {
public:
  enum class State : std::uint8_t {
    breathing,
    breathing_out,  ///< asked to hold, until the end of this breath
    held,
  };

  /// @param buttons  of the stylus that ask, a bit each; 0: none does
  explicit HeldBreath(content::Breathing breathing, std::uint32_t buttons = 0);

  /// There is a breath to be held.
  bool breathes() const;
  /// Window thread: asks to hold it, or to breathe on.
  void ask(bool hold);
  /// Window thread: as it was at the last simulation step, or has been asked for since.
  State state() const;
  /// Window thread: how often the stylus's button was pressed since this was asked before.
  std::uint32_t take_presses() { return presses_.exchange(0, std::memory_order_relaxed); }
  /// Window thread: until it ends by itself, s; of one that is not held yet, all of kLongest.
  double left_s() const { return left_s_.load(std::memory_order_relaxed); }

  std::optional<double> inspiration(double time_s) override;
  /// @realtime
  void haptic_stepped(const recording::HapticStepRecord& record, const physics::NeedleState& needle) override;

  /// s; an engineering value: most patients hold a breath at end-expiration for 15 to 20 s.
  static constexpr double kLongest = 20;

private:
  content::Breathing breathing_;
  std::atomic<bool> asked_{false};
  std::atomic<bool> held_{false};
  std::atomic<double> left_s_{kLongest};
  std::atomic<std::uint32_t> presses_{0};
  const std::uint32_t buttons_;
  bool pressed_ = false;  // haptic thread's
  // Simulation thread's.
  double lost_s_ = 0;  // of the breathing, held so far
  double last_s_ = 0;
  double since_s_ = 0;  // of the hold under way
  bool holding_ = false;
};

}  // namespace stylet::session
