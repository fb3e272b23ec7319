// The insertion of tools/examples as the engine runs it: its own library, its own flags, its own cube.
#include "physics/loops/haptic_loop.h"
#include "physics/loops/simulation_loop.h"
#include "tools/reference/kuhn_box.h"

#include <cstdio>
#include <memory>
#include <utility>
#include <vector>

using namespace stylet;

int main() {
  physics::SimulationBody cube;
  cube.mesh = reference::kuhn_box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.1), {5, 5, 5});
  cube.tet_materials.assign(cube.mesh.tets.size(), {.young_modulus = 10e3, .poisson_ratio = 0.45});
  cube.fixed_nodes = reference::nodes_where(cube.mesh, [](const Eigen::Vector3d& x) { return x.z() > 0.0999; });

  physics::HapticLoopSettings settings;
  settings.coupling = physics::Coupling::stylet;
  auto tissues = std::make_shared<physics::TissueMap>();
  tissues->tissues[1] = {.puncture_force = 0.5, .cutting_force = 0.3, .friction_per_length = 10};
  settings.tissues = tissues;
  physics::StylusPose hub{.position = {0.047, 0.053, -0.152}};
  physics::HapticLoop haptic(settings, hub);
  std::vector<physics::SimulationBody> bodies;
  bodies.push_back(std::move(cube));
  physics::SimulationLoop simulation(std::move(bodies), {.dt = 0.020, .lay_contacts = false});
  physics::TissuePatch patch = simulation.make_patch();

  std::puts("depth_m,force_n");
  const auto haptic_step = [&](int forward) {
    hub.position.z() = -0.152 + 4e-5 * forward;
    const physics::NeedleState& needle = haptic.step(hub, 1e-3, patch);
    std::printf("%.17g,%.17g\n", needle.tip_depth, -needle.wrench.force.z());
  };
  for (int simulation_step = 0; simulation_step < 60; ++simulation_step) {
    simulation.step({.needle = &haptic.state()}, patch);
    simulation.worker().step();
    for (int i = 20 * simulation_step; i < 20 * (simulation_step + 1); ++i) haptic_step(i < 800 ? i : 1600 - i);
  }
}
