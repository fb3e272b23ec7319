// Every metric on motions made by hand, whose answers are known.
#include "engine/training/metrics.h"
#include "engine/procedures/kinds.h"

#include "engine/training/beam.h"
#include "engine/training/path_distance.h"
#include "engine/training/score.h"
#include "tests/readers/generated_files.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <numbers>
#include <set>
#include <string>
#include <vector>

namespace stylet::training {
namespace {

using Eigen::Vector3d;
constexpr double kPi = std::numbers::pi;
constexpr double kDown = -1;  // z of the needle's axis in these scenes

/// A needle 100 mm long that points down; the skin is the plane z = 0, the target 50 mm below the origin.
content::Scene flat_scene() {
  content::Scene scene;
  scene.tissues.resize(3);
  scene.needle.length = 0.1;
  scene.targets = {{.name = "near", .centre = {0, 0, -0.05}}, {.name = "far", .centre = {0, 0, -0.08}}};
  scene.forbidden.resize(2);
  scene.probe.presses = 0;
  return scene;
}

const Eigen::Quaterniond kPointsDown(Eigen::AngleAxisd(kPi, Vector3d::UnitX()));

/// What the recorder would say of a straight needle with its tip there.
TraceSample sample_at(double time_s, const Vector3d& tip, const Eigen::Quaterniond& turn = kPointsDown) {
  TraceSample s;
  s.time_s = time_s;
  s.tip = tip;
  s.tip_orientation = s.hub_orientation = turn;
  const Vector3d axis = turn * Vector3d::UnitZ();
  s.hub = tip - 0.1 * axis;
  s.inserted = std::max(0.0, tip.z() / axis.z());
  s.entry = tip - s.inserted * axis;
  s.tip_state = s.inserted > 0 ? physics::TipState::inside : physics::TipState::outside;
  s.near_tissue = (tip + kProbeAhead * axis).z() < 0;
  s.target = 0;
  s.target_position = {0, 0, -0.05};
  s.target_distance = (tip - s.target_position).norm();
  s.probe_area = 1e-4;
  return s;
}

using Motion = std::function<Vector3d(double)>;

Trace trace_of(const Motion& tip, double duration_s, double hz = 50) {
  Trace trace;
  const int steps = static_cast<int>(std::lround(duration_s * hz));
  for (int i = 0; i <= steps; ++i) trace.samples.push_back(sample_at(i / hz, tip(i / hz)));
  return trace;
}

/// Through the points at the times, in straight lines.
Motion stations(std::vector<std::pair<double, Vector3d>> points) {
  return [points = std::move(points)](double t) -> Vector3d {
    for (std::size_t i = 1; i < points.size(); ++i) {
      const auto& [t0, a] = points[i - 1];
      const auto& [t1, b] = points[i];
      if (t <= t1) return a + (t - t0) / (t1 - t0) * (b - a);
    }
    return points.back().second;
  };
}

/// Straight down from 20 mm above the skin to 50 mm below it at 20 mm/s, then still for 1.5 s.
Trace straight_line() {
  return trace_of(stations({{0, {0, 0, 0.02}}, {3.5, {0, 0, -0.05}}, {5, {0, 0, -0.05}}}), 5);
}

double value(const std::vector<Metric>& metrics, std::string_view key) {
  const Metric& metric = find_metric(std::span<const Metric>(metrics), key);
  EXPECT_TRUE(metric.value) << key;
  return metric.value.value_or(NAN);
}

bool measured(const std::vector<Metric>& metrics, std::string_view key) {
  return find_metric(std::span<const Metric>(metrics), key).value.has_value();
}

TEST(Metrics, AreAllThereOnceInOrderAndDefined) {
  const std::vector<Metric> metrics = measure(straight_line(), flat_scene());
  std::set<std::string> there;
  for (const Metric& metric : metrics) {
    EXPECT_TRUE(there.insert(metric.key).second) << metric.key;
    EXPECT_FALSE(metric.title.empty() || metric.definition.empty() || metric.source.empty()) << metric.key;
  }
  std::vector<std::string_view> measured_names, named;
  for (const Metric& metric : metrics) measured_names.push_back(metric.key);
  for (const content::MetricRow& row : procedures::metric_table()) named.push_back(row.name);
  EXPECT_EQ(measured_names, named);
}

TEST(Metrics, TableOfTheReadmeMatches) {
  readers::test::expect_in_readme(std::filesystem::path(STYLET_SOURCE_DIR) / "content", "metrics",
                                  content::metric_markdown(procedures::metric_table()));
}

TEST(Metrics, OfAStraightLine) {
  const std::vector<Metric> m = measure(straight_line(), flat_scene());
  EXPECT_NEAR(value(m, "elapsed_time"), 5, 1e-9);
  EXPECT_NEAR(value(m, "path_length"), 70, 1e-9);
  EXPECT_NEAR(value(m, "time_in_tissue"), 4, 0.011) << "within half a step";
  EXPECT_NEAR(value(m, "path_in_tissue"), 50, 0.21) << "within half a step's way";
  EXPECT_NEAR(value(m, "tissue_damage"), 0, 1e-9) << "it goes down its own hole";
  EXPECT_EQ(value(m, "punctures"), 1);
  EXPECT_EQ(value(m, "skin_contacts"), 1);
  EXPECT_EQ(value(m, "targets_hit"), 1);
  EXPECT_NEAR(value(m, "targeting"), 0, 1e-9);
  EXPECT_EQ(value(m, "translational_actions"), 0) << "20 mm/s";
  EXPECT_EQ(value(m, "rotational_actions"), 0);
  EXPECT_NEAR(value(m, "path_inefficiency"), 0, 1e-9);
  EXPECT_NEAR(value(m, "rotation"), 0, 1e-9);
  EXPECT_NEAR(value(m, "depth_perception"), 70, 1e-9);
  EXPECT_NEAR(value(m, "average_velocity"), 14, 1e-9);
  EXPECT_NEAR(value(m, "angle_error"), 0, 1e-9);
  EXPECT_NEAR(value(m, "depth_overshoot"), 0, 1e-9);
  EXPECT_NEAR(value(m, "probe_usage_time"), 5, 1e-9);
  EXPECT_EQ(value(m, "forbidden_hits"), 0);
  EXPECT_FALSE(measured(m, "tumour_content"));
  EXPECT_FALSE(measured(m, "ablation_coverage"));
  EXPECT_FALSE(measured(m, "reference_rms")) << "there is no reference motion";
}

TEST(Metrics, OfTheProcedureLeaveTheBriefingOut) {
  Trace trace = straight_line();
  const std::vector<Metric> quick = measure(trace, flat_scene());
  // The same after 100 s of reading, in which the needle is waved about, and before 7 s in which nobody looks.
  for (TraceSample& s : trace.samples) s.time_s += 100;
  Trace read = trace_of(stations({{0, {0, 0, 0.02}}, {50, {0.3, 0, 0.02}}, {99.98, {0, 0, 0.02}}}), 99.98);
  const Trace after = trace_of(stations({{0, {0, 0, -0.05}}, {7, {0, 0, 0.05}}}), 7);
  const auto append = [&](const Trace& part, double later) {
    for (TraceSample s : part.samples) {
      s.time_s += later;
      read.samples.push_back(s);
    }
  };
  append(trace, 0);
  append(after, 105.02);
  const auto stage = [](double time_s, const char* name) {
    return recording::EventRecord{.time_s = time_s, .name = "stage", .fields = {{"stage", std::string(name)}}};
  };
  read.events = {stage(100, "procedure"), stage(105, "debrief")};
  const std::vector<Metric> slow = measure(read, flat_scene());
  ASSERT_EQ(slow.size(), quick.size());
  for (std::size_t i = 0; i < slow.size(); ++i) {
    ASSERT_EQ(slow[i].value.has_value(), quick[i].value.has_value()) << slow[i].key;
    if (slow[i].value) {
      EXPECT_NEAR(*slow[i].value, *quick[i].value, 1e-6) << slow[i].key;
    }
  }
  EXPECT_EQ(arrival(read), 5000 + arrival(straight_line())) << "counted in the whole trace";
  read.events.clear();
  EXPECT_GT(value(measure(read, flat_scene()), "path_length"), 600) << "without a course all of it counts";
}

TEST(Metrics, OfASceneWithoutTargetProbeOrNoGoAreasSaySo) {
  content::Scene scene;
  scene.probe.presses = -1;
  Trace trace = straight_line();
  for (TraceSample& s : trace.samples) s.target = -1;
  const std::vector<Metric> m = measure(trace, scene);
  for (const char* key : {"targeting", "targets_hit", "angle_error", "depth_overshoot", "forbidden_hits",
                          "forbidden_time", "probe_usage_time"}) {
    EXPECT_FALSE(measured(m, key)) << key;
  }
  for (const Metric& metric : measure({}, scene))
    EXPECT_FALSE(metric.value && std::isnan(*metric.value)) << metric.key;
}

// Beside a still needle's axis: a circle of radius r in the skin's plane, 100 mm above the skin.
TEST(Metrics, OfACircleConvergeInSecondOrder) {
  constexpr double kRadius = 0.02, kPeriod = 2;
  const Motion circle = [](double t) {
    return Vector3d(kRadius * std::cos(2 * kPi * t / kPeriod), kRadius * std::sin(2 * kPi * t / kPeriod), 0.1);
  };
  const double length = 1e3 * 2 * kPi * kRadius;
  // |jerk| is r (2 pi / T)^3 all the time.
  const double jerk = 1e3 * kRadius * std::pow(2 * kPi / kPeriod, 3) * std::sqrt(kPeriod);
  std::vector<double> path_error, jerk_error;
  for (const double hz : {25, 50, 100}) {
    const std::vector<Metric> m = measure(trace_of(circle, kPeriod, hz), flat_scene());
    path_error.push_back(std::abs(value(m, "path_length") - length));
    jerk_error.push_back(std::abs(value(m, "smoothness") - jerk));
    EXPECT_NEAR(value(m, "average_velocity"), value(m, "path_length") / kPeriod, 1e-9);
    EXPECT_NEAR(value(m, "depth_perception"), 0, 1e-9) << "across the needle";
    EXPECT_EQ(value(m, "punctures"), 0);
    EXPECT_EQ(value(m, "skin_contacts"), 0);
    EXPECT_EQ(value(m, "time_in_tissue"), 0);
    EXPECT_FALSE(measured(m, "needle_in_beam"));
    EXPECT_EQ(value(m, "translational_actions"), 1) << "63 mm/s for 2 s";
  }
  for (std::size_t i = 1; i < path_error.size(); ++i) {
    EXPECT_NEAR(std::log2(path_error[i - 1] / path_error[i]), 2, 0.05);
    EXPECT_GT(std::log2(jerk_error[i - 1] / jerk_error[i]), 0.9) << "three steps of the ends are left out";
  }
  EXPECT_LT(jerk_error.back(), 0.02 * jerk);
}

TEST(Metrics, JerkCostOfACubicIsExactWhateverTheSteps) {
  const Vector3d c(1, -2, 3);
  std::vector<double> times{0, 0.1, 0.15, 0.3, 0.32, 0.5};
  std::vector<Vector3d> points;
  for (const double t : times) points.push_back(c * t * t * t - 2 * c * t * t + c);
  double covered = 0;
  for (std::size_t i = 0; i + 3 < times.size(); ++i) covered += (times[i + 3] - times[i]) / 3;
  EXPECT_NEAR(jerk_cost(times, points), 6 * c.norm() * std::sqrt(covered), 1e-9);
  points.clear();
  for (const double t : times) points.push_back(c * t * t - c * t);
  EXPECT_NEAR(jerk_cost(times, points), 0, 1e-9) << "an even acceleration has none";
}

// The wide swing of a needle about its hole: a quarter turn sweeps a quarter of the disc.
TEST(Metrics, TissueDamageOfASwingIsTheSectorInSecondOrder) {
  constexpr double kDepth = 0.04;
  std::vector<double> errors;
  for (const int steps : {10, 20, 40}) {
    std::vector<TraceSample> samples;
    for (int i = 0; i <= steps; ++i) {
      const double angle = kPi / 2 * i / steps;
      TraceSample s;
      s.inserted = kDepth;
      s.tip = kDepth * Vector3d(std::sin(angle), 0, -std::cos(angle));
      samples.push_back(s);
    }
    errors.push_back(std::abs(swept_area(samples) - kPi / 4 * kDepth * kDepth));
  }
  EXPECT_NEAR(std::log2(errors[0] / errors[1]), 2, 0.05);
  EXPECT_NEAR(std::log2(errors[1] / errors[2]), 2, 0.05);
}

// Moved sideways as a whole, tip by 30 mm and entry by 10 mm: a trapezium of 40 mm.
TEST(Metrics, TissueDamageOfATornHoleIsTheTrapezium) {
  std::vector<TraceSample> samples(2);
  samples[0].tip = {0, 0, -0.04};
  samples[1].tip = {0.03, 0, -0.04};
  samples[1].entry = {0.01, 0, 0};
  for (TraceSample& s : samples) s.inserted = 0.04;
  EXPECT_NEAR(swept_area(samples), 0.04 * (0.03 + 0.01) / 2, 1e-12);
  samples[0].inserted = 0;
  EXPECT_EQ(swept_area(samples), 0) << "it was not in yet";
}

TEST(Metrics, TwoPassesWithAJitterAtTheSkinAreTwo) {
  const Motion passes = stations({{0, {0, 0, 0.02}},
                                  {1, {0, 0, -0.03}},      // first pass
                                  {2, {0, 0, 0.0005}},     // not clear of the skin
                                  {2.5, {0, 0, -0.0008}},  // not 1 mm in either
                                  {3, {0, 0, 0.0005}},
                                  {3.5, {0, 0, -0.03}},     // still the first
                                  {4.5, {0, 0, 0.005}},     // clear
                                  {4.75, {0, 0, -0.0008}},  // the skin gives way, and is left again
                                  {5, {0, 0, 0.005}},
                                  {6, {0, 0, -0.05}}});
  const std::vector<Metric> m = measure(trace_of(passes, 6, 1000), flat_scene());
  EXPECT_EQ(value(m, "punctures"), 2);
  EXPECT_EQ(value(m, "skin_contacts"), 3);
  EXPECT_NEAR(value(m, "path_length"), 50 + 30.5 + 1.3 + 1.3 + 30.5 + 35 + 5.8 + 5.8 + 55, 1e-6);
  EXPECT_NEAR(value(m, "path_in_tissue"), 30 + 30 + 0.8 + 0.8 + 30 + 30 + 0.8 + 0.8 + 50, 0.3);
}

// Touches that do not break the skin count as contacts, not as punctures.
TEST(Metrics, SkinContactsAreCountedWithoutAPuncture) {
  const Motion touches = [](double t) { return Vector3d(0, 0, 0.004 + 0.004 * std::cos(2 * kPi * t)); };
  Trace trace = trace_of(touches, 3.25);  // down at 0.5, 1.5, 2.5 s
  for (TraceSample& s : trace.samples) {
    if (s.tip.z() < 0.0003) s.tip_state = physics::TipState::indenting;
  }
  const std::vector<Metric> m = measure(trace, flat_scene());
  EXPECT_EQ(value(m, "skin_contacts"), 3);
  EXPECT_EQ(value(m, "punctures"), 0);
}

// In the tissue, across the way to the target: a zig-zag at 45 degrees is sqrt(2) times as long.
TEST(Metrics, AZigZagIsInefficientByItsAngle) {
  std::vector<std::pair<double, Vector3d>> points{{0, {0, 0, -0.01}}};
  for (int i = 1; i <= 8; ++i) {
    points.push_back({0.5 * i, {i % 2 == 1 ? 0.005 : 0.0, 0, -0.01 - 0.005 * i}});
  }
  const std::vector<Metric> m = measure(trace_of(stations(points), 4), flat_scene());
  EXPECT_NEAR(value(m, "path_inefficiency"), 100 * (std::sqrt(2) - 1), 1e-6);
  EXPECT_NEAR(value(m, "path_length"), std::sqrt(2) * 40, 1e-6);
  EXPECT_NEAR(value(m, "depth_perception"), 40, 1e-6) << "its part along the needle";
}

TEST(Metrics, ActionsLastLongerThanAFifthOfASecond) {
  // 60 mm/s for 0.3 s, 60 mm/s for 0.16 s, 40 mm/s for 1 s, 60 mm/s for 0.3 s.
  const Motion starts = stations({{0, {0, 0, 0.2}},
                                  {0.3, {0.018, 0, 0.2}},
                                  {0.5, {0.018, 0, 0.2}},
                                  {0.66, {0.0276, 0, 0.2}},
                                  {1, {0.0276, 0, 0.2}},
                                  {2, {0.0676, 0, 0.2}},
                                  {2.3, {0.0856, 0, 0.2}}});
  EXPECT_EQ(value(measure(trace_of(starts, 2.5), flat_scene()), "translational_actions"), 2);
  // The same of turning: 60 deg/s for 0.5 s, 40 deg/s for 1 s, 60 deg/s for 0.1 s.
  Trace turns;
  for (int i = 0; i <= 100; ++i) {
    const double t = i * 0.02;
    const double degrees =
        60 * std::min(t, 0.5) + 40 * std::clamp(t - 0.5, 0.0, 1.0) + 60 * std::clamp(t - 1.5, 0.0, 0.1);
    turns.samples.push_back(sample_at(
        t, {0, 0, 0.2}, kPointsDown * Eigen::Quaterniond(Eigen::AngleAxisd(degrees * kPi / 180, Vector3d::UnitZ()))));
  }
  const std::vector<Metric> m = measure(turns, flat_scene());
  EXPECT_EQ(value(m, "rotational_actions"), 1);
  EXPECT_EQ(value(m, "translational_actions"), 0);
  EXPECT_NEAR(value(m, "rotation"), 30 + 40 + 6, 1e-6);
}

// Perk Tutor's TranslationalActions: the state changes when it has been otherwise for more than 0.2 s, either way.
TEST(Metrics, AFalterDoesNotMakeTwoActionsOfOne) {
  const auto actions = [](double pause_s) {
    // 60 mm/s for 0.5 s, a pause, 60 mm/s for 0.5 s, then rest.
    const Motion motion = stations({{0, {0, 0, 0.2}},
                                    {0.5, {0.03, 0, 0.2}},
                                    {0.5 + pause_s, {0.03, 0, 0.2}},
                                    {1 + pause_s, {0.06, 0, 0.2}},
                                    {3, {0.06, 0, 0.2}}});
    return value(measure(trace_of(motion, 3), flat_scene()), "translational_actions");
  };
  EXPECT_EQ(actions(0), 1);
  EXPECT_EQ(actions(0.06), 1);
  EXPECT_EQ(actions(0.16), 1);
  EXPECT_EQ(actions(0.24), 2);
  EXPECT_EQ(actions(0.5), 2);
}

// What Perk Tutor's MotionSmoothness makes of even steps, worked out by hand: third differences over the step's cube,
// squared, times the step. One point 1 mm off among still ones has third differences 1, -3, 3, -1 mm.
TEST(Metrics, JerkCostOfAStrayPointIsThatOfThirdDifferences) {
  std::vector<double> times;
  std::vector<Vector3d> points(9, Vector3d(0.3, 0.2, 0.1));
  for (int i = 0; i < 9; ++i) times.push_back(0.02 * i);
  points[4].y() += 1e-3;
  const double jerk = 1e-3 / std::pow(0.02, 3);
  EXPECT_NEAR(jerk_cost(times, points), jerk * std::sqrt((1 + 9 + 9 + 1) * 0.02), 1e-6 * jerk);
}

// A needle that turns about its tip by an angle and back has turned twice that.
TEST(Metrics, RotationAddsUpForthAndBack) {
  Trace trace;
  for (int i = 0; i <= 200; ++i) {
    const double angle = 0.3 * std::sin(2 * kPi * i / 200.0);
    trace.samples.push_back(
        sample_at(0.02 * i, {0, 0, 0.1}, Eigen::Quaterniond(Eigen::AngleAxisd(angle, Vector3d::UnitY()))));
  }
  EXPECT_NEAR(value(measure(trace, flat_scene()), "rotation"), 4 * 0.3 * 180 / kPi, 1e-6);
}

TEST(Metrics, NoGoAreasAreCountedByStructureWithARestBetween) {
  Trace trace = trace_of([](double) { return Vector3d(0, 0, -0.02); }, 4);
  for (TraceSample& s : trace.samples) {
    const double t = s.time_s + 1e-9;
    const bool first = (t > 1 && t < 1.5) || (t > 1.6 && t < 1.8) || (t > 3 && t < 3.2);  // 0.1 s out is no new hit
    s.forbidden = (first ? 1U : 0U) | (t > 1.2 && t < 1.4 ? 2U : 0U);
    s.crossed = s.forbidden | (t > 2.5 && t < 2.515 ? 2U : 0U);  // between two samples
  }
  const std::vector<Metric> m = measure(trace, flat_scene());
  EXPECT_EQ(value(m, "forbidden_hits"), 2 + 2);
  EXPECT_NEAR(value(m, "forbidden_time"), 0.5 + 0.2 + 0.2, 0.021);
}

TEST(Metrics, ProbeAndBeamTimesAreThoseOfTheSamples) {
  Trace trace = straight_line();
  for (TraceSample& s : trace.samples) {
    if (s.time_s < 1.01) s.probe_area = 0;
    s.in_beam = 0.5 * s.inserted;
  }
  const std::vector<Metric> m = measure(trace, flat_scene());
  EXPECT_NEAR(value(m, "probe_usage_time"), 5 - 1.01, 1e-6);
  // In tissue from 1 s on: the mean of half the length, 2.5 s rising to 50 mm and 1.5 s at 50 mm.
  EXPECT_NEAR(value(m, "needle_in_beam"), 0.5 * (2.5 * 25 + 1.5 * 50) / 4, 0.1);
}

TEST(Metrics, OutOfPlaneTimeCountsWhileTheNeedleAdvances) {
  content::Scene scene = flat_scene();
  Trace trace = straight_line();  // advances in the patient from 1 to 3.5 s
  for (TraceSample& s : trace.samples) {
    const bool beside = s.time_s > 2.01 && s.time_s < 4;
    s.tip_in_probe = {0, beside ? 0.01 : 0.0, 0.07};
  }
  EXPECT_NEAR(value(measure(trace, scene), "out_of_plane_time"), 3.5 - 2.01, 0.011);
  for (TraceSample& s : trace.samples) s.tip_in_probe.y() = -s.tip_in_probe.y();
  EXPECT_NEAR(value(measure(trace, scene), "out_of_plane_time"), 3.5 - 2.01, 0.011) << "on the other side";
  for (TraceSample& s : trace.samples) s.tip_in_probe.y() = 0.001;
  EXPECT_EQ(value(measure(trace, scene), "out_of_plane_time"), 0) << "1 mm is in a beam of 3";
  for (TraceSample& s : trace.samples) s.probe_area = 0;
  EXPECT_NEAR(value(measure(trace, scene), "out_of_plane_time"), 2.5, 0.011) << "a probe in the air shows nothing";
}

TEST(Metrics, TargetingIsTheFiredNeedlesElseTheClosest) {
  // To 4 mm beside the target, 12 mm beyond it, back to 10 mm before it, where it is fired.
  Trace trace = trace_of(stations({{0, {0.004, 0, 0.01}}, {3, {0.004, 0, -0.062}}, {4, {0.004, 0, -0.04}}}), 4.5);
  const content::Scene scene = flat_scene();
  std::vector<Metric> m = measure(trace, scene);
  EXPECT_NEAR(value(m, "targeting"), 4, 0.01);
  EXPECT_NEAR(value(m, "depth_overshoot"), 12, 1e-6);
  EXPECT_EQ(value(m, "targets_hit"), 0) << "4 mm is not 3";
  trace.events = {{.time_s = 4.3, .name = "biopsy_fired"}};
  m = measure(trace, scene);
  EXPECT_NEAR(value(m, "targeting"), std::hypot(4, 10), 1e-6);
  trace.events.front().name = "ablation_started";
  EXPECT_NEAR(value(measure(trace, scene), "targeting"), std::hypot(4, 10), 1e-6);
  trace.events.front().name = "puncture";
  EXPECT_NEAR(value(measure(trace, scene), "targeting"), 4, 0.01);
}

TEST(Metrics, OvershootIsBeyondTheTargetThatItCameTo) {
  Trace trace = trace_of(stations({{0, {0, 0, 0.01}}, {3.5, {0, 0, -0.06}}}), 4);
  EXPECT_NEAR(value(measure(trace, flat_scene()), "depth_overshoot"), 10, 1e-6);
  for (TraceSample& s : trace.samples) {
    if (s.tip.z() > -0.0551) continue;  // 5 mm beyond it another one is nearer
    s.target = 1;
    s.target_position = {0.004, 0, -0.03};
    s.target_distance = 0.004;
  }
  EXPECT_NEAR(value(measure(trace, flat_scene()), "depth_overshoot"), 5, 0.3);
}

TEST(Metrics, EachTargetIsHitOnce) {
  Trace trace = trace_of(stations({{0, {0.002, 0, 0.01}}, {4, {0.002, 0, -0.09}}, {8, {0.002, 0, -0.01}}}), 8);
  for (TraceSample& s : trace.samples) {
    if (s.tip.z() > -0.065) continue;
    s.target = 1;
    s.target_position = {0, 0, -0.08};
    s.target_distance = (s.tip - s.target_position).norm();
  }
  EXPECT_EQ(value(measure(trace, flat_scene()), "targets_hit"), 2);
}

TEST(Metrics, AngleErrorIsTakenTenMillimetresDeepInTheLastPass) {
  // A first pass at 40 degrees, drawn out; then one that misses the target's direction by 15 degrees.
  Trace trace;
  const auto pass = [&](double from_s, double degrees) {
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(kPi + degrees * kPi / 180, Vector3d::UnitX()));
    const Vector3d axis = turn * Vector3d::UnitZ();
    for (int i = 0; i <= 100; ++i) {
      const double way = -0.01 + 0.0005 * (i <= 60 ? i : 60);
      TraceSample s = sample_at(from_s + 0.02 * i, way * axis, turn);
      // From 10 mm on the target lies straight ahead of a needle held at 0 degrees; before, elsewhere.
      s.target_position = s.tip + 0.04 * (way < 0.0099 ? Vector3d(1, 0, 0) : Vector3d(0, 0, kDown));
      s.target_distance = 0.04;
      trace.samples.push_back(s);
    }
  };
  pass(0, 40);
  pass(5, 15);
  trace.events = {{.time_s = 100, .name = "biopsy_fired"}};
  EXPECT_NEAR(value(measure(trace, flat_scene()), "angle_error"), 15, 1e-6);
}

TEST(Metrics, ForceAndBendingAreTheLargest) {
  Trace trace = straight_line();
  trace.samples[100].force = {3, 0, 4};
  trace.samples[120].force = {0, -4.9, 0};
  trace.samples[10].bend = 0.009;  // in the air
  trace.samples[200].bend = 0.003;
  trace.samples[100].damage = {.bend = 0.1, .side_cut = 2e-6};  // then straightened again
  trace.samples[200].damage = {.bend = 0.05, .side_cut = 3e-6};
  const std::vector<Metric> m = measure(trace, flat_scene());
  EXPECT_NEAR(value(m, "peak_force"), 5, 1e-12);
  EXPECT_NEAR(value(m, "lateral_bending"), 3, 1e-12);
  EXPECT_NEAR(value(m, "needle_bend"), 0.1 * 180 / kPi, 1e-12);
  EXPECT_NEAR(value(m, "cut_aside"), 3, 1e-12);
}

// The straight needle's tip, which is what the hand decides, against the scenario's motion.
TEST(Metrics, AgainstTheReferenceMotion) {
  content::Scene scene = flat_scene();
  const Trace trace = straight_line();
  for (const TraceSample& s : trace.samples) {
    scene.motion.stylus.push_back({.time_s = s.time_s, .pose = {s.hub, s.hub_orientation}});
  }
  std::vector<Metric> m = measure(trace, scene);
  for (const char* key : {"reference_rms", "reference_hausdorff", "reference_frechet", "reference_dtw"}) {
    EXPECT_NEAR(value(m, key), 0, 1e-6) << key;
  }
  for (content::MotionSample& s : scene.motion.stylus) s.pose.position.x() += 0.006;
  m = measure(trace, scene);
  for (const char* key : {"reference_rms", "reference_hausdorff", "reference_frechet", "reference_dtw"}) {
    EXPECT_NEAR(value(m, key), 6, 1e-6) << key;
  }
  for (std::size_t i = 0; i < trace.samples.size(); ++i) {
    physics::StylusPose& pose = scene.motion.stylus[i].pose;
    pose.position = trace.samples[i].hub;
    pose.orientation = pose.orientation * Eigen::AngleAxisd(0.06, Vector3d::UnitX());
  }
  EXPECT_NEAR(value(measure(trace, scene), "reference_frechet"), 2 * 100 * std::sin(0.03), 1e-6) << "100 mm ahead";
}

TEST(PathDistance, OfSimplePathsIsKnown) {
  const Path line{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  const Path bump{{0, 1, 0}, {1, 3, 0}, {2, 1, 0}};
  EXPECT_NEAR(path_rms(bump, line), std::sqrt((1 + 9 + 1) / 3.0), 1e-12);
  EXPECT_NEAR(hausdorff(line, bump), 3, 1e-12);
  EXPECT_NEAR(hausdorff(bump, line), 3, 1e-12);
  EXPECT_NEAR(frechet(line, bump), 3, 1e-12);
  EXPECT_NEAR(dynamic_time_warping(line, bump), (1 + 3 + 1) / 3.0, 1e-12);
  // One way only: the middle of a long line is far from its two ends.
  const Path longer{{0, 0, 0}, {10, 0, 0}};
  const Path tail{{0, 0, 0}, {0, 4, 0}};
  EXPECT_NEAR(path_rms({{5, 0, 0}}, longer), 0, 1e-12) << "lines between points count";
  EXPECT_NEAR(hausdorff(tail, longer), 10, 1e-12);
  // The same set of points walked the other way: Hausdorff does not see it, Frechet does.
  const Path back(line.rbegin(), line.rend());
  EXPECT_NEAR(hausdorff(line, back), 0, 1e-12);
  EXPECT_NEAR(frechet(line, back), 2, 1e-12);
  // A pause changes neither Frechet's leash nor the warped mean.
  const Path pause{{0, 1, 0}, {0, 1, 0}, {0, 1, 0}, {1, 1, 0}, {2, 1, 0}};
  EXPECT_NEAR(frechet(line, pause), 1, 1e-12);
  EXPECT_NEAR(dynamic_time_warping(line, pause), 1, 1e-12);
  EXPECT_TRUE(std::isinf(frechet({}, line)));
}

TEST(PathDistance, ResamplingIsEvenInTime) {
  const std::vector<double> times{0, 1, 4};
  const Path points{{0, 0, 0}, {2, 0, 0}, {2, 6, 0}};
  const Path path = resampled(times, points, 5);
  ASSERT_EQ(path.size(), 5U);
  for (int i = 0; i < 5; ++i) {
    EXPECT_LT((path[i] - Vector3d(std::min(2.0 * i, 2.0), std::max(0.0, 2.0 * (i - 1)), 0)).norm(), 1e-12);
  }
}

TEST(Beam, SeesTheNeedleWithinSectorDepthAndWidth) {
  content::Probe probe;
  probe.convex = false;
  probe.width = 0.04;
  probe.depth = 0.06;
  EXPECT_TRUE(in_beam(probe, {0, 0, 0.05}));
  EXPECT_FALSE(in_beam(probe, {0, 0, 0.061}));
  EXPECT_FALSE(in_beam(probe, {0, 0, -0.001}));
  EXPECT_FALSE(in_beam(probe, {0.021, 0, 0.05}));
  EXPECT_FALSE(in_beam(probe, {0, 0.003, 0.05}));
  EXPECT_TRUE(in_plane(probe, {0.5, 0.001, 0.05})) << "whatever the sector";
  probe.convex = true;  // radius 60 mm, 1.15 rad: the edge at 0.575 rad
  const auto at = [&](double angle, double range) {
    return Vector3d((probe.radius + range) * std::sin(angle), 0,
                    (probe.radius + range) * std::cos(angle) - probe.radius);
  };
  EXPECT_TRUE(in_beam(probe, at(0.57, 0.03)));
  EXPECT_FALSE(in_beam(probe, at(0.58, 0.03)));
  EXPECT_TRUE(in_beam(probe, at(0.5, 0.059)));
  EXPECT_FALSE(in_beam(probe, at(0.5, 0.061)));
}

// A needle along the image, 80 mm in: the first 10 mm of it lie above the face, 60 mm are in the picture. Turned out
// of the plane by an angle it stays within half the beam's width for that over its sine.
TEST(Beam, LengthOfTheNeedleInIt) {
  content::Probe probe;
  probe.convex = false;
  probe.width = 0.2;
  probe.depth = 0.06;
  physics::NeedleState needle;
  needle.node_count = 9;
  const auto lay = [&](const Vector3d& from, const Vector3d& to) {
    for (int i = 0; i < 9; ++i) needle.positions.col(i) = from + i / 8.0 * (to - from);
  };
  const physics::RigidPose face{.position = {1, 2, 3}, .orientation = Eigen::Quaterniond(0.5, 0.5, 0.5, 0.5)};
  const auto patient = [&](const Vector3d& x) { return Vector3d(face.position + face.orientation * x); };
  lay(patient({0, 0, -0.07}), patient({0, 0, 0.08}));
  EXPECT_NEAR(length_in_beam(probe, face, needle, 0.09), 0.06, 6e-4);
  EXPECT_NEAR(length_in_beam(probe, face, needle, 0.03), 0.01, 6e-4) << "inserted alone counts";
  EXPECT_EQ(length_in_beam(probe, face, needle, 0), 0);
  // Across the plane at the depth of the focus, where the beam is 3 mm wide, at 30 degrees.
  probe.depth = 0.16;
  lay(patient({-0.075 * std::cos(kPi / 6), -0.075 * 0.5, 0.07}),
      patient({0.075 * std::cos(kPi / 6), 0.075 * 0.5, 0.07}));
  EXPECT_NEAR(length_in_beam(probe, face, needle, 0.15), 0.003 / 0.5, 6e-4);
}

}  // namespace
}  // namespace stylet::training
