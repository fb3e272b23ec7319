// Nobody waits: a thread that is held for as long as the test likes holds nobody else. Counted in steps, not timed;
// the one clock here is how long the test itself waits before it gives up on loops that do not get on.
#include "physics/messages/latest_value.h"
#include "tests/support/r1.h"
#include "tests/support/sanitized.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdio>
#include <latch>
#include <thread>
#include <vector>

namespace stylet::validation {
namespace {

using reference::ReferenceInsertion;

constexpr std::uint64_t kSimulationSteps = support::kSanitized ? 60 : 300;  // beside one factorisation
constexpr std::uint64_t kHapticSteps = support::kSanitized ? 500 : 5000;    // beside one simulation step
constexpr std::chrono::seconds kGiveUp{60};

ReferenceInsertion short_insertion() {
  ReferenceInsertion insertion = support::r1();
  if (support::kSanitized) {
    insertion.nodes_per_edge = 4;
    insertion.haptic_hz = 250;
    insertion.contact_spacing = 0.02;
  }
  return insertion;
}

/// Both loops and what is between them, as a session has them; each step is for a thread of the test's choice.
struct Loops {
  explicit Loops(const ReferenceInsertion& r1)
      : insertion(r1),
        simulation(bodies(r1), {.dt = 1 / r1.simulation_hz, .contact_spacing = r1.contact_spacing}),
        haptic({.needle = r1.needle, .base = {}, .relative_compliance = 0}, r1.base(0)),
        patches(simulation.make_patch()),
        needles(haptic.state()) {}

  static std::vector<physics::SimulationBody> bodies(const ReferenceInsertion& r1) {
    std::vector<physics::SimulationBody> result;
    result.push_back(r1.body());
    return result;
  }
  /// Up to, and without, the publication of the patch that it has filled.
  physics::SimulationReport simulation_step() {
    needles.update();
    return simulation.step({.needle = &needles.front(), .time_s = haptic.state().time_s}, patches.back());
  }
  void haptic_step() {
    patches.update();
    const double time_s = double(haptic.state().step + 1) / insertion.haptic_hz;
    haptic.step(insertion.base(time_s), 1 / insertion.haptic_hz, patches.front());
    physics::copy_state(haptic.state(), needles.back());
    needles.publish();
  }
  /// Both in turn, in this thread, until the needle is held by several contacts.
  void insert() {
    while (haptic.state().contact_count < 2) {
      simulation_step();
      patches.publish();
      for (int i = 0; i < insertion.haptic_steps_per_simulation_step(); ++i) haptic_step();
    }
  }

  ReferenceInsertion insertion;
  physics::SimulationLoop simulation;
  physics::HapticLoop haptic;
  physics::LatestValue<physics::TissuePatch> patches;
  physics::LatestValue<physics::NeedleState> needles;
};

/// Waits until `counter` is there, or not for ever: true if it is.
bool reaches(const std::atomic<std::uint64_t>& counter, std::uint64_t target) {
  const auto end = std::chrono::steady_clock::now() + kGiveUp;
  while (counter.load() < target) {
    if (std::chrono::steady_clock::now() > end) return false;
    std::this_thread::yield();
  }
  return true;
}

// A factorisation that never ends: the worker has seen the request and is held. A simulation step that waited for
// it, even a single one, would leave the count short.
TEST(HeldThread, TheSimulationTakesAllItsStepsBesideAFactorisationThatDoesNotEnd) {
  Loops loops(short_insertion());
  std::latch opened(1);
  std::atomic<bool> held{false};
  std::atomic<bool> factorised{false};
  std::atomic<std::uint64_t> steps{0};
  std::uint64_t requested = 0;
  std::uint64_t taken = 0;
  std::uint64_t epochs = 0;  // those of factors, of all steps beside the held worker
  std::jthread worker([&](const std::stop_token& stop) {
    while (loops.simulation.worker().idle()) {
      if (stop.stop_requested()) return;
      std::this_thread::yield();
    }
    held = true;
    opened.wait();
    factorised = loops.simulation.worker().step();
  });
  std::jthread both_loops([&] {
    while (steps.load() < kSimulationSteps) {
      const physics::SimulationReport report = loops.simulation_step();
      loops.patches.publish();
      requested += report.factorisation_requested;
      taken += report.factorisation_taken;
      epochs += report.factor_epoch;
      for (int i = 0; i < loops.insertion.haptic_steps_per_simulation_step(); ++i) loops.haptic_step();
      ++steps;
    }
  });
  EXPECT_TRUE(reaches(steps, kSimulationSteps)) << "only " << steps.load() << " steps beside the held worker";
  EXPECT_FALSE(factorised.load());
  opened.count_down();  // also where it failed: then the loops are let go, and joined
  both_loops.join();
  worker.join();
  std::printf("  %llu simulation steps beside one factorisation that did not end\n",
              static_cast<unsigned long long>(steps.load()));
  EXPECT_TRUE(held.load());
  EXPECT_EQ(requested, 1U);
  EXPECT_EQ(taken, 0U);
  EXPECT_EQ(epochs, 0U);  // all with the factor of the rest state
  EXPECT_TRUE(factorised.load());
  EXPECT_TRUE(loops.simulation_step().factorisation_taken);  // the next step has it
}

// A simulation step that never ends: the thread is held where it has taken a needle state and filled a patch, between
// its two buffers. The haptic loop goes on with the patch it has, and its needle states are published all the same.
TEST(HeldThread, TheHapticLoopTakesAllItsStepsBesideASimulationStepThatDoesNotEnd) {
  Loops loops(short_insertion());
  loops.insert();
  const std::uint64_t epoch = loops.patches.front().epoch;
  const std::uint64_t first = loops.haptic.state().step;
  std::latch opened(1);
  std::atomic<bool> held{false};
  std::atomic<std::uint64_t> steps{0};
  std::uint64_t of_that_patch = 0;
  std::uint64_t flags = 0;
  std::jthread low_rate([&] {
    loops.needles.update();
    loops.simulation.step({.needle = &loops.needles.front()}, loops.patches.back());
    held = true;
    opened.wait();
    loops.patches.publish();
  });
  std::jthread high_rate([&] {
    while (!held.load()) std::this_thread::yield();
    while (steps.load() < kHapticSteps) {
      loops.haptic_step();
      of_that_patch += loops.haptic.state().patch_epoch == epoch;
      flags |= loops.haptic.state().flags;
      ++steps;
    }
  });
  EXPECT_TRUE(reaches(steps, kHapticSteps)) << "only " << steps.load() << " steps beside the held simulation";
  opened.count_down();
  high_rate.join();
  low_rate.join();
  std::printf("  %llu haptic steps beside one simulation step that did not end, with %d contacts\n",
              static_cast<unsigned long long>(steps.load()), loops.haptic.state().contact_count);
  EXPECT_EQ(of_that_patch, kHapticSteps);
  EXPECT_EQ(flags, 0U);
  EXPECT_EQ(loops.haptic.state().step, first + kHapticSteps);
  EXPECT_TRUE(loops.needles.update());  // the latest of all those states
  EXPECT_EQ(loops.needles.front().step, first + kHapticSteps);
  loops.haptic_step();  // and with the patch let go, the next step has it
  EXPECT_EQ(loops.haptic.state().patch_epoch, epoch + 1);
}

}  // namespace
}  // namespace stylet::validation
