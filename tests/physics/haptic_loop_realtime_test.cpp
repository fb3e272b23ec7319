// The haptic step takes no memory.
#include "physics/loops/haptic_loop.h"
#include "tests/physics/haptic_loop_synthetic_patch.h"
#include "tests/support/allocation_count.h"
#include "tests/support/r1.h"
#include "tools/reference/led_needle.h"
#include "tools/reference/reference_insertion.h"
#include "tools/reference/two_blocks.h"

#include <gtest/gtest.h>
#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>

namespace stylet::physics {
namespace {

int allocations_in_steps(HapticLoop& loop, const StylusPose& hub, TissuePatch& patch) {
  int allocations = 0;
  for (int i = 0; i < 20; ++i) {
    if (i == 10 && patch.epoch > 0) ++patch.epoch;  // synchronisation counts too
    StylusPose moved = hub;
    moved.position.x() += 1e-4 * i;
    const tests::AllocationCount count;
    loop.step(moved, 1e-3, patch);
    allocations += count.value();
  }
  return allocations;
}

TEST(HapticLoopRealtime, TheWatchSeesAllocations) {
  const tests::AllocationCount count;
  const double* volatile number = new double(1);
  delete number;
  EXPECT_EQ(count.value(), 1);
#ifndef STYLET_SANITIZED
  const Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(7, 7);
  EXPECT_EQ(count.value(), 2) << matrix.rows();
#endif
}

TEST(HapticLoopRealtime, StepTakesNoMemory) {
  for (const int beams : {1, 8, 64}) {
    for (const Coupling coupling : {Coupling::paper_updated, Coupling::paper_trajectory, Coupling::paper_frozen}) {
      HapticLoopSettings settings;
      settings.needle.beams = beams;
      settings.coupling = coupling;
      const StylusPose hub;
      HapticLoop empty(settings, hub);
      TissuePatch nothing;
      EXPECT_EQ(allocations_in_steps(empty, hub, nothing), 0);
      for (const int contacts : {1, 8, 16, 32}) {
        HapticLoop loop(settings, hub);
        TissuePatch patch = testing::synthetic_patch(loop.state(), contacts, 0.4, 0.9);
        EXPECT_EQ(allocations_in_steps(loop, hub, patch), 0) << beams << " beams, " << contacts << " contacts";
        EXPECT_EQ(loop.state().contact_count, contacts);
      }
    }
  }
}

/// Coupling `stylet` through R1 with all that tissue does to a needle: points laid, cut, broken through, slid past,
/// left behind and met again.
TEST(HapticLoopRealtime, TheReferenceInsertionTakesNoMemory) {
  reference::ReferenceInsertion insertion = support::r1();
  auto tissues = std::make_shared<TissueMap>();
  tissues->tissues[1] = {
      .puncture_force = 0.3, .cutting_force = 0.2, .cutting_viscosity = 2, .friction_per_length = 5};
  reference::ReferenceExperiment experiment(insertion, {.coupling = Coupling::stylet, .tissues = tissues});
  const double dt = 1 / insertion.haptic_hz;
  int step = 0, allocations = 0, most_contacts = 0;
  while (step * dt < insertion.duration) {
    experiment.simulation_step();
    for (int i = 0; i < insertion.haptic_steps_per_simulation_step(); ++i) {
      const StylusPose hub = insertion.base(++step * dt);
      const TissuePatch& patch = experiment.patch_in_use();
      const tests::AllocationCount count;
      experiment.haptic().step(hub, dt, patch);
      allocations += count.value();
      most_contacts = std::max(most_contacts, experiment.needle().contact_count);
    }
  }
  EXPECT_EQ(allocations, 0);
  EXPECT_GE(most_contacts, 6);
  EXPECT_EQ(experiment.needle().puncture_count, 1U);
  EXPECT_EQ(experiment.needle().flags, 0U);
}

/// Beyond all limits: tissue cut sideways, the needle bent, its shaft turned.
TEST(HapticLoopRealtime, WhatYieldsTakesNoMemory) {
  reference::ReferenceInsertion insertion = support::r1();
  insertion.needle.yield_strength = 2e8;
  auto tissues = std::make_shared<TissueMap>();
  tissues->tissues[1] = {.cutting_force = 0.2,
                         .friction_per_length = 5,
                         .friction_coefficient = 0.1,
                         .viscous_friction = 50,
                         .side_strength = 20};
  reference::LedNeedle led(insertion, {.coupling = Coupling::stylet, .tissues = tissues});
  led.lead({.along = 0.06}, 0.8);
  int allocations = 0;
  std::optional<tests::AllocationCount> count;
  led.lead_timed(
      {.along = 0.065, .aside = 0.03, .roll = 2}, 0.8, [&] { count.emplace(); },
      [&](const NeedleState&) { allocations += count->value(); });
  EXPECT_EQ(allocations, 0);
  EXPECT_GT(led.needle().damage.side_cut, 1e-6);
  EXPECT_GT(led.needle().damage.bend, 0.01);
  EXPECT_GT(std::abs(led.needle().wrench.moment.x()), 1e-4);
  EXPECT_EQ(led.flags(), 0U);
}

TEST(HapticLoopRealtime, BodiesThatMeetAndPartTakeNoMemory) {
  // Patches come 7 ms after the simulation step that made them: in steps of the haptic loop alone.
  constexpr int kPeriod = 20;
  reference::TwoBlocks blocks({.frequency_hz = 4, .latency_s = 0.007, .gap = 0.002});
  int taken = 0, met = 0;
  for (int i = 0; i < 1500; ++i) {
    if (i % kPeriod == 0) {
      blocks.step();
      met += blocks.report().organs.pressing > 0 ? 1 : 0;
      continue;
    }
    const tests::AllocationCount count;
    blocks.step();
    taken += count.value();
  }
  EXPECT_EQ(taken, 0);
  EXPECT_GT(met, 10);
  EXPECT_LT(met, 70);  // of 75: apart in between
}

TEST(HapticLoopRealtime, RefusalsTakeNoMemory) {
  HapticLoop loop({}, {});
  TissuePatch patch = testing::synthetic_patch(loop.state(), 8);
  patch.bodies[0].w_bar(0, 0)(0, 0) = -1;
  patch.bodies[0].condense();
  StylusPose hub;
  hub.position.y() = 1.0;  // limited base motion, failed solve
  EXPECT_EQ(allocations_in_steps(loop, hub, patch), 0);
  hub.position.y() = std::nan("");
  EXPECT_EQ(allocations_in_steps(loop, hub, patch), 0);
}

}  // namespace
}  // namespace stylet::physics
