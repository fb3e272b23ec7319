// Runs of the coupling `stylet` along the reference insertion, and straight there and back.
#pragma once

#include "tests/support/r1.h"
#include "tests/support/sanitized.h"
#include "tools/reference/reference_insertion.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

namespace stylet::bench {

/// With a sanitizer R1 until before its first withdrawal.
inline reference::ReferenceInsertion r1() {
  reference::ReferenceInsertion insertion = support::r1();
  if (support::kSanitized) insertion.duration = 1.2;
  return insertion;
}

/// Liver and its capsule, after Okamura et al. 2004.
inline physics::InsertionResistance liver() {
  return {.puncture_force = 1.8, .cutting_force = 0.94, .cutting_viscosity = 2, .friction_per_length = 18};
}

inline std::shared_ptr<const physics::TissueMap> tissue(const physics::InsertionResistance& resistance) {
  auto map = std::make_shared<physics::TissueMap>();
  map->tissues[1] = resistance;
  return map;
}

/// Straight on, without the sideways motion; back out altogether or in part, and in again.
inline reference::ReferenceInsertion there_and_back(double depth, double back_to) {
  reference::ReferenceInsertion insertion = r1();
  insertion.lateral_amplitude = 0;
  const double v = 0.045;
  const double in = depth / v, out = (depth - back_to) / v;
  insertion.axial_speed = {{0, v},
                           {in, v},
                           {in + 0.02, -v},
                           {in + out, -v},
                           {in + out + 0.02, v},
                           {in + 2 * out, v},
                           {in + 2 * out + 0.02, 0},
                           {in + 2 * out + 0.2, 0}};
  insertion.duration = in + 2 * out + 0.2;
  return insertion;
}

struct Sample {
  double time = 0, force = 0, tip = 0, depth = 0, work = 0;  // force on the hand along -x: positive pushes back
  physics::TipState state = physics::TipState::outside;
  std::uint32_t punctures = 0;
};

/// @param allowed  NeedleFlag bits that may be raised
inline std::vector<Sample> run(const reference::ReferenceInsertion& insertion,
                               const reference::ReferenceRun& settings, std::uint32_t allowed = 0) {
  reference::ReferenceExperiment experiment(insertion, settings);
  std::vector<Sample> samples;
  while (experiment.time_s() < insertion.duration - 1e-9) {
    experiment.simulation_step();
    for (int i = 0; i < insertion.haptic_steps_per_simulation_step(); ++i) {
      experiment.haptic_step();
      const physics::NeedleState& s = experiment.needle();
      samples.push_back({.time = experiment.time_s(),
                         .force = -s.wrench.force.x(),
                         .tip = s.positions(0, s.node_count - 1),
                         .depth = s.tip_depth,
                         .work = s.hand_work,
                         .state = s.tip,
                         .punctures = s.puncture_count});
    }
  }
  EXPECT_EQ(experiment.needle_flags() & ~allowed, 0U);
  return samples;
}

/// The deepest sample of the first way in.
inline std::vector<Sample>::const_iterator turning_point(const std::vector<Sample>& samples) {
  return std::adjacent_find(samples.begin() + 200, samples.end(),
                            [](const Sample& a, const Sample& b) { return b.tip < a.tip - 1e-5; });
}

}  // namespace stylet::bench
