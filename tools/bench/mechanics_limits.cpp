// Limits of matter: a needle that yields, tissue that is cut sideways, a shaft that is turned.
#include "tools/bench/coupling_parts.h"
#include "tools/bench/mechanics_parts.h"
#include "tools/bench/samples.h"
#include "tools/reference/led_needle.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

namespace stylet::bench {
namespace {

using physics::Coupling;
using physics::NeedleState;
using reference::LedNeedle;

constexpr double kYield = 1e9;         // Pa, as content/needles say
constexpr double kSideStrength = 164;  // N/m, liver in content/tissues.json
constexpr double kDegree = std::numbers::pi / 180;

reference::ReferenceRun coupled(const physics::InsertionResistance& resistance) {
  return {.coupling = Coupling::stylet, .tissues = one_tissue(resistance)};
}

reference::ReferenceInsertion rigid(reference::ReferenceInsertion insertion) {
  insertion.needle.young_modulus = 1e14;
  return insertion;
}

double inertia(const physics::NeedleProperties& needle) {
  return std::numbers::pi / 64 * (std::pow(needle.outer_diameter, 4) - std::pow(needle.inner_diameter, 4));
}

/// A moment on the tip of a needle that is clamped at its hub, up to `most` and back to nothing.
struct BentByMoment {
  double first_bend = 0;  // moment at which it begins to stay bent, N m
  double turned = 0;      // of the tip under the largest moment, rad
  double stays = 0;       // without it, rad
};
BentByMoment bend_by_moment(const physics::NeedleProperties& properties, double most) {
  const physics::StylusPose hub;
  physics::Needle needle(properties, {});
  physics::NeedleShape shape = physics::straight_needle(properties, hub);
  Eigen::VectorXd load = Eigen::VectorXd::Zero(6 * needle.node_count()), motion = load;
  const int last = shape.node_count - 1;
  const auto step = [&](double moment) {
    load[6 * last + 4] = moment;
    needle.linearise(shape, hub, 1e-3);
    needle.solve(load, motion);
    physics::move(shape, motion);
  };
  const auto turned = [&] { return 2 * std::acos(std::min(1.0, std::abs(shape.orientation(last).w()))); };
  constexpr int kSteps = 500;
  BentByMoment result;
  for (int i = 1; i <= kSteps; ++i) {
    step(most * i / kSteps);
    if (needle.bend() == 0) result.first_bend = most * i / kSteps;
  }
  for (int i = 0; i < kSteps; ++i) step(most);
  result.turned = turned();
  for (int i = 1; i <= 2 * kSteps; ++i) step(most * std::max(0.0, 1.0 - 1.0 * i / kSteps));
  result.stays = turned();
  return result;
}

void report_yield(const reference::ReferenceInsertion& insertion, Report& report) {
  physics::NeedleProperties needle = insertion.needle;
  needle.yield_strength = kYield;
  const double stiffness = needle.young_modulus * inertia(needle);
  const double first = kYield * 2 * inertia(needle) / needle.outer_diameter;
  const double most = 1.35 * first;
  const BentByMoment bent = bend_by_moment(needle, most);
  report.add(noted(within("limits.yield.moment", bent.first_bend, "N m", first, 0.01 * first),
                   "of an 18G needle of 1 GPa: sigma_y I / (d/2)"));
  report.add(
      noted(within("limits.yield.springback", (bent.turned - bent.stays) / kDegree, "deg",
                   most * needle.length / stiffness / kDegree, 0.01 * most * needle.length / stiffness / kDegree),
            "bent by 1.35 M_y and let go: M L / (E I)"));
  report.add({"limits.yield.stays", bent.stays / kDegree, "deg", {}, {}, {}, "of the same"});

  for (const bool yields : {false, true}) {
    reference::ReferenceInsertion drag = insertion;
    drag.needle.yield_strength = yields ? kYield : 0;
    physics::InsertionResistance liver = liver_resistance();
    if (yields) liver.side_strength = kSideStrength;
    LedNeedle led(drag, coupled(liver));
    double moment = 0, force = 0;
    led.lead({.along = 0.09}, 0.8);
    led.lead({.along = 0.09, .aside = 0.06}, 0.8, [&](const NeedleState& s) {
      moment = std::max(moment, s.wrench.moment.norm());
      force = std::max(force, std::abs(s.wrench.force.y()));
    });
    led.lead({.along = 0.09, .aside = 0.06}, 1);
    const double held = std::abs(led.needle().wrench.force.y());
    led.lead({.along = 0.09}, 0.8);
    led.lead({.along = -0.02}, 1);
    const NeedleState& s = led.needle();
    const double off = (s.positions.col(s.node_count - 1) - s.positions.col(0)).tail<2>().norm();
    const std::string name = yields ? "limits.drag.yielding" : "limits.drag.elastic";
    report.add({name + ".force", force, "N", {}, {}, {}, "18G, 90 mm deep, its hub 60 mm aside"});
    report.add({name + ".held", held, "N", {}, {}, {}, "a second later"});
    if (yields) {
      report.add(at_most(name + ".moment", moment, "N m", 1.5 * first));
    } else {
      report.add({name + ".moment", moment, "N m", {}, {}, {}});
    }
    report.add({name + ".bend", s.damage.bend / kDegree, "deg", {}, {}, {}, "for good, in the air again"});
    report.add({name + ".tip", 1e3 * off, "mm", {}, {}, {}, "off the hub's axis, in the air again"});
    report.add({name + ".cut", 1e6 * s.damage.side_cut, "mm2", {}, {}, {}, "of tissue beside the shaft"});
    report.add(at_least(name + ".work", s.hand_work - s.damage.bend_work - s.damage.side_work, "J", 0));
  }
}

void report_cut(const reference::ReferenceInsertion& insertion, Report& report) {
  constexpr double kStrength = 10, kDepth = 0.06;
  LedNeedle led(rigid(insertion), coupled({.side_strength = kStrength}));
  led.lead({.along = kDepth}, 0.8);
  led.lead({.along = kDepth}, 0.2);
  double most = 0;
  const double begin = led.needle().hand_work;
  led.lead({.along = kDepth, .aside = 0.02}, 0.8,
           [&](const NeedleState& s) { most = std::max(most, std::abs(s.wrench.force.y())); });
  report.add(noted(within("limits.cut.plateau", most, "N", kStrength * kDepth, 0.03 * kStrength * kDepth),
                   "a stiff needle 60 mm deep goes 20 mm aside: length times strength"));
  led.lead({.along = kDepth}, 0.8);
  led.lead({.along = kDepth}, 0.2);
  const NeedleState& s = led.needle();
  report.add(noted(at_least("limits.cut.cycle", s.hand_work - begin - s.damage.side_work, "J", 0),
                   "work of the hand there and back, beyond what cutting took"));
  report.add({"limits.cut.work", s.damage.side_work, "J", {}, {}, {}, "that cutting took"});
}

double turn_of(const NeedleState& s, int node) {
  const Eigen::Quaterniond none = physics::orientation_along(Eigen::Vector3d::UnitX());
  const Eigen::Vector3d x = s.orientations[node] * Eigen::Vector3d::UnitX();
  return std::atan2(x.dot(none * Eigen::Vector3d::UnitY()), x.dot(none * Eigen::Vector3d::UnitX()));
}

void report_turn(reference::ReferenceInsertion insertion, Report& report) {
  constexpr double kFriction = 500, kDepth = 0.08;
  insertion.material.young_modulus = 1e7;  // the tissue hardly goes round with the shaft
  LedNeedle led(insertion, coupled({.friction_per_length = kFriction}));
  led.lead({.along = kDepth}, 1);
  led.lead({.along = kDepth, .roll = 1.5}, 1.5);
  const NeedleState& s = led.needle();
  const double radius = insertion.needle.outer_diameter / 2, inside = kDepth + insertion.tip_start.x();
  const double shear = insertion.needle.young_modulus / (2 * (1 + insertion.needle.poisson_ratio));
  const double torsion = shear * 2 * inertia(insertion.needle);
  const double moment = radius * kFriction * inside;
  const double twist = moment * (insertion.needle.length - 0.5 * inside) / torsion;
  report.add(noted(within("limits.turn.moment", -s.wrench.moment.x(), "N m", moment, 0.02 * moment),
                   "all of a shaft slides round: r f L"));
  report.add(noted(within("limits.turn.twist", (turn_of(s, 0) - turn_of(s, s.node_count - 1)) / kDegree, "deg",
                          twist / kDegree, 0.02 * twist / kDegree),
                   "hub ahead of the tip: q L^2 / (2 G J), and what is outside"));

  insertion.material.young_modulus = 1e6;
  for (const int around : {0, 1, 5}) {
    constexpr double kSpeed = 0.0015, kSeconds = 0.6;
    LedNeedle both(rigid(insertion), coupled({.friction_per_length = 50}));
    both.lead({.along = 0.05}, 1);
    double share = 0;
    int samples = 0, step = 0;
    both.lead({.along = 0.05 + kSpeed * kSeconds, .roll = around * kSpeed / radius * kSeconds}, kSeconds,
              [&](const NeedleState& n) {
                if (++step < 250 || step > 450) return;
                share -= n.wrench.force.x() / (50 * n.tip_depth);
                ++samples;
              });
    const double law = 1 / std::hypot(1.0, around);
    report.add(noted(within("limits.turn.along." + std::to_string(around), share / samples, "1", law, 0.03),
                     "force along over its bound where the surface goes round so many times as fast"));
  }
}

/// Haptic steps with friction, hub led to and fro, and turned where `roll` says so; to `times`.
void time_steps(const reference::ReferenceInsertion& insertion, const physics::InsertionResistance& resistance,
                double roll, double aside, int turns, Samples& times) {
  LedNeedle led(insertion, coupled(resistance));
  led.lead({.along = 0.08}, 1);
  for (int turn = 0; turn < turns; ++turn) {
    const double sign = turn % 2 == 0 ? 1 : -1;
    auto begin = Clock::now();
    led.lead_timed(
        {.along = 0.08 + 0.001 * sign, .aside = sign * aside, .roll = sign * roll}, 0.5,
        [&] { begin = Clock::now(); }, [&](const NeedleState&) { times.add(Clock::now() - begin); });
  }
}

void report_times(reference::ReferenceInsertion insertion, bool quick, Report& report) {
  insertion.contact_spacing = 0.004;
  insertion.needle.beams = 32;
  physics::InsertionResistance resistance = liver_resistance();
  resistance.friction_coefficient = 0.15;
  resistance.viscous_friction = 100;
  physics::InsertionResistance limited = resistance;
  limited.side_strength = kSideStrength;
  reference::ReferenceInsertion yielding = insertion;
  yielding.needle.yield_strength = kYield;
  Samples without(20000), with(20000), turned(20000), cutting(20000);
  for (int round = 0; round < (quick ? 1 : 4); ++round) {  // alternated: what else the machine does meets all
    time_steps(insertion, resistance, 0, 0.001, 2, without);
    time_steps(yielding, limited, 0, 0.001, 2, with);
    time_steps(yielding, limited, 0.5, 0.001, 2, turned);
  }
  limited.side_strength = 10;
  time_steps(yielding, limited, 0, 0.01, quick ? 2 : 8, cutting);
  report.add(noted(at_most("limits.time.ratio", with.median() / without.median(), "1", 1.1),
                   "haptic step with 20 contacts, limits there but not reached, over that without"));
  report.add({"limits.time.step", with.median(), "us", {}, {}, {}});
  report.add({"limits.time.turned", turned.median(), "us", {}, {}, {}, "the same while the hub turns"});
  report.add({"limits.time.cutting",
              cutting.median(),
              "us",
              {},
              {},
              {},
              "the same in tissue of 10 N/m, dragged 10 mm aside"});
}

}  // namespace

Report mechanics_limits(const BenchOptions& options) {
  const reference::ReferenceInsertion insertion = reference::read_reference_insertion(options.reference_insertion);
  Report report;
  report_yield(insertion, report);
  report_cut(insertion, report);
  report_turn(insertion, report);
  report_times(insertion, options.quick, report);
  return report;
}

}  // namespace stylet::bench
