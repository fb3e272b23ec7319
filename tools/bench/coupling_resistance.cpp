// Puncture, cutting and friction: force over depth, energy, other haptic rates, and the classical models beside.
#include "tools/bench/classical_forces.h"
#include "tools/bench/coupling_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <limits>
#include <string>
#include <utility>

namespace stylet::bench {
namespace {

using physics::Coupling;
using physics::TipState;

constexpr double kInsertionSpeed = 0.045;  // m/s
constexpr double kTurn = 0.02;             // s to reverse
constexpr double kAroundEvents = 0.02;     // s left out of the comparison of rates
constexpr double kRateBound = 2;           // % of the peak
constexpr double kUndefined = std::numeric_limits<double>::quiet_NaN();

/// Straight in to `depth`, back until the tip is at `back_to`, in again.
reference::ReferenceInsertion there_and_back(const reference::ReferenceInsertion& insertion, double depth,
                                             double back_to, double speed) {
  reference::ReferenceInsertion motion = insertion;
  motion.lateral_amplitude = 0;
  const double in = depth / speed, out = (depth - back_to) / speed;
  motion.axial_speed = {{0, speed},
                        {in, speed},
                        {in + kTurn, -speed},
                        {in + out, -speed},
                        {in + out + kTurn, speed},
                        {in + 2 * out, speed},
                        {in + 2 * out + kTurn, 0},
                        {in + 2 * out + 0.2, 0}};
  motion.duration = in + 2 * out + 0.2;
  return motion;
}

/// In to `depth` and out altogether, back to where it began.
reference::ReferenceInsertion closed_path(const reference::ReferenceInsertion& insertion, double depth) {
  reference::ReferenceInsertion motion = insertion;
  motion.lateral_amplitude = 0;
  const double way = depth / kInsertionSpeed;
  motion.axial_speed = {{0, 0},
                        {kTurn, kInsertionSpeed},
                        {way, kInsertionSpeed},
                        {way + kTurn, 0},
                        {way + 2 * kTurn, -kInsertionSpeed},
                        {2 * way + kTurn, -kInsertionSpeed},
                        {2 * way + 2 * kTurn, 0}};
  motion.duration = 2 * way + 0.1;
  return motion;
}

struct Sample {
  double time = 0;       // s
  double force = 0;      // on the hand along -x, N: positive pushes the needle out
  double tip = 0;        // x, m: the surface at rest is at 0
  double depth = 0;      // of needle inside, m
  double deviation = 0;  // of the shaft from its track at rest along y, mean over the contacts, m
  double lateral = 0;    // force on the hand along y, N
  double work = 0;       // of the hand, J
  TipState state = TipState::outside;
};

struct Run {
  std::vector<Sample> samples;
  std::uint32_t flags = 0;
};

/// How far the tissue of the track has been pushed along y, mean over the contacts, m.
double deviation(const physics::NeedleState& needle, const physics::TetMesh& rest) {
  double sum = 0;
  for (int c = 0; c < needle.contact_count; ++c) {
    const physics::NeedleContact& contact = needle.contacts[c];
    const auto& nodes = rest.tets[contact.tet];
    double at_rest = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      at_rest += contact.barycentric[static_cast<Eigen::Index>(k)] * rest.nodes[nodes[k]].y();
    }
    sum += contact.position.y() - at_rest;
  }
  return needle.contact_count > 0 ? sum / needle.contact_count : 0;
}

Run run(const reference::ReferenceInsertion& motion, const physics::InsertionResistance& resistance,
        const physics::NeedleTrackSettings& track = {}) {
  reference::ReferenceExperiment experiment(
      motion, {.coupling = Coupling::stylet, .track = track, .tissues = one_tissue(resistance)});
  const physics::TetMesh rest = motion.body().mesh;
  Run result;
  while (experiment.time_s() < motion.duration - 1e-9) {
    experiment.simulation_step();
    for (int i = 0; i < motion.haptic_steps_per_simulation_step(); ++i) {
      experiment.haptic_step();
      const physics::NeedleState& needle = experiment.needle();
      result.samples.push_back({.time = experiment.time_s(),
                                .force = -needle.wrench.force.x(),
                                .tip = needle.positions(0, needle.node_count - 1),
                                .depth = needle.tip_depth,
                                .deviation = deviation(needle, rest),
                                .lateral = needle.wrench.force.y(),
                                .work = needle.hand_work,
                                .state = needle.tip});
    }
  }
  result.flags = experiment.needle_flags();
  return result;
}

using Place = std::vector<Sample>::const_iterator;

/// First sample from `from` on with the tip at x or deeper (shallower where `outwards`).
Place at_tip(const std::vector<Sample>& samples, Place from, double x, bool outwards = false) {
  return std::find_if(from, samples.end(), [&](const Sample& s) { return outwards ? s.tip <= x : s.tip >= x; });
}

double force_at(const std::vector<Sample>& samples, Place at) {
  return at == samples.end() ? kUndefined : at->force;
}

/// Least-squares slope of force over depth of needle inside, N/m.
double slope(Place from, Place to) {
  double n = 0, x = 0, y = 0, xx = 0, xy = 0;
  for (Place s = from; s < to; ++s) {
    n += 1;
    x += s->depth;
    y += s->force;
    xx += s->depth * s->depth;
    xy += s->depth * s->force;
  }
  return (n * xy - x * y) / (n * xx - x * x);
}

/// What a classical model makes of the recorded motion.
std::vector<ClassicalForce> classical(const ClassicalModel& model, const std::vector<Sample>& samples, double dt,
                                      double diameter) {
  TrackState state;
  std::vector<ClassicalForce> forces;
  double last_tip = samples.front().tip;
  for (const Sample& s : samples) {
    const NeedleMotion motion{.depth = s.tip,
                              .velocity = (s.tip - last_tip) / dt,
                              .inserted_length = s.depth,
                              .deviation = {s.deviation, 0},
                              .diameter = diameter,
                              .dt = dt};
    last_tip = s.tip;
    forces.push_back(model.force(motion, state));
  }
  return forces;
}

std::vector<double> forces_of(const std::vector<Sample>& samples) {
  std::vector<double> forces;
  forces.reserve(samples.size());
  for (const Sample& s : samples) forces.push_back(s.force);
  return forces;
}

void report_curve(const std::vector<Sample>& samples, const physics::InsertionResistance& liver, double depth,
                  double back_to, Report& report) {
  const Place puncture =
      std::find_if(samples.begin(), samples.end(), [](const Sample& s) { return s.state == TipState::inside; });
  if (puncture == samples.end()) {
    report.add({"resistance.puncture.peak", kUndefined, "N", liver.puncture_force, {}, {}});
    return;
  }
  const Place settled =
      std::find_if(puncture, samples.end(), [&](const Sample& s) { return s.time > puncture->time + 0.25; });
  double peak = 0;
  for (Place s = samples.begin(); s <= puncture; ++s) peak = std::max(peak, s->force);
  const Place lowest =
      std::min_element(puncture, settled, [](const Sample& a, const Sample& b) { return a.force < b.force; });
  report.add({"resistance.puncture.peak", peak, "N", liver.puncture_force, {}, {}});
  // The tissue springs back along the needle, faster than the hand goes in, and the track grows at that speed.
  const Place highest =
      std::max_element(puncture, settled, [](const Sample& a, const Sample& b) { return a.force < b.force; });
  report.add({"resistance.puncture.after", highest->force, "N", {}, {}, {}});
  report.add({"resistance.puncture.drop", peak - lowest->force, "N", {}, {}, {}});
  report.add({"resistance.puncture.indentation", puncture->tip, "m", {}, {}, {}});

  // Away from the puncture, where the track grows steadily.
  const double shallow = 0.6 * depth, deep = 0.9 * depth, middle = back_to + 0.5 * (depth - back_to);
  const Place from = at_tip(samples, settled, shallow), to = at_tip(samples, from, deep);
  report.add({"resistance.friction.slope", slope(from, to), "N/m", liver.friction_per_length, {}, {}});
  const Place turned =
      std::adjacent_find(to, samples.end(), [](const Sample& a, const Sample& b) { return b.tip < a.tip - 1e-6; });
  const Place back = at_tip(samples, turned, middle, true);
  const Place shallowest =
      std::min_element(back, samples.end(), [](const Sample& a, const Sample& b) { return a.tip < b.tip; });
  const Place first = at_tip(samples, settled, middle), again = at_tip(samples, shallowest, middle);
  report.add({"resistance.first_insertion", force_at(samples, first), "N", {}, {}, {}});
  report.add(at_most("resistance.withdrawal", force_at(samples, back), "N", 0));
  report.add({"resistance.second_insertion", force_at(samples, again), "N", {}, {}, {}});
  // Nothing is cut the second time.
  report.add(at_least("resistance.second_insertion.less", force_at(samples, first) - force_at(samples, again), "N",
                      0.5 * liver.cutting_force));
}

/// RMS difference of the forces at full milliseconds, over the peak, without what is near a puncture in either, %.
double rate_difference(const std::vector<Sample>& coarse, int coarse_khz, const std::vector<Sample>& fine,
                       int fine_khz) {
  const auto puncture_time = [](const std::vector<Sample>& samples) {
    const auto at =
        std::find_if(samples.begin(), samples.end(), [](const Sample& s) { return s.state == TipState::inside; });
    return at == samples.end() ? -1.0 : at->time;
  };
  const double events[2] = {puncture_time(coarse), puncture_time(fine)};
  double peak = 0, sum = 0, count = 0;
  for (const Sample& s : fine) peak = std::max(peak, std::abs(s.force));
  const auto n = static_cast<std::size_t>(coarse_khz), m = static_cast<std::size_t>(fine_khz);
  for (std::size_t k = 1; k * n <= coarse.size() && k * m <= fine.size(); ++k) {
    const Sample& a = coarse[k * n - 1];
    const Sample& b = fine[k * m - 1];
    if (std::abs(a.time - events[0]) < kAroundEvents || std::abs(a.time - events[1]) < kAroundEvents) continue;
    sum += (a.force - b.force) * (a.force - b.force);
    count += 1;
  }
  return kPercent * std::sqrt(sum / count) / peak;
}

double least_work(const std::vector<Sample>& samples) {
  double least = 0;
  for (const Sample& s : samples) least = std::min(least, s.work);
  return least;
}

/// LuGre bristles on the shaft beside Coulomb friction, on the same motion: without stiction both slide at the same
/// force, so what differs is how the shaft gives way before it slides.
Report lugre_beside_coulomb(const reference::ReferenceInsertion& motion, const physics::InsertionResistance& liver,
                            const std::vector<Sample>& coulomb) {
  physics::NeedleTrackSettings track{.friction = physics::ShaftFriction::lugre};
  const Run bristles = run(motion, liver, track);
  track.lugre.stiction = 1;
  const Run slippery = run(motion, liver, track);
  const auto peak = [](const std::vector<Sample>& samples) {
    double most = 0;
    for (const Sample& s : samples) most = std::max(most, s.force);
    return most;
  };
  Report report;
  report.add({"resistance.lugre.peak", peak(bristles.samples), "N", {}, {}, {}});
  report.add({"resistance.lugre.peak.coulomb", peak(coulomb), "N", {}, {}, {}});
  report.add({"resistance.lugre.difference", rate_difference(bristles.samples, 1, coulomb, 1), "%", {}, {}, {}});
  report.add(
      {"resistance.lugre.difference.no_stiction", rate_difference(slippery.samples, 1, coulomb, 1), "%", {}, {}, {}});
  report.add(at_least("resistance.lugre.work.least",
                      std::min(least_work(bristles.samples), least_work(slippery.samples)), "J", -1e-6));
  report.add({"resistance.lugre.flags", static_cast<double>(bristles.flags | slippery.flags), "1", {}, {}, {}});
  return report;
}

std::vector<double> tips_of(const std::vector<Sample>& samples) {
  std::vector<double> tip_mm;
  tip_mm.reserve(samples.size());
  for (const Sample& s : samples) tip_mm.push_back(1e3 * s.tip);
  return tip_mm;
}

/// Sideways force over time: of the coupled model and of the one classical model that has any.
struct Lateral {
  std::vector<double> time, deviation_mm, coupled, classical;
};

/// R1 as it is, curved sideways.
Lateral lateral_forces(const reference::ReferenceInsertion& insertion, const physics::InsertionResistance& liver,
                       Report& report) {
  const Run curved = run(insertion, liver);
  const std::vector<ClassicalForce> forces =
      classical({"lugre", lugre_force}, curved.samples, 1 / insertion.haptic_hz, insertion.needle.outer_diameter);
  Lateral lateral;
  double coupled_peak = 0, classical_peak = 0;
  for (std::size_t k = 0; k < forces.size(); ++k) {
    const Sample& s = curved.samples[k];
    lateral.time.push_back(s.time);
    lateral.deviation_mm.push_back(1e3 * s.deviation);
    lateral.coupled.push_back(s.lateral);
    lateral.classical.push_back(forces[k].lateral.x());
    coupled_peak = std::max(coupled_peak, std::abs(s.lateral));
    classical_peak = std::max(classical_peak, std::abs(forces[k].lateral.x()));
  }
  report.add({"resistance.lateral.peak", coupled_peak, "N", {}, {}, {}});
  report.add({"resistance.classical.lugre.lateral_peak", classical_peak, "N", {}, {}, {}});
  report.add({"resistance.lateral.flags", static_cast<double>(curved.flags), "1", {}, {}, {}});
  return lateral;
}

void draw(const std::filesystem::path& out, const std::vector<Sample>& fast, const std::vector<Sample>& slow,
          double slow_speed, const std::vector<std::pair<std::string, std::vector<double>>>& models) {
  std::vector<double> time, depth_mm;
  for (const Sample& s : slow) {
    time.push_back(s.time);
    depth_mm.push_back(1e3 * s.depth);
  }
  const figures::PlotPanel curve{.title = "Force on the hand over the depth of the tip, 45 mm/s",
                                 .x = {.label = "tip below the surface at rest, mm"},
                                 .y = {.label = "axial force, N"},
                                 .series = {plot_line("coupled", tips_of(fast), forces_of(fast), 0)},
                                 .markers = {},
                                 .dots = {}};
  figures::PlotPanel beside{
      .title = fmt::format("The classical models on the same recorded motion, {:g} mm/s", 1e3 * slow_speed),
      .x = {.label = "time, s", .min = 0, .max = time.back()},
      .y = {.label = "axial force, N"},
      .series = {plot_line("coupled", time, forces_of(slow), 0)},
      .markers = {},
      .dots = {}};
  std::vector<FigureColumn> columns{
      {"time_s", time}, {"tip_mm", tips_of(slow)}, {"depth_mm", depth_mm}, {"coupled_n", forces_of(slow)}};
  int index = 1;
  for (const auto& [name, forces] : models) {
    beside.series.push_back(plot_line(name, time, forces, index++));
    columns.push_back({name + "_n", forces});
  }
  const std::array panels{curve, beside};
  const std::array caption{
      std::string("In, partly out, in again; 1.8 N at puncture, 0.94 N cutting, 18 N/m friction."),
      std::string(
          "The classical models know the motion alone: no tissue moves in them, and they have their own constants.")};
  write_figure(out, "coupling_resistance", panels, caption, columns);
}

void draw_lateral(const std::filesystem::path& out, const Lateral& lateral) {
  const figures::PlotPanel sideways{
      .title = "Sideways force on R1, which curves by 10 mm",
      .x = {.label = "time, s", .min = 0, .max = lateral.time.back()},
      .y = {.label = "lateral force, N"},
      .series = {plot_line("coupled", lateral.time, lateral.coupled, 0),
                 plot_line("lugre, from the deviation", lateral.time, lateral.classical, 4)},
      .markers = {},
      .dots = {}};
  const std::array panels{sideways};
  const std::array caption{
      std::string(
          "The classical model: a force that grows with the deviation of the shaft from its track, taken from the "
          "coupled run, and"),
      std::string("with the length inside; its constant is of another needle in another tissue.")};
  const std::array columns{FigureColumn{"time_s", lateral.time}, FigureColumn{"deviation_mm", lateral.deviation_mm},
                           FigureColumn{"coupled_n", lateral.coupled},
                           FigureColumn{"classical_n", lateral.classical}};
  write_figure(out, "coupling_lateral", panels, caption, columns);
}

}  // namespace

