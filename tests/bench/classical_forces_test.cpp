// The classical force models draw the curve they are known for, and say where their numbers come from.
#include "tools/bench/classical_forces.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <set>
#include <string_view>
#include <vector>

namespace stylet::bench {
namespace {

constexpr double kSpeed = 5e-3;  // m/s
constexpr double kDt = 1e-3;

struct Sample {
  double depth;
  double velocity;
  double axial;
};

/// Depth as a function of time, at 1 kHz; velocity by differences.
std::vector<Sample> run(const ClassicalModel& model, double duration, const std::function<double(double)>& depth,
                        double dt = kDt, double diameter = 1.27e-3) {
  std::vector<Sample> samples;
  TrackState state;
  double last = depth(0);
  for (int i = 1; i * dt <= duration; ++i) {
    const double now = depth(i * dt);
    const NeedleMotion motion{.depth = now,
                              .velocity = (now - last) / dt,
                              .inserted_length = std::max(now, 0.0),
                              .deviation = Eigen::Vector2d::Zero(),
                              .diameter = diameter,
                              .dt = dt};
    samples.push_back({now, motion.velocity, model.force(motion, state).axial});
    last = now;
  }
  return samples;
}

/// To 60 mm, out, and in again on the same track.
double in_out_in(double t) {
  const double full = 60e-3 / kSpeed;
  if (t < full) return kSpeed * t;
  if (t < 2 * full) return kSpeed * (2 * full - t);
  return kSpeed * (t - 2 * full);
}
constexpr double kStroke = 60e-3 / kSpeed;

const Sample& at(const std::vector<Sample>& samples, double t) {
  return samples[static_cast<std::size_t>(std::lround(t / kDt)) - 1];
}

const ClassicalModel& model(std::string_view name) {
  for (const ClassicalModel& m : classical_models()) {
    if (m.name == name) return m;
  }
  throw std::runtime_error("no such model");
}

TEST(ClassicalForces, RiseDropAndGrowAlongOneProfile) {
  for (const ClassicalModel& m : classical_models()) {
    SCOPED_TRACE(m.name);
    const auto samples = run(m, kStroke, in_out_in);
    double peak = 0;
    for (const Sample& s : samples) {
      if (s.depth < 6e-3) peak = std::max(peak, s.axial);
    }
    EXPECT_NEAR(peak, 1.8, 0.01);
    double last = 0;
    for (const Sample& s : samples) {  // rises all the way to the puncture
      if (s.depth > 5.9e-3) break;
      EXPECT_GT(s.axial, last);
      last = s.axial;
    }
    const double behind = at(samples, 11e-3 / kSpeed).axial;
    EXPECT_LT(behind, 0.75 * peak);
    EXPECT_GT(behind, 0.94);
    const double slope = (at(samples, 50e-3 / kSpeed).axial - at(samples, 30e-3 / kSpeed).axial) / 20e-3;
    EXPECT_GT(slope, 14);
    EXPECT_LT(slope, 30);
  }
}

TEST(ClassicalForces, OfTheDepthAloneHasNoDirection) {
  for (const ClassicalModel& m : classical_models()) {
    SCOPED_TRACE(m.name);
    const auto samples = run(m, 3 * kStroke, in_out_in);
    const double in = at(samples, 0.5 * kStroke).axial;
    const double out = at(samples, 1.5 * kStroke).axial;
    const double again = at(samples, 2.5 * kStroke).axial;
    if (m.name == "depth_exponential") {
      EXPECT_NEAR(out, in, 1e-9);
      EXPECT_NEAR(again, in, 1e-9);
      continue;
    }
    EXPECT_LT(out, -0.4);                 // friction pulls the hand back in
    EXPECT_NEAR(in - again, 0.94, 1e-9);  // nothing left to cut
  }
}

TEST(ClassicalForces, FrictionTakesWorkOverClosedPaths) {
  for (const std::string_view name : {"okamura", "lugre", "velocity_diameter"}) {
    SCOPED_TRACE(name);
    double work = 0;  // after the insertion: no cutting in it
    for (const Sample& s : run(model(name), 30, [](double t) {
           return t < 10 ? 5e-3 * t : 0.05 - 1e-3 * (1 - std::cos(2 * std::numbers::pi * t));
         })) {
      if (s.depth >= 0.05 - 1e-9 && work == 0) continue;
      work += s.axial * s.velocity * kDt;
    }
    EXPECT_GT(work, 20 * 2 * 2e-3 * 0.5);  // 20 cycles of twice 2 mm at some 0.9 N
  }
}

TEST(ClassicalForces, KarnoppHoldsWhatItHadWithinTheStickBand) {
  TrackState state{.punctured = true, .deepest = 0.05};
  NeedleMotion motion{.depth = 0.04, .velocity = kSpeed, .inserted_length = 0.04};
  const double sliding = okamura_force(motion, state).axial;
  EXPECT_NEAR(sliding, (18.45 + 212 * kSpeed) * 0.04, 1e-12);
  motion.velocity = 0;
  EXPECT_NEAR(okamura_force(motion, state).axial, 18.57 * 0.04, 1e-12);  // its viscous part is gone
  motion.velocity = -0.05e-3;
  EXPECT_NEAR(okamura_force(motion, state).axial, 18.57 * 0.04, 1e-12);
  motion.velocity = -kSpeed;
  EXPECT_NEAR(okamura_force(motion, state).axial, -(17.67 + 293 * kSpeed) * 0.04, 1e-12);
}

// Steady sliding: z' = 0, so f = g(v) + s2 v. From rest: bristles of stiffness s0, before they slip.
TEST(ClassicalForces, LuGreIsElasticBeforeItSlidesAtTheStribeckCurve) {
  constexpr double kLength = 0.05;
  for (const double v : {-20e-3, -1e-3, 0.5e-3, 2e-3, 30e-3}) {
    TrackState state{.punctured = true, .deepest = 1};
    const NeedleMotion motion{.depth = 0.05, .velocity = v, .inserted_length = kLength};
    double f = 0;
    for (int i = 0; i < 40000; ++i) f = lugre_force(motion, state).axial;
    const double g = 18 + 3.6 * std::exp(-(v / 2e-3) * (v / 2e-3));
    EXPECT_NEAR(f, (std::copysign(g, v) + 2000 * v) * kLength, 1e-9);
  }
  TrackState state{.punctured = true, .deepest = 1};
  NeedleMotion slow{.depth = 0.05, .velocity = 1e-6, .inserted_length = kLength};
  for (int i = 0; i < 1000; ++i) lugre_force(slow, state);
  slow.velocity = 0;  // 1 micrometre of presliding
  EXPECT_NEAR(lugre_force(slow, state).axial, 6e4 * 1e-6 * kLength, 0.005 * 6e4 * 1e-6 * kLength);
}

TEST(ClassicalForces, LuGreConvergesWithItsStepAndIsStableAtAny) {
  const auto reversal = [](double t) { return 0.05 + 1e-3 * std::sin(2 * std::numbers::pi * t); };
  const auto last = [&](double dt) {
    TrackState state{.punctured = true, .deepest = 1};
    double f = 0;
    for (int i = 1; i <= std::lround(0.77 / dt); ++i) {
      const double t = i * dt;
      const double v = 2e-3 * std::numbers::pi * std::cos(2 * std::numbers::pi * t);
      f = lugre_force({.depth = reversal(t), .velocity = v, .inserted_length = 0.05, .dt = dt}, state).axial;
    }
    return f;
  };
  const double exact = last(1e-6);
  const double coarse = std::abs(last(2e-4) - exact);
  const double fine = std::abs(last(1e-4) - exact);
  EXPECT_NEAR(coarse / fine, 2, 0.3);  // backward Euler: first order
  TrackState state{.punctured = true, .deepest = 1};
  for (int i = 0; i < 100; ++i) {
    const double f =
        lugre_force({.depth = 0.05, .velocity = i % 2 ? 0.1 : -0.1, .inserted_length = 0.05, .dt = 1}, state).axial;
    EXPECT_LT(std::abs(f), 0.05 * (21.6 + 2000 * 0.1 + 2 * 300 * 0.1));
  }
}

TEST(ClassicalForces, VelocityAndDiameterScaleAsPowers) {
  const auto force = [](double v, double diameter) {
    TrackState state{.punctured = true, .deepest = 1};
    return velocity_diameter_force({.depth = 0.05, .velocity = v, .inserted_length = 0.05, .diameter = diameter},
                                   state)
        .axial;
  };
  EXPECT_NEAR(force(1e-3, 2.54e-3), 2 * force(1e-3, 1.27e-3), 1e-12);
  EXPECT_NEAR(force(32e-3, 1e-3) / force(1e-3, 1e-3), std::sqrt(2), 1e-12);
  EXPECT_EQ(force(-1e-3, 1e-3), -force(1e-3, 1e-3));
  EXPECT_EQ(force(0, 1e-3), 0);
}

TEST(ClassicalForces, TheTrackPullsTheShaftBackOnceThereIsOne) {
  const Eigen::Vector2d deviation(1e-3, -2e-3);
  TrackState state;
  EXPECT_EQ(lugre_force({.depth = 1e-3, .inserted_length = 1e-3, .deviation = deviation}, state).lateral.norm(), 0);
  const auto short_shaft =
      lugre_force({.depth = 0.03, .inserted_length = 0.03, .deviation = deviation}, state).lateral;
  const auto long_shaft =
      lugre_force({.depth = 0.06, .inserted_length = 0.06, .deviation = deviation}, state).lateral;
  EXPECT_LT(short_shaft.dot(deviation), 0);
  EXPECT_LT((long_shaft - 2 * short_shaft).norm(), 1e-15);
  EXPECT_NEAR(short_shaft.norm(), 2e4 * 0.03 * deviation.norm(), 1e-12);
}

TEST(ClassicalForces, EveryConstantHasAUnitAndAnOrigin) {
  std::set<std::string_view> models{"all"};
  for (const ClassicalModel& m : classical_models()) models.insert(m.name);
  std::set<std::pair<std::string_view, std::string_view>> names;
  for (const ForceConstant& c : classical_constants()) {
    EXPECT_TRUE(models.contains(c.model)) << c.model;
    EXPECT_TRUE(names.insert({c.model, c.name}).second) << c.name;
    EXPECT_TRUE(std::isfinite(c.value) && c.value > 0) << c.name;
    EXPECT_FALSE(c.unit.empty()) << c.name;
    // What is not from a publication must not look as if it were.
    EXPECT_TRUE(c.model == "okamura" || c.origin == Origin::derived) << c.name;
  }
  EXPECT_GT(names.size(), 20u);
}

}  // namespace
}  // namespace stylet::bench
