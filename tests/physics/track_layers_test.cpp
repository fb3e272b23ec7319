// What a contact knows of tissues that differ along the shaft: the mean over its share, which changes by degrees.
#include "physics/contact/tissue_map.h"
#include "physics/contact/track_points.h"
#include "tests/physics/needle_track_runs.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <memory>

namespace stylet::bench {
namespace {

using Eigen::Vector3d;
using physics::TissueMap;
using physics::TrackPoint;
using physics::TrackPoints;

constexpr double kSpacing = 0.010;
constexpr std::array kModulus{400e3, 10e3, 60e3};  // Pa
constexpr std::array kBegins{0.0, 0.002, 0.014};   // m

/// Skin, fat and muscle behind each other along x, all with the same resistance; nothing before x = 0.
std::shared_ptr<TissueMap> wall(const physics::InsertionResistance& resistance = {}) {
  auto map = std::make_shared<TissueMap>();
  map->size = {120, 101, 101};
  map->origin = {-0.0095, 0, 0};
  map->tissues = {{}};
  map->young_modulus = {0};
  for (const double modulus : kModulus) {
    map->tissues.push_back(resistance);
    map->young_modulus.push_back(modulus);
  }
  for (int z = 0; z < map->size.z(); ++z) {
    for (int y = 0; y < map->size.y(); ++y) {
      for (int x = 0; x < map->size.x(); ++x) {
        const double at = map->origin.x() + x * map->spacing;
        map->labels.push_back(
            static_cast<std::uint8_t>(std::ranges::count_if(kBegins, [&](double begin) { return at > begin; })));
      }
    }
  }
  return map;
}

/// E times the length of it, from the first layer on, N/m.
double integral_to(double x) {
  double sum = 0;
  for (std::size_t i = 0; i < kModulus.size(); ++i) {
    const double end = i + 1 < kBegins.size() ? kBegins[i + 1] : 1;
    sum += kModulus[i] * std::clamp(x - kBegins[i], 0.0, end - kBegins[i]);
  }
  return sum;
}

TEST(TissueMap, KnowsTheMeanModulusOfAWayThroughLayers) {
  const auto map = wall();
  const auto mean = [&](double from, double to) {
    return map->modulus_along(from * Vector3d::UnitX(), to * Vector3d::UnitX(), 400);
  };
  EXPECT_NEAR(mean(0.004, 0.012), 10e3, 1e-6);
  EXPECT_NEAR(mean(0.010, 0.020), (4 * 10e3 + 6 * 60e3) / 10, 60);
  EXPECT_NEAR(mean(-0.008, 0.0015), 400e3, 1e-6);  // what is no tissue does not count
  EXPECT_EQ(mean(-0.008, -0.002), 0);
  EXPECT_EQ(TissueMap{}.modulus_along(Vector3d::Zero(), Vector3d::UnitX(), 16), 0);
  // It changes with the ends as little as they do.
  double last = mean(0.001, 0.002);
  double jump = 0;
  for (double to = 0.002; to < 0.020; to += 1e-6) {
    const double next = mean(0.001, to);
    jump = std::max(jump, std::abs(next - last));
    last = next;
  }
  EXPECT_LT(jump, 400e3 * 1e-6 / 0.001);
}

TEST(TissueMap, LeavesBoneOutOfWhatIsSoft) {
  const auto map = wall();
  map->tissues[3].rigid = true;
  EXPECT_NEAR(map->modulus_along(0.008 * Vector3d::UnitX(), 0.030 * Vector3d::UnitX(), 64), 10e3, 1e-6);
}

// The tip goes on by 20 um at a time and back: between them the contacts have all of the tissue on the way, each what
// is half way to its neighbours, and nothing that a contact has jumps, a new one laid or not.
TEST(TrackPoints, ShareOutWhatTissueIsOnTheWay) {
  const auto map = wall();
  constexpr double kStep = 2e-5;
  TrackPoints points(kSpacing);
  TrackPoint end;
  end.body = 0;
  points.lay(end, 0);
  const auto share = [&](double s) {
    for (TrackPoint& point : points.all()) point.active = point.arc <= s;
    points.share_shaft(0, end.rest, s - points.last_active(0)->arc, *map);
  };
  const auto held = [&] {
    std::array<double, 16> result{};
    for (std::size_t i = 0; i < points.all().size(); ++i) {
      const TrackPoint& point = points.all()[i];
      if (point.active) result[i] = point.share * point.modulus;
    }
    return result;
  };
  double jump = 0;
  double jump_where_laid = 0;
  double missed = 0;
  std::array<double, 16> before{};
  const auto compare = [&](double& most) {
    const std::array<double, 16> now = held();
    for (std::size_t i = 0; i < now.size(); ++i) most = std::max(most, std::abs(now[i] - before[i]));
    before = now;
  };
  const int steps = 2400;
  for (int k = 1; k <= steps; ++k) {
    const double s = k * kStep;
    end.rest = s * Vector3d::UnitX();
    share(s);
    compare(jump);
    double sum = 0;
    for (const double of_point : before) sum += of_point;
    missed = std::max(missed, std::abs(sum - integral_to(s)) / integral_to(0.002));
    if (s - points.last_active(0)->arc < kSpacing - 0.5 * kStep) continue;
    points.lay(end, s);
    share(s);
    compare(jump_where_laid);
  }
  std::printf("E times length: at most %.1f N/m a step of 20 um, %.1e where a point is laid; sum within %.1f %%\n",
              jump, jump_where_laid, 100 * missed);
  EXPECT_EQ(points.all().size(), 5U);
  EXPECT_LT(jump, 1.5 * kModulus[0] * kStep * 2);
  EXPECT_LT(jump_where_laid, 1e-9 * kModulus[0] * kSpacing);
  EXPECT_LT(missed, 0.1);
  EXPECT_NEAR(before[0], integral_to(0.005), 0.05 * integral_to(0.002));
  EXPECT_NEAR(before[1], integral_to(0.015) - integral_to(0.005), 0.05 * integral_to(0.002));
  EXPECT_NEAR(before[2], 60e3 * kSpacing, 1e-3);
  double jump_back = 0;
  for (int k = steps; k > 1; --k) {  // the track stays where it was cut
    share(k * kStep);
    compare(jump_back);
  }
  EXPECT_LT(jump_back, 1.5 * kModulus[0] * kStep * 2);
}

// The way to the second of three points is in no tissue.
TEST(TrackPoints, AWayOfWhichNothingIsKnownDoesNotSoftenTheRest) {
  const auto map = wall();
  TrackPoints points(kSpacing);
  TrackPoint end;
  end.body = 0;
  for (const double x : {-0.012, -0.002, 0.008}) {
    end.rest = x * Vector3d::UnitX();
    points.lay(end, x);
  }
  for (TrackPoint& point : points.all()) point.active = true;
  points.share_shaft(0, end.rest, 0, *map);
  EXPECT_EQ(points.all()[0].modulus, 0);
  const auto mean = [&](double from, double to) {
    return map->modulus_along(from * Vector3d::UnitX(), to * Vector3d::UnitX(), 8);
  };
  EXPECT_NEAR(points.all()[1].share, 1.5 * kSpacing, 1e-12);
  EXPECT_NEAR(points.all()[1].modulus, (2 * mean(-0.002, 0.003) + mean(0.003, 0.008)) / 3, 1e-3);
}

/// Along the reference insertion, sideways too: step of the force without the slope that it stands on, N.
Vector3d discontinuity(std::shared_ptr<const TissueMap> map, double& sum) {
  const reference::ReferenceInsertion insertion = r1();
  reference::ReferenceExperiment experiment(insertion,
                                            {.coupling = physics::Coupling::stylet, .tissues = std::move(map)});
  while (experiment.time_s() < insertion.duration) experiment.advance();
  sum = 0;
  for (const Vector3d& force : experiment.forces()) sum += force.norm();
  return {reference::discontinuity(experiment.forces(), 0), reference::discontinuity(experiment.forces(), 1),
          reference::discontinuity(experiment.forces(), 2)};
}

TEST(NeedleTrack, WhatTheTableSaysOfOneTissueIsWhatItsMeshSays) {
  const auto map = wall();
  std::ranges::fill(map->young_modulus, r1().material.young_modulus);
  double with = 0;
  double without = 0;
  discontinuity(map, with);
  map->young_modulus.clear();
  discontinuity(map, without);
  EXPECT_NEAR(with, without, 1e-9 * without);
}

TEST(NeedleTrack, LayersOnTheWayAreNotFeltAsSteps) {
  const auto map = wall();
  double sum = 0;
  const Vector3d layered = discontinuity(map, sum);
  map->young_modulus.clear();
  const Vector3d uniform = discontinuity(map, sum);
  std::printf(
      "steps of the force along, beside and beside that: %.3f %.3f %.3f mN, in one tissue %.3f %.3f %.3f mN\n",
      1e3 * layered.x(), 1e3 * layered.y(), 1e3 * layered.z(), 1e3 * uniform.x(), 1e3 * uniform.y(),
      1e3 * uniform.z());
  EXPECT_LT(layered.maxCoeff(), 2e-3);
}

}  // namespace
}  // namespace stylet::bench
