// A factorisation that takes ten simulation steps: nobody waits for it, and the rest is the same equilibrium.
#include "physics/messages/latest_value.h"
#include "tests/support/r1.h"
#include "tests/support/sanitized.h"
#include "tests/validation/coupling_monolithic.h"
#include "tests/validation/residual.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <thread>
#include <vector>

namespace stylet::validation {
namespace {

using reference::ReferenceExperiment;
using reference::ReferenceInsertion;
using Clock = std::chrono::steady_clock;

constexpr int kSlowness = 10;                            // simulation steps a factorisation
constexpr double kRest = support::kSanitized ? 2.5 : 3;  // s, after the motion; several factorisations, however late

ReferenceInsertion insertion_at_hand() {
  ReferenceInsertion insertion = support::r1();
  if (support::kSanitized) {
    insertion.nodes_per_edge = 4;
    insertion.haptic_hz = 250;
    insertion.contact_spacing = 0.02;  // no denser than the tetrahedra, or the exact rows depend on each other
  }
  return insertion;
}

void expect_equilibrium(const ReferenceInsertion& insertion, const physics::NeedleState& needle,
                        const Eigen::Matrix3Xd& tissue) {
  const Distance off = distance_from_equilibrium(insertion, insertion.base(insertion.duration), needle, tissue);
  ASSERT_LT(off.newton, 1e-12);
  ASSERT_GT(off.newtons, 0.1);
  report_residual("needle off the equilibrium", off.needle, 1e-8);
  report_residual("tissue off the equilibrium", off.tissue, 1e-8);
  report_residual("felt against carried by the support", off.force, 1e-8);
}

double median_ms(std::vector<double> seconds) {
  const auto middle = seconds.begin() + std::ssize(seconds) / 2;
  std::nth_element(seconds.begin(), middle, seconds.end());
  return 1e3 * *middle;
}

TEST(SlowWorker, LockstepLoopTakesEveryStepWithTheFactorItHasAndReportsItsAge) {
  const ReferenceInsertion insertion = insertion_at_hand();
  ReferenceExperiment experiment(insertion, {.worker_period = kSlowness});
  std::uint64_t steps = 0;
  std::uint64_t epoch = 0;
  std::uint64_t oldest = 0;
  int taken = 0;
  int requested = 0;
  while (experiment.time_s() < insertion.duration + kRest) {
    experiment.advance();
    const physics::SimulationReport& report = experiment.report();
    ++steps;
    ASSERT_EQ(report.step, steps);
    ASSERT_EQ(report.flags, 0U);
    ASSERT_EQ(experiment.patch().factor_epoch, report.factor_epoch);
    ASSERT_EQ(report.factor_epoch > epoch, report.factorisation_taken);  // newer exactly when one was swapped in
    epoch = report.factor_epoch;
    oldest = std::max(oldest, report.step - report.factor_epoch);
    taken += report.factorisation_taken;
    requested += report.factorisation_requested;
  }
  std::printf("  %d of %llu steps got a new factor, the oldest in use was %llu steps old\n", taken,
              static_cast<unsigned long long>(steps), static_cast<unsigned long long>(oldest));
  EXPECT_EQ(taken, int((steps - 1) / kSlowness));
  EXPECT_LE(requested, taken + 1);  // one outstanding at a time
  EXPECT_GE(oldest, std::uint64_t(kSlowness));
  EXPECT_LE(oldest, std::uint64_t(2 * kSlowness));
  expect_equilibrium(insertion, experiment.needle(), experiment.simulation().tissue().positions[0]);
}

/// A thread that repeats a step until it is destroyed: joined however the scope is left.
class Thread {
public:
  template <typename Step>
  explicit Thread(Step step)
      : thread_([this, step]() mutable {
          while (!stop_.load(std::memory_order_relaxed)) step();
        }) {}
  ~Thread() {
    stop_ = true;
    thread_.join();
  }
  Thread(const Thread&) = delete;
  Thread& operator=(const Thread&) = delete;

private:
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

// The worker gives each factor only once the simulation has taken ten more steps: were one step to wait for it, the
// test would never end. The haptic loop runs freely beside both; the stylus moves by the clock of the simulation.
TEST(SlowWorker, ThreadedLoopsNeverWaitAndComeToRestInTheSameEquilibrium) {
  const ReferenceInsertion insertion = insertion_at_hand();
  std::vector<physics::SimulationBody> bodies;
  bodies.push_back(insertion.body());
  physics::SimulationLoop simulation(
      std::move(bodies), {.dt = 1 / insertion.simulation_hz, .contact_spacing = insertion.contact_spacing});
  physics::HapticLoopSettings settings;
  settings.needle = insertion.needle;
  settings.relative_compliance = 0;
  physics::HapticLoop haptic(settings, insertion.base(0));
  physics::LatestValue<physics::TissuePatch> patches(simulation.make_patch());
  physics::LatestValue<physics::NeedleState> needles(haptic.state());

  const int ratio = insertion.haptic_steps_per_simulation_step();
  const auto steps = std::uint64_t((insertion.duration + kRest) * insertion.simulation_hz);
  std::atomic<std::uint64_t> haptic_steps{0};
  std::atomic<std::uint64_t> simulation_steps{0};
  std::atomic<std::uint64_t> taken{0};
  // The simulation thread's until it is joined:
  std::uint64_t beside_work = 0;
  std::uint64_t oldest = 0;
  std::vector<double> simulation_s;
  std::vector<double> haptic_s;
  {
    const Thread worker([&, asked = std::uint64_t{0}, busy = false]() mutable {
      const std::uint64_t now = simulation_steps.load();
      if (!busy && !simulation.worker().idle()) {
        busy = true;
        asked = now;
      }
      if (busy && now >= asked + kSlowness) {
        simulation.worker().step();
        busy = false;
      }
      std::this_thread::yield();
    });
    const Thread low_rate([&] {
      if (haptic_steps.load() < std::uint64_t(ratio) * simulation_steps.load()) return std::this_thread::yield();
      needles.update();
      beside_work += !simulation.worker().idle();
      const Clock::time_point begin = Clock::now();
      const physics::SimulationReport report = simulation.step({.needle = &needles.front()}, patches.back());
      simulation_s.push_back(std::chrono::duration<double>(Clock::now() - begin).count());
      patches.publish();
      taken += report.factorisation_taken;
      oldest = std::max(oldest, report.step - report.factor_epoch);
      ++simulation_steps;
    });
    double time_s = 0;
    // However little the worker is let run: four factors, then as long a rest as ever.
    const auto rest = std::uint64_t(kRest * insertion.simulation_hz);
    constexpr auto kNotYet = std::numeric_limits<std::uint64_t>::max();
    std::uint64_t end = kNotYet;
    while (simulation_steps.load() < end) {
      if (end == kNotYet && taken.load() >= 4) end = std::max(steps, simulation_steps.load() + rest);
      const double now_s = double(simulation_steps.load() + 1) / insertion.simulation_hz;
      time_s = std::min(time_s + 1 / insertion.haptic_hz, now_s);
      patches.update();
      const Clock::time_point begin = Clock::now();
      haptic.step(insertion.base(time_s), 1 / insertion.haptic_hz, patches.front());
      haptic_s.push_back(std::chrono::duration<double>(Clock::now() - begin).count());
      physics::copy_state(haptic.state(), needles.back());
      needles.publish();
      ++haptic_steps;
    }
  }
  std::printf(
      "  %zu simulation steps (median %.2f ms), %llu of them beside a factorisation; %llu factors taken, the "
      "oldest in use %llu steps old; %zu haptic steps (median %.3f ms)\n",
      simulation_s.size(), median_ms(simulation_s), static_cast<unsigned long long>(beside_work),
      static_cast<unsigned long long>(taken.load()), static_cast<unsigned long long>(oldest), haptic_s.size(),
      median_ms(haptic_s));
  EXPECT_GE(beside_work, (kSlowness - 1) * taken);
  EXPECT_GE(oldest, std::uint64_t(kSlowness));
  EXPECT_GE(haptic_s.size(), std::size_t(ratio) * (steps - 1));
  // A step that waited for a factor would take ten periods, a haptic step that waited for a patch one simulation
  // step.
  EXPECT_LT(median_ms(simulation_s), kSlowness * 1e3 / insertion.simulation_hz);
  EXPECT_LT(median_ms(haptic_s), median_ms(simulation_s));
  expect_equilibrium(insertion, haptic.state(), simulation.tissue().positions[0]);
}

}  // namespace
}  // namespace stylet::validation
