#include "engine/training/metrics.h"

#include "engine/procedures/kinds.h"
#include "engine/training/beam.h"
#include "engine/training/flow.h"
#include "engine/training/path_distance.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <numbers>
#include <utility>

namespace stylet::training {
namespace {

using Samples = std::span<const TraceSample>;

constexpr double kMm = 1e3;
constexpr double kDegrees = 180 / std::numbers::pi;
constexpr double kHit = 3e-3;                     // m, Perk Tutor's default
constexpr double kActionSpeed = 50e-3;            // m/s, as there
constexpr double kActionTurning = 50 / kDegrees;  // rad/s, as there
constexpr double kActionTime = 0.2;               // s, as there
constexpr double kRest = 0.2;                     // s out of a structure, after which it is hit anew
constexpr double kAimDepth = 10e-3;               // m behind the skin where the needle is held by the wall
constexpr double kAdvance = 1e-3;                 // m/s of needle into the patient
constexpr std::size_t kReferencePoints = 600;     // of each motion that is compared

bool in_tissue(const TraceSample& s) {
  return s.inserted > 0;
}

/// Sum over the steps of amount(before, after) times the share of its ends, 0, 1/2 or 1, where `where` holds.
template <typename Where, typename Amount>
double sum_where(Samples samples, const Where& where, const Amount& amount) {
  double sum = 0;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const double share = ((where(samples[i - 1]) ? 1 : 0) + (where(samples[i]) ? 1 : 0)) / 2.0;
    if (share > 0) sum += share * amount(samples[i - 1], samples[i]);
  }
  return sum;
}

double step_time(const TraceSample& before, const TraceSample& after) {
  return after.time_s - before.time_s;
}
double step_length(const TraceSample& before, const TraceSample& after) {
  return (after.tip - before.tip).norm();
}
constexpr auto kAlways = [](const TraceSample&) { return true; };

Eigen::Vector3d axis(const TraceSample& s) {
  return s.tip_orientation * Eigen::Vector3d::UnitZ();
}

double triangle(const Eigen::Vector3d& a, const Eigen::Vector3d& b, const Eigen::Vector3d& c) {
  return (b - a).cross(c - a).norm() / 2;
}

/// Times that a needle comes to the skin: clear of it by kProbeAhead in between.
int skin_contacts(Samples samples) {
  int contacts = 0;
  bool away = true;
  for (const TraceSample& s : samples) {
    const bool touches = in_tissue(s) || s.tip_state != physics::TipState::outside;
    if (touches && away) ++contacts;
    if (touches) away = false;
    if (!touches && !s.near_tissue) away = true;
  }
  return contacts;
}

int forbidden_hits(Samples samples, std::size_t structures) {
  int hits = 0;
  for (std::size_t i = 0; i < structures; ++i) {
    double left_s = -std::numeric_limits<double>::infinity();
    bool was_in = false;
    for (const TraceSample& s : samples) {
      const bool now = ((s.crossed | s.forbidden) >> i & 1U) != 0;
      if (now && !was_in && s.time_s - left_s > kRest) ++hits;
      if (now) left_s = s.time_s;
      was_in = now;
    }
  }
  return hits;
}

/// First sample of the pass that ends at or after `end`: the one after which the needle stays in.
std::size_t pass_begin(Samples samples, std::size_t end) {
  std::size_t begin = std::min(end, samples.size() - 1);
  while (begin > 0 && in_tissue(samples[begin - 1])) --begin;
  return begin;
}

std::optional<double> angle_error(Samples samples, std::size_t arrived) {
  if (arrived == samples.size() || samples[arrived].target < 0) return std::nullopt;
  for (std::size_t i = pass_begin(samples, arrived); i <= arrived; ++i) {
    const TraceSample& s = samples[i];
    if (s.inserted < kAimDepth) continue;
    const Eigen::Vector3d way = s.target_position - s.tip;
    return std::atan2(axis(s).cross(way).norm(), axis(s).dot(way)) * kDegrees;
  }
  return std::nullopt;
}

std::optional<double> depth_overshoot(Samples samples, std::size_t arrived) {
  if (arrived == samples.size() || samples[arrived].target < 0) return std::nullopt;
  double deepest = 0;
  for (std::size_t i = pass_begin(samples, arrived); i < samples.size() && in_tissue(samples[i]); ++i) {
    if (samples[i].target != samples[arrived].target) continue;
    deepest = std::max(deepest, (samples[i].tip - samples[i].target_position).dot(axis(samples[i])));
  }
  return deepest * kMm;
}

std::optional<double> inefficiency(Samples samples, std::size_t arrived) {
  const auto first = std::ranges::find_if(samples, in_tissue);
  const auto begin = static_cast<std::size_t>(first - samples.begin());
  if (arrived == samples.size() || begin >= arrived) return std::nullopt;
  const double chord = (samples[arrived].tip - samples[begin].tip).norm();
  if (!(chord > 0)) return std::nullopt;
  return 100 * (sum_where(samples.subspan(begin, arrived - begin + 1), kAlways, step_length) / chord - 1);
}

/// Time in which the needle goes deeper and the image does not show its tip.
double out_of_plane_time(Samples samples, const content::Probe& probe) {
  const auto unseen = [&](const TraceSample& s) {
    const bool lifted = probe.presses >= 0 && !(s.probe_area > 0);
    return in_tissue(s) && (lifted || !in_plane(probe, s.tip_in_probe));
  };
  return sum_where(samples, unseen, [](const TraceSample& before, const TraceSample& after) {
    const double dt = step_time(before, after);
    return after.inserted - before.inserted > kAdvance * dt ? dt : 0;
  });
}

/// The path of the tip of a needle that does not bend.
struct StraightTip {
  std::vector<double> times;
  Path points;
  void add(double time_s, const Eigen::Vector3d& hub, const Eigen::Quaterniond& orientation, double length) {
    times.push_back(time_s);
    points.push_back(hub + orientation * Eigen::Vector3d(0, 0, length));
  }
};

/// Speed of the tip and of the hub's turning over each step, m/s and rad/s.
struct Rates {
  std::vector<double> times, speed, turning;
};
Rates rates(Samples samples) {
  Rates out;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    out.times.push_back(samples[i].time_s);
    if (i == 0) continue;
    const double dt = step_time(samples[i - 1], samples[i]);
    const auto rate = [dt](double way) { return dt > 0 ? way / dt : 0; };
    out.speed.push_back(rate(step_length(samples[i - 1], samples[i])));
    out.turning.push_back(rate(samples[i].hub_orientation.angularDistance(samples[i - 1].hub_orientation)));
  }
  return out;
}