Report coupling_resistance(const reference::ReferenceInsertion& insertion, const BenchOptions& options) {
  constexpr double kDepth = 0.075, kBackTo = 0.030;  // m
  const physics::InsertionResistance liver = liver_resistance();
  Report report;
  const Run curve = run(there_and_back(insertion, kDepth, kBackTo, kInsertionSpeed), liver);
  report_curve(curve.samples, liver, kDepth, kBackTo, report);

  const Run closed = run(closed_path(insertion, 0.060), liver);
  report.add(at_least("resistance.work.closed_path", closed.samples.back().work, "J", 0));
  // Below zero on the way: energy that the hand got before it gave any. Rounding and quadrature leave a trace.
  report.add(at_least("resistance.work.least", least_work(closed.samples), "J", -1e-6));
  report.append(
      lugre_beside_coulomb(there_and_back(insertion, kDepth, kBackTo, kInsertionSpeed), liver, curve.samples));

  const int finest = options.quick ? 2 : 4;
  const auto at_rate = [&](int khz) {
    reference::ReferenceInsertion motion = there_and_back(insertion, 0.050, 0.030, kInsertionSpeed);
    motion.haptic_hz = 1000.0 * khz;
    return run(motion, liver);
  };
  const Run fine = at_rate(finest);
  std::uint32_t flags = curve.flags | closed.flags | fine.flags;
  for (int khz = 1; khz < finest; khz *= 2) {
    const Run coarse = at_rate(khz);
    flags |= coarse.flags;
    report.add(at_most(fmt::format("resistance.rate.{}_against_{}_khz", khz, finest),
                       rate_difference(coarse.samples, khz, fine.samples, finest), "%", kRateBound));
  }
  report.add({"resistance.flags", static_cast<double>(flags), "1", {}, {}, {}});

  // The constants of the classical models are those of a needle at 5 mm/s, which takes half a minute.
  const double slow_speed = options.quick ? kInsertionSpeed : 0.005;
  const Run slow = options.quick ? curve : run(there_and_back(insertion, kDepth, kBackTo, slow_speed), liver);
  std::vector<std::pair<std::string, std::vector<double>>> models;
  for (const ClassicalModel& model : classical_models()) {
    std::vector<double> forces;
    for (const ClassicalForce& force :
         classical(model, slow.samples, 1 / insertion.haptic_hz, insertion.needle.outer_diameter)) {
      forces.push_back(force.axial);
    }
    double sum = 0;
    for (std::size_t k = 0; k < forces.size(); ++k) {
      sum += (forces[k] - slow.samples[k].force) * (forces[k] - slow.samples[k].force);
    }
    const std::string prefix = fmt::format("resistance.classical.{}.", model.name);
    report.add({prefix + "peak", *std::max_element(forces.begin(), forces.end()), "N", {}, {}, {}});
    report.add({prefix + "rms_difference", std::sqrt(sum / static_cast<double>(forces.size())), "N", {}, {}, {}});
    models.emplace_back(model.name, std::move(forces));
  }
  const Lateral lateral = lateral_forces(insertion, liver, report);
  if (!options.out.empty()) {
    draw(options.out, curve.samples, slow.samples, slow_speed, models);
    draw_lateral(options.out, lateral);
  }
  return report;
}

}  // namespace stylet::bench
