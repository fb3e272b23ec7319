// The needle of shipped scenarios pressed against the organ until its surface gives way.
#include "engine/content/scene.h"
#include "engine/readers/motion.h"
#include "engine/readers/scenario.h"
#include "engine/session/coupled_loops.h"
#include "engine/session/lockstep.h"
#include "engine/session/recorded_stylus.h"
#include "tools/bench/tissue_parts.h"
#include "tools/reference/liver_block.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace stylet::bench {
namespace {

constexpr double kApproachSpeed = 40e-3;  // m/s, through what lies before it
constexpr double kPressingSpeed = 3e-3;   // m/s, as Okamura, Simone and O'Leary (2004)
constexpr double kPressedShare = 0.6;     // of the force that breaks it: pressed and held, and taken back
constexpr double kStartBefore = 0.10;     // m before the deepest point of the recorded hand

/// The recorded hand's line where it comes closest to the target: the hub there, and its direction.
physics::StylusPose hand_line_of(const content::Scene& scene) {
  physics::StylusPose best;
  double least = std::numeric_limits<double>::infinity();
  for (const content::MotionSample& sample : scene.motion.stylus) {
    const Eigen::Vector3d tip =
        sample.pose.position + scene.needle.length * (sample.pose.orientation * Eigen::Vector3d::UnitZ());
    const double distance = (tip - scene.targets.front().centre).norm();
    if (distance < least) {
      least = distance;
      best = sample.pose;
    }
  }
  return best;
}

/// A needle on its way along that line, and what it presses on an organ.
class PressedOrgan {
public:
  PressedOrgan(const content::Scene& scene, int body)
      : scene_(scene),
        body_(body),
        line_(hand_line_of(scene)),
        axis_(line_.orientation * Eigen::Vector3d::UnitZ()),
        loops_(scene, physics::Coupling::stylet, pose(), {}),
        patch_(loops_.make_patch()) {}

  /// Until the tip is on the organ. @return false if it never was
  bool approach() {
    while (travel_ < 2 * kStartBefore && !touches()) step(kApproachSpeed);
    depth_ = 0;
    return touches();
  }
  /// A simulation step of the hub at a speed.
  void step(double speed) {
    const double dt = 1 / scene_.rates.simulation_hz;
    const auto [take, request] = factors_.next();
    factors_.stepped(
        loops_.simulation_step(time_, loops_.needle(), session::probe_pose(scene_, 0), take, request, patch_),
        loops_.worker());
    const auto steps = std::lround(dt / loops_.haptic_dt());
    for (long i = 0; i < steps; ++i) {
      time_ += loops_.haptic_dt();
      travel_ += speed * loops_.haptic_dt();
      const physics::StylusPose hub = pose();
      const Eigen::Vector3d before = tip();
      const double held = force();
      const bool was = touches();
      loops_.haptic_step({.time_s = time_, .position = hub.position, .orientation = hub.orientation, .valid = true},
                         patch_);
      if (!was && touches()) depth_ = 0;
      const double way = (tip() - before).dot(axis_);
      depth_ += way;
      work_ += 0.5 * (held + force()) * way;
    }
  }
  bool touches() const {
    const physics::NeedleState& needle = loops_.needle();
    return needle.tip == physics::TipState::indenting && needle.tip_body == body_;
  }
  bool broken() const {
    const physics::NeedleState& needle = loops_.needle();
    return needle.tip == physics::TipState::inside && needle.tip_body == body_;
  }
  /// On the organ along the needle, N.
  double force() const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    const physics::NeedleState& needle = loops_.needle();
    for (int i = 0; i < needle.force_count; ++i) {
      if (needle.forces[static_cast<std::size_t>(i)].body == body_)
        sum += needle.forces[static_cast<std::size_t>(i)].force;
    }
    return sum.dot(axis_);
  }
  double depth() const { return depth_; }  ///< way of the tip since it touched, m
  double work() const { return work_; }    ///< of the needle on the organ so far, J
  double puncture() const { return loops_.needle().last_puncture.force; }

private:
  physics::StylusPose pose() const {
    physics::StylusPose hub = line_;
    hub.position += (travel_ - kStartBefore) * axis_;
    return hub;
  }
  Eigen::Vector3d tip() const {
    const physics::NeedleState& needle = loops_.needle();
    return needle.positions.col(needle.node_count - 1);
  }

