// Patches that come late: what the force on the hand does then.
#include "tools/bench/mechanics_parts.h"
#include "tools/reference/reference_insertion.h"

#include <Eigen/Core>

#include <algorithm>
#include <cmath>
#include <deque>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace stylet::bench {
namespace {

constexpr double kSpeed = 0.1;  // m/s

struct Late {
  double change = 0;  // N, largest of the axial force in 1 ms
  double step = 0;    // N, the largest one that is not its slope
  int beyond = 0;     // haptic steps beyond the patch
};

/// An insertion of 70 mm into the cube of R1 with the liver's resistance; each patch comes `latency` ms late.
Late insert(reference::ReferenceInsertion insertion, int nodes, double hz, int latency) {
  insertion.nodes_per_edge = nodes;
  insertion.simulation_hz = hz;
  std::vector<physics::SimulationBody> bodies;
  bodies.push_back(insertion.body());
  physics::SimulationLoop simulation(std::move(bodies), {.dt = 1 / hz, .lay_contacts = false});
  auto tissues = std::make_shared<physics::TissueMap>();
  // After Okamura et al. 2004.
  tissues->tissues[1] = {
      .puncture_force = 1.8, .cutting_force = 0.94, .cutting_viscosity = 2, .friction_per_length = 18};
  physics::HapticLoopSettings settings;
  settings.needle = insertion.needle;
  settings.coupling = physics::Coupling::stylet;
  settings.track.spacing = insertion.contact_spacing;
  settings.tissues = tissues;
  physics::StylusPose hub = insertion.base(0);
  hub.position.x() -= 0.009;
  physics::HapticLoop haptic(settings, hub);

  const int period = static_cast<int>(std::lround(1000 / hz));
  physics::TissuePatch in_use = simulation.make_patch();
  struct Sent {
    int due;
    physics::TissuePatch patch;
  };
  std::deque<Sent> sent;
  const int worker_period = 5;
  Late result;
  std::vector<Eigen::Vector3d> forces;
  for (int step = 0; step < 900; ++step) {
    if (step % period == 0) {
      sent.push_back({step + latency, simulation.make_patch()});
      simulation.step({.needle = &haptic.state(), .time_s = 1e-3 * step}, sent.back().patch);
      if (step / period % worker_period == 0) simulation.worker().step();
    }
    while (!sent.empty() && sent.front().due <= step) {
      in_use = std::move(sent.front().patch);
      sent.pop_front();
    }
    if (step > 100) hub.position.x() += 1e-3 * kSpeed;
    const physics::NeedleState& needle = haptic.step(hub, 1e-3, in_use);
    forces.push_back(needle.wrench.force);
    result.beyond += (needle.flags & physics::kNeedlePatchLeft) != 0 ? 1 : 0;
  }
  result.change = reference::jump(forces, 0);
  result.step = reference::discontinuity(forces, 0);
  return result;
}

}  // namespace

Report mechanics_latency(const BenchOptions& options) {
  const reference::ReferenceInsertion r1 = reference::read_reference_insertion(options.reference_insertion);
  Report report;
  const std::vector<int> meshes = options.quick ? std::vector{12} : std::vector{7, 14, 20};
  for (const int nodes : meshes) {
    for (const double hz : {50.0, 25.0}) {
      const std::string name =
          "latency." + std::to_string(nodes) + "_nodes." + std::to_string(std::lround(hz)) + "_hz";
      const Late prompt = insert(r1, nodes, hz, 0);
      report.add({.name = name + ".0_ms.change", .value = prompt.change, .unit = "N"});
      report.add({.name = name + ".0_ms.step", .value = prompt.step, .unit = "N"});
      report.add({.name = name + ".0_ms.beyond_patch", .value = static_cast<double>(prompt.beyond), .unit = "ms"});
      for (const int latency : {20, 40, 60}) {
        const Late late = insert(r1, nodes, hz, latency);
        const std::string at = name + "." + std::to_string(latency) + "_ms";
        report.add(noted(at_most(at + ".excess", late.change - prompt.change, "N", 0.05),
                         "largest change of the axial force in 1 ms above that of the run without latency"));
        report.add(noted(at_most(at + ".step_excess", late.step - prompt.step, "N", 0.05),
                         "the same of the largest step that is not the slope of the force"));
        report.add({.name = at + ".beyond_patch", .value = static_cast<double>(late.beyond), .unit = "ms"});
      }
    }
  }
  return report;
}

}  // namespace stylet::bench