int targets_hit(Samples samples, std::size_t targets) {
  std::vector<bool> hit(targets, false);
  for (const TraceSample& s : samples) {
    if (s.target >= 0 && in_tissue(s) && s.target_distance <= kHit) hit[s.target] = true;
  }
  return static_cast<int>(std::ranges::count(hit, true));
}

template <typename Value>
double largest(Samples samples, const Value& value) {
  double most = 0;
  for (const TraceSample& s : samples) most = std::max(most, value(s));
  return most;
}

/// Collects the metrics in order.
class MetricList {
public:
  void add(std::string_view name, std::optional<double> value) { add(content::metric_row(name), value); }
  void add(const content::MetricRow& row, std::optional<double> value) {
    if (value && !std::isfinite(*value)) value.reset();
    list.push_back({std::string(row.name), std::string(row.title), std::string(row.unit), value,
                    std::string(row.definition), std::string(row.source)});
  }
  std::vector<Metric> list;
};

void add_reference(MetricList& out, Samples samples, const content::Scene& scene) {
  std::optional<double> rms, widest, leash, warped;
  if (!samples.empty() && scene.motion.stylus.size() >= 2) {
    StraightTip hand, reference;
    for (const TraceSample& s : samples) hand.add(s.time_s, s.hub, s.hub_orientation, scene.needle.length);
    for (const content::MotionSample& m : scene.motion.stylus) {
      reference.add(m.time_s, m.pose.position, m.pose.orientation, scene.needle.length);
    }
    const Path a = resampled(hand.times, hand.points, kReferencePoints);
    const Path b = resampled(reference.times, reference.points, kReferencePoints);
    rms = kMm * path_rms(a, b);
    widest = kMm * hausdorff(a, b);
    leash = kMm * frechet(a, b);
    warped = kMm * dynamic_time_warping(a, b);
  }
  out.add(content::kReferenceRms, rms);
  out.add(content::kReferenceHausdorff, widest);
  out.add(content::kReferenceFrechet, leash);
  out.add(content::kReferenceDtw, warped);
}

void add_johnson(MetricList& out, Samples samples, const content::Scene& scene, std::size_t arrived) {
  const bool came = arrived < samples.size();
  const double inside = sum_where(samples, in_tissue, step_time);
  std::optional<double> targeting, probe, beam;
  if (came && samples[arrived].target >= 0) targeting = kMm * samples[arrived].target_distance;
  if (scene.probe.presses >= 0) {
    probe = sum_where(
        samples, [](const TraceSample& s) { return s.probe_area > 0; }, step_time);
  }
  if (inside > 0) {
    beam = kMm / inside * sum_where(samples, in_tissue, [](const TraceSample& before, const TraceSample& after) {
             return step_time(before, after) * (before.in_beam + after.in_beam) / 2;
           });
  }
  std::optional<double> hits, in_forbidden;
  if (!scene.forbidden.empty()) {
    hits = forbidden_hits(samples, scene.forbidden.size());
    in_forbidden = sum_where(
        samples, [](const TraceSample& s) { return s.forbidden != 0; }, step_time);
  }
  out.add(content::kTargeting, targeting);
  out.add(content::kProbeUsageTime, probe);
  out.add(content::kNeedleInBeam, beam);
  out.add(content::kForbiddenHits, hits);
  out.add(content::kForbiddenTime, in_forbidden);
  std::optional<double> elapsed;
  if (!samples.empty()) elapsed = step_time(samples.front(), samples.back());
  out.add(content::kElapsedTime, elapsed);
  out.add(content::kPathLength, kMm * sum_where(samples, kAlways, step_length));
  out.add(content::kSkinContacts, skin_contacts(samples));
}

