#include "engine/readers/scenario.h"
#include "engine/session/coupled_loops.h"
#include "physics/loops/simulation_loop.h"
#include "tools/bench/mechanics_parts.h"
#include "tools/reference/kuhn_box.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace stylet::bench {
namespace {

using physics::RigidPose;
using physics::SimulationReport;

constexpr double kDt = 0.02;
constexpr double kDepth = 0.040;

/// A body under the probe, stepped with a new factor every step.
struct Bed {
  RigidPose start;  ///< the face just on the skin, +Z into the body
  std::function<SimulationReport(const RigidPose&)> step;
};

/// 120 x 120 x 60 mm, 10 kPa, held at its foot; the convex head of the default probe.
Bed block() {
  std::vector<physics::SimulationBody> bodies(1);
  bodies[0].mesh = reference::kuhn_box({-0.06, -0.06, 0}, {0.06, 0.06, 0.06}, {12, 12, 6});
  bodies[0].tet_materials.assign(bodies[0].mesh.tets.size(), {10e3, 0.45});
  bodies[0].fixed_nodes = reference::nodes_where(bodies[0].mesh, [](const auto& x) { return x.z() < 1e-9; });
  physics::SimulationLoopSettings settings{.dt = kDt, .lay_contacts = false};
  settings.contact.probe.emplace();
  settings.contact.probe->friction = 0.05;
  const auto loop = std::make_shared<physics::SimulationLoop>(std::move(bodies), settings);
  const auto patch = std::make_shared<physics::TissuePatch>(loop->make_patch());
  Bed bed;
  bed.start.position = {0, 0, 0.06};
  bed.start.orientation = Eigen::Quaterniond(Eigen::AngleAxisd(M_PI, Eigen::Vector3d::UnitX()));
  bed.step = [loop, patch](const RigidPose& pose) {
    const SimulationReport report = loop->step({.probe = &pose}, *patch);
    loop->worker().step();
    return report;
  };
  return bed;
}

/// The abdominal wall of the default scenario with what is under it, breath held.
Bed wall(const std::shared_ptr<const content::Scene>& scene) {
  const auto loops = std::make_shared<session::CoupledLoops>(
      *scene, physics::Coupling::stylet, physics::StylusPose{Eigen::Vector3d::Ones(), Eigen::Quaterniond::Identity()},
      std::vector<session::StepListener*>{});
  const auto patch = std::make_shared<physics::TissuePatch>(loops->make_patch());
  Bed bed{.start = scene->probe.pose, .step = {}};
  bed.step = [scene, loops, patch](const RigidPose& pose) {
    const SimulationReport report = loops->simulation_step(0, {}, pose, true, true, *patch);
    loops->worker().step();
    return report;
  };
  return bed;
}

/// Follows what the probe feels along its axis.
class Hand {
public:
  explicit Hand(Bed bed) : bed_(std::move(bed)) {}

  void at(double depth, double angle = 0, const Eigen::Vector3d& axis = Eigen::Vector3d::UnitY()) {
    const Eigen::Vector3d along = bed_.start.orientation * Eigen::Vector3d::UnitZ();
    const RigidPose pose{bed_.start.position + depth * along,
                         bed_.start.orientation * Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis))};
    const SimulationReport report = bed_.step(pose);
    force = -report.probe.wrench.force.dot(along);
    size = report.probe.wrench.force.norm();
    inverted += report.inverted_tets;
    lost = std::max(lost, highest - force);
    highest = std::max(highest, force);
  }
  void move(double from, double to, double speed) {
    const int steps = static_cast<int>(std::ceil(std::abs(to - from) / (speed * kDt) - 1e-9));
    for (int i = 1; i <= steps; ++i) at(i == steps ? to : from + (to > from ? 1 : -1) * speed * kDt * i);
  }
  void rest(double depth, int steps) {
    for (int i = 0; i < steps; ++i) at(depth);
  }

  double force = 0;    // N
  double size = 0;     // of the whole force, N
  double highest = 0;  // N
  double lost = 0;     // largest fall below the highest before, N
  int inverted = 0;    // tetrahedra, summed over the steps

private:
  Bed bed_;
};

void press(const std::string& name, const std::function<Bed()>& make, const std::vector<double>& speeds,
           double same_at_rest, Report& report) {
  const double along_y = 0.02;
  std::vector<double> at_rest;
  for (const double speed : speeds) {
    const std::string key = fmt::format("probe.{}.{:.0f}mm_s.", name, 1e3 * speed);
    Hand hand(make());
    hand.rest(0, 15);
    hand.highest = hand.lost = 0;
    hand.move(0, kDepth, speed);
    const double lost = hand.lost;
    hand.rest(kDepth, 60);
    at_rest.push_back(hand.force);
    report.add({.name = key + "force", .value = hand.force, .unit = "N"});
    report.add(
        noted(at_most(key + "lost", lost / hand.force, "1", 0.01),
              "largest fall below the highest force so far on the way to 40 mm, over the force there at rest"));
    hand.move(kDepth, -0.03, speed);
    hand.rest(-0.03, 40);
    report.add(noted(at_most(key + "lifted", hand.size, "N", 1e-9), "force once the probe is off the skin"));
    report.add(noted(at_most(key + "inverted", hand.inverted, "1", 0), "tetrahedra, summed over all steps"));
  }
  const auto [least, most] = std::minmax_element(at_rest.begin(), at_rest.end());
  report.add(noted(at_most("probe." + name + ".rest_spread", (*most - *least) / *most, "1", same_at_rest),
                   "force at rest at 40 mm, over the speeds at which it was reached"));
  for (const auto& [turn, axis] : {std::pair<std::string, Eigen::Vector3d>{"rocking", Eigen::Vector3d::UnitY()},
                                   {"tilting", Eigen::Vector3d::UnitX()}}) {
    Hand hand(make());
    hand.rest(0, 15);
    hand.move(0, along_y, 0.05);
    hand.rest(along_y, 10);
    const double upright = hand.force;
    double least_size = hand.size;
    for (int i = 1; i <= 50; ++i) {
      hand.at(along_y, M_PI / 9 * std::sin(2 * M_PI * kDt * i), axis);
      least_size = std::min(least_size, hand.size);
    }
    hand.rest(along_y, 40);
    const std::string key = "probe." + name + "." + turn + ".";
    report.add(noted(at_most(key + "inverted", hand.inverted, "1", 0), "20 degrees at 1 Hz, 20 mm deep"));
    report.add(at_least(key + "least_force", least_size / upright, "1", 0.5));
    report.add(noted(within(key + "afterwards", hand.force / upright, "1", 1, 0.1),
                     "force at rest over that before: under the rims the skin lies elsewhere"));
  }
}

}  // namespace

Report mechanics_probe(const BenchOptions& options) {
  Report report;
  const std::vector<double> speeds = options.quick ? std::vector{0.2} : std::vector{0.01, 0.05, 0.1, 0.2};
  press("block", block, speeds, 0.02, report);
  content::Scene scene = readers::load_scene(readers::find_scenario("liver_biopsy"));
  scene.breathing.amplitude = 0;
  scene.motion.probe.clear();
  const auto shared = std::make_shared<const content::Scene>(std::move(scene));
  press(
      "wall", [&] { return wall(shared); }, speeds, 0.02, report);
  return report;
}

}  // namespace stylet::bench