  const content::Scene& scene_;
  int body_;
  physics::StylusPose line_;
  Eigen::Vector3d axis_;
  double travel_ = 0;
  double time_ = 0;
  double depth_ = 0;
  double work_ = 0;
  session::LockstepFactors factors_;
  session::CoupledLoops loops_;
  physics::TissuePatch patch_;
};

void press_until(PressedOrgan& press, double speed, double force) {
  constexpr int kMost = 3000;
  for (int i = 0; i < kMost && !press.broken() && (speed > 0 ? press.force() < force : press.force() > force); ++i)
    press.step(speed);
}

void press_in(content::Scene scene, const std::string& key, const char* organ, Report& report) {
  scene.breathing.amplitude = 0;
  int body = 0;
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    if (scene.bodies[b].name == organ) body = static_cast<int>(b);
  }
  PressedOrgan first(scene, body);
  if (!first.approach()) {
    report.add(at_least(key + "touched", 0, "1", 1));
    return;
  }
  std::vector<double> depth;
  std::vector<double> force;
  while (!first.broken() && first.depth() < 0.04) {
    depth.push_back(first.depth());
    force.push_back(first.force());
    first.step(kPressingSpeed);
  }
  const double strength = first.puncture();
  report.add(noted({.name = key + "puncture.force", .value = strength, .unit = "N"}, "18G in liver: 1 to 3 N"));
  report.add(
      noted(within(key + "puncture.dent", 1e3 * depth.back(), "mm", 10, 5), "way of the tip from touching it"));
  report.add(noted(within(key + "exponent", reference::force_exponent(depth, force), "1", 1.95, 0.25),
                   "n of force ~ dent^n before it breaks"));
  const double before = first.depth();
  double after = strength;
  while (first.depth() < before + 1e-3) {
    first.step(kPressingSpeed);
    after = std::min(after, first.force());
  }
  report.add(noted({.name = key + "after", .value = after, .unit = "N"}, "least within a millimeter after it"));

  PressedOrgan cycled(scene, body);
  cycled.approach();
  const double touched = cycled.work();
  press_until(cycled, kPressingSpeed, kPressedShare * strength);
  const double taken = cycled.work() - touched;
  press_until(cycled, -kPressingSpeed, 0);
  const double lost = cycled.work() - touched;
  report.add(noted(at_least(key + "hysteresis", 100 * lost / taken, "%", 5),
                   "of the work of pressing to 0.6 of that force and back that does not come back"));
  press_until(cycled, kPressingSpeed, kPressedShare * strength);
  press_until(cycled, -kPressingSpeed, 0);
  report.add(noted(at_least(key + "cycle_2.energy", 1e3 * (cycled.work() - touched - lost), "mJ", 0),
                   "of the second such cycle"));

  PressedOrgan held(scene, body);
  held.approach();
  press_until(held, kPressingSpeed, kPressedShare * strength);
  const double pressed = held.force();
  const auto steps = std::lround(10 * scene.rates.simulation_hz);
  for (long i = 0; i < steps; ++i) held.step(0);
  report.add(noted(within(key + "relaxation", 100 * (1 - held.force() / pressed), "%", 30, 10),
                   "of the force after 10 s, stopped at 0.6 of that which breaks it"));
}

}  // namespace

Report tissue_capsule(const BenchOptions& options) {
  Report report;
  for (const std::string name : {"liver_biopsy", "rfa"}) {
    if (options.quick && name != "liver_biopsy") continue;
    press_in(readers::load_scene(readers::find_scenario(name)), "capsule." + name + ".", "liver", report);
  }
  return report;
}

}  // namespace stylet::bench