void add_perk_tutor(MetricList& out, Samples samples, const content::Scene& scene, std::size_t arrived) {
  const Rates rate = rates(samples);
  Path hubs;
  for (const TraceSample& s : samples) hubs.push_back(s.hub);
  const double elapsed = samples.empty() ? 0 : step_time(samples.front(), samples.back());
  const double path = kMm * sum_where(samples, kAlways, step_length);
  std::optional<double> hit, velocity;
  if (!scene.targets.empty()) hit = targets_hit(samples, scene.targets.size());
  if (elapsed > 0) velocity = path / elapsed;
  const auto turned = [](const TraceSample& before, const TraceSample& after) {
    return before.hub_orientation.angularDistance(after.hub_orientation);
  };
  const auto along = [](const TraceSample& before, const TraceSample& after) {
    return std::abs((after.tip - before.tip).dot(axis(after)));
  };
  out.add(content::kTimeInTissue, sum_where(samples, in_tissue, step_time));
  out.add(content::kPathInTissue, kMm * sum_where(samples, in_tissue, step_length));
  out.add(content::kTissueDamage, kMm * kMm * swept_area(samples));
  out.add(content::kPunctures, punctures(samples));
  out.add(content::kTargetsHit, hit);
  out.add(content::kTranslationalActions, spells_above(rate.times, rate.speed, kActionSpeed, kActionTime));
  out.add(content::kRotationalActions, spells_above(rate.times, rate.turning, kActionTurning, kActionTime));
  out.add(content::kSmoothness, kMm * jerk_cost(rate.times, hubs));
  out.add(content::kPathInefficiency, inefficiency(samples, arrived));
  out.add(content::kRotation, kDegrees * sum_where(samples, kAlways, turned));
  out.add(content::kDepthPerception, kMm * sum_where(samples, kAlways, along));
  out.add(content::kAverageVelocity, velocity);
}

void add_ours(MetricList& out, Samples samples, const Trace& trace, const content::Scene& scene,
              std::size_t arrived) {
  out.add(content::kAngleError, angle_error(samples, arrived));
  out.add(content::kDepthOvershoot, depth_overshoot(samples, arrived));
  out.add(content::kPeakForce, largest(samples, [](const auto& s) { return s.force.norm(); }));
  out.add(content::kLateralBending, kMm * largest(samples, [](const auto& s) { return in_tissue(s) ? s.bend : 0; }));
  out.add(content::kNeedleBend, kDegrees * largest(samples, [](const auto& s) { return s.damage.bend; }));
  out.add(content::kCutAside, kMm * kMm * largest(samples, [](const auto& s) { return s.damage.side_cut; }));
  out.add(content::kOutOfPlaneTime, out_of_plane_time(samples, scene.probe));
  for (const procedures::Kind* kind : procedures::kinds()) {
    for (const content::MetricRow& metric : kind->metrics()) {
      out.add(metric, kind->measure(metric.name, trace.events, scene));
    }
  }
}

}  // namespace

bool ends_approach(const recording::EventRecord& event) {
  return std::ranges::any_of(procedures::kinds(),
                             [&](const procedures::Kind* kind) { return event.name == kind->approach_event(); });
}

Samples of_procedure(const Trace& trace) {
  const auto stage = [&](Stage wanted) {
    return std::ranges::find_if(trace.events,
                                [&](const auto& event) { return stage_of(event) == stage_name(wanted); });
  };
  const auto begun = stage(Stage::procedure), over = stage(Stage::debrief);
  const auto at = [&](auto event, auto otherwise) {
    return event == trace.events.end()
               ? otherwise
               : std::ranges::lower_bound(trace.samples, event->time_s, {}, &TraceSample::time_s);
  };
  const bool followed = std::ranges::any_of(trace.events, [](const auto& event) { return !stage_of(event).empty(); });
  if (!followed) return trace.samples;
  auto to = at(over, trace.samples.end());
  if (to != trace.samples.end()) ++to;  // the moment that it ended at
  const auto from = std::min(at(begun, trace.samples.end()), to);
  return {from, to};
}

