// A session in real time: a haptic thread, a simulation thread and a factorisation thread that never wait for each
// other.
#pragma once

#include "engine/session/coupled_loops.h"
#include "engine/session/held_probe.h"
#include "engine/session/run_statistics.h"
#include "engine/session/schedule.h"
#include "engine/session/stylus_step.h"
#include "haptic/device.h"
#include "haptic/real_time_thread.h"
#include "physics/messages/latest_value.h"

#include <atomic>
#include <memory>
#include <semaphore>
#include <thread>
#include <vector>

namespace stylet::session {

struct ThreadedSettings {
  double duration_s = 0;       ///< session time after which the loops stop by themselves; infinity: until stop()
  int fifo_priority = 80;      ///< of the haptic thread
  HeldProbe* probe = nullptr;  ///< moves the probe; null: the scene does
};

/// Starts the threads on construction. What is passed in is theirs until stop().
class ThreadedRun final : public Schedule {
public:
  ThreadedRun(CoupledLoops& loops, haptic::Device& device, const content::Scene& scene,
              const ThreadedSettings& settings);
  ~ThreadedRun() override;
  ThreadedRun(const ThreadedRun&) = delete;
  ThreadedRun& operator=(const ThreadedRun&) = delete;

  void advance(double /*by_s*/) override {}
  double time_s() const override;
  double time_of(std::int64_t clock_ns) const override;
  void pause() override;
  void resume() override;
  bool paused() const override { return clock_state_.load(std::memory_order_acquire) < 0; }
  void click() override { hand_.click(); }
  bool finished() const override { return finished_.load(std::memory_order_acquire); }
  void stop() override;
  RunStatistics statistics() const override;

private:
  struct Pause {
    std::int64_t from_ns;
    std::int64_t length_ns;
  };
  double session_s(std::int64_t clock_state, std::int64_t now_ns) const;
  void haptic_step(const haptic::StepTiming& timing);
  void simulation_step(const haptic::StepTiming& timing);
  void work(const std::stop_token& stop);

  CoupledLoops& loops_;
  ThreadedSettings settings_;
  const content::Scene& scene_;
  haptic::MonotonicClock clock_;
  // Running: the clock at session time 0, ns. Paused: -1 - session time, ns. One word, so that no thread sees half.
  std::atomic<std::int64_t> clock_state_{0};
  std::int64_t began_ns_ = 0;
  std::vector<Pause> pauses_;  // of pause()'s thread
  physics::LatestValue<physics::TissuePatch> patches_;
  physics::LatestValue<physics::NeedleState> needles_;
  StylusStep hand_;
  double last_step_s_ = -1;             // haptic thread's; negative: none yet
  std::int64_t last_step_ns_ = 0;       // haptic thread's, by the clock; 0: none yet
  std::uint32_t needle_flags_ = 0;      // haptic thread's
  Unresolved unresolved_;               // haptic thread's
  std::uint32_t simulation_flags_ = 0;  // simulation thread's
  std::uint32_t patch_flags_ = 0;
  std::uint64_t factorisations_ = 0;
  double end_s_ = 0;  // haptic thread's: time of the last step
  std::atomic<bool> finished_{false};
  std::counting_semaphore<> requests_{0};
  std::jthread worker_;
  std::unique_ptr<haptic::RealTimeThread> simulation_;
  std::unique_ptr<haptic::RealTimeThread> haptic_;
};

}  // namespace stylet::session
