// The thread the haptic loop runs on.
#pragma once

#include "haptic/paced_loop.h"

#include <functional>
#include <string>
#include <thread>

namespace stylet::haptic {

struct RealTimeSettings {
  double rate_hz = 1000;
  int fifo_priority = 80;   ///< SCHED_FIFO priority; 0: keep the ordinary scheduler
  bool lock_memory = true;  ///< mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) for the whole process
  int cpu = -1;             ///< bind to this processor, -1: any
  int most_behind = 0;      ///< steps that are caught up with when late (run_paced)
};

/// Runs a callable at a fixed rate (run_paced) under SCHED_FIFO with memory locked and denormals flushed. Where the
/// system refuses one of these the thread runs all the same and warning() says what is missing and what to do. The
/// thread sleeps between steps: one that spun under SCHED_FIFO would be stopped by the kernel for 50 ms each second.
class RealTimeThread {
public:
  /// Starts the thread; returns once it is configured and about to make its first step.
  /// @param step  called on the thread; must not throw, lock, allocate or block
  RealTimeThread(const RealTimeSettings& settings, std::function<void(const StepTiming&)> step);
  /// Stops and joins.
  ~RealTimeThread();
  RealTimeThread(const RealTimeThread&) = delete;
  RealTimeThread& operator=(const RealTimeThread&) = delete;

  /// Asks for the stop and waits for the step in progress. May be called twice.
  void stop();
  /// One line, empty when everything was granted.
  const std::string& warning() const { return warning_; }
  /// Live while the thread runs, final after stop().
  const LoopStatistics& statistics() const { return statistics_; }

private:
  LoopStatistics statistics_;
  std::string warning_;
  std::jthread thread_;
};

}  // namespace stylet::haptic