bool something_done(const Trace& trace, const content::Scene& scene) {
  if (std::ranges::any_of(trace.events, ends_approach)) return true;
  return !scene.exercise.plan && std::ranges::any_of(of_procedure(trace), in_tissue);
}

namespace {

/// arrival() in `samples`.
std::size_t arrival_in(Samples samples, const std::vector<recording::EventRecord>& events) {
  for (const recording::EventRecord& event : events) {
    if (!ends_approach(event)) continue;
    const auto after = std::ranges::upper_bound(samples, event.time_s, {}, &TraceSample::time_s);
    if (after != samples.begin()) return static_cast<std::size_t>(after - samples.begin()) - 1;
  }
  std::size_t best = samples.size();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (!in_tissue(samples[i])) continue;
    const bool nearer =
        best == samples.size() || samples[i].target < 0 || samples[i].target_distance < samples[best].target_distance;
    if (nearer) best = i;
  }
  return best;
}

}  // namespace

std::size_t arrival(const Trace& trace) {
  const Samples samples = of_procedure(trace);
  const std::size_t at = arrival_in(samples, trace.events);
  if (at == samples.size()) return trace.samples.size();
  return at + static_cast<std::size_t>(samples.data() - trace.samples.data());
}

std::vector<Metric> measure(const Trace& trace, const content::Scene& scene) {
  MetricList out;
  const Samples samples = of_procedure(trace);
  const std::size_t arrived = arrival_in(samples, trace.events);
  add_johnson(out, samples, scene, arrived);
  add_perk_tutor(out, samples, scene, arrived);
  add_reference(out, samples, scene);
  add_ours(out, samples, trace, scene, arrived);
  return std::move(out.list);
}

const Metric& find_metric(std::span<const Metric> metrics, std::string_view key) {
  const auto found = std::ranges::find(metrics, key, &Metric::key);
  if (found == metrics.end()) {
    std::fprintf(stderr, "there is no metric %.*s\n", static_cast<int>(key.size()), key.data());
    std::abort();
  }
  return *found;
}

Metric& find_metric(std::span<Metric> metrics, std::string_view key) {
  return const_cast<Metric&>(find_metric(std::span<const Metric>(metrics), key));
}

nlohmann::ordered_json to_json(std::span<const Metric> metrics) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
  for (const Metric& metric : metrics) {
    nlohmann::ordered_json& entry = json.emplace_back();
    entry["key"] = metric.key;
    entry["title"] = metric.title;
    entry["unit"] = metric.unit;
    entry["value"] = metric.value ? nlohmann::ordered_json(*metric.value) : nlohmann::ordered_json();
    entry["definition"] = metric.definition;
    entry["source"] = metric.source;
  }
  return json;
}

double swept_area(Samples samples) {
  double area = 0;
  for (std::size_t i = 1; i < samples.size(); ++i) {
    const TraceSample& a = samples[i - 1];
    const TraceSample& b = samples[i];
    if (!in_tissue(a) || !in_tissue(b)) continue;
    area += triangle(b.tip, b.entry, a.tip) + triangle(b.entry, a.tip, a.entry);
  }
  return area;
}

int punctures(Samples samples) {
  int entries = 0;
  bool in = !samples.empty() && samples.front().inserted >= kProbeAhead;
  for (const TraceSample& s : samples) {
    if (!in && s.inserted >= kProbeAhead) {
      ++entries;
      in = true;
    } else if (in && !in_tissue(s) && !s.near_tissue) {
      in = false;
    }
  }
  return entries;
}

int spells_above(std::span<const double> times, std::span<const double> rates, double threshold, double shortest) {
  int spells = 0;
  bool above = false;
  double otherwise = 0;  // for how long it has not been so
  for (std::size_t i = 0; i < rates.size(); ++i) {
    const bool now = rates[i] > threshold;
    otherwise = now == above ? 0 : otherwise + times[i + 1] - times[i];
    if (otherwise <= shortest) continue;
    above = now;
    otherwise = 0;
    if (above) ++spells;
  }
  return spells;
}

double jerk_cost(std::span<const double> times, std::span<const Eigen::Vector3d> points) {
  double integral = 0;
  for (std::size_t i = 0; i + 3 < points.size(); ++i) {
    // 6 times the third divided difference: exact for cubics, whatever the steps.
    Eigen::Vector3d jerk = Eigen::Vector3d::Zero();
    for (std::size_t k = i; k < i + 4; ++k) {
      double weight = 6;
      for (std::size_t l = i; l < i + 4; ++l) {
        if (l != k) weight /= times[k] - times[l];
      }
      jerk += weight * points[k];
    }
    integral += jerk.squaredNorm() * (times[i + 3] - times[i]) / 3;
  }
  return std::sqrt(integral);
}

}  // namespace stylet::training
