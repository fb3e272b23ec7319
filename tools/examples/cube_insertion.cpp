// A needle goes into a cube of soft tissue and comes half out again: prints depth and force at every haptic step, as
// CSV.
#include "physics/loops/haptic_loop.h"
#include "physics/loops/simulation_loop.h"

#include <cstdio>
#include <memory>
#include <utility>
#include <vector>

using namespace stylet;

constexpr int kCells = 5;              // along an edge
constexpr double kEdge = 0.1;          // m
constexpr double kFreeTravel = 0.002;  // from the tip to the cube, m
constexpr double kStep = 4e-5;         // of the hub in a haptic step, m: 40 mm/s
constexpr int kIn = 800, kOut = 400;   // haptic steps
constexpr int kHapticSteps = 20;       // to a simulation step

// Six tetrahedra a cell, along the ways from its low corner to its high one. The face z = kEdge is held.
physics::SimulationBody cube() {
  physics::SimulationBody body;
  const int stride[3] = {1, kCells + 1, (kCells + 1) * (kCells + 1)};
  const int ways[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  for (int node = 0; node < stride[2] * (kCells + 1); ++node) {
    const int i = node % stride[1], j = node / stride[1] % stride[1], k = node / stride[2];
    body.mesh.nodes.push_back(Eigen::Vector3d(i, j, k) / kCells * kEdge);
    if (k == kCells) body.fixed_nodes.push_back(node);
    if (i == kCells || j == kCells || k == kCells) continue;
    for (const auto& way : ways) {
      const int second = node + stride[way[0]], third = second + stride[way[1]], last = third + stride[way[2]];
      const bool even = way[1] == (way[0] + 1) % 3;
      body.mesh.tets.push_back({node, second, even ? third : last, even ? last : third});
    }
  }
  body.tet_materials.assign(body.mesh.tets.size(), {.young_modulus = 10e3, .poisson_ratio = 0.45});
  return body;
}

int main() {
  auto tissues = std::make_shared<physics::TissueMap>();
  tissues->tissues[1] = {.puncture_force = 0.5, .cutting_force = 0.3, .friction_per_length = 10};
  physics::HapticLoopSettings settings;
  settings.coupling = physics::Coupling::stylet;
  settings.tissues = tissues;

  // The needle's +Z, from hub to tip, is that of the cube.
  physics::StylusPose hub;
  const double start = -kFreeTravel - settings.needle.length;
  hub.position = {0.047, 0.053, start};
  physics::HapticLoop haptic(settings, hub);
  std::vector<physics::SimulationBody> bodies;
  bodies.push_back(cube());
  physics::SimulationLoop simulation(std::move(bodies), {.dt = 0.020, .lay_contacts = false});
  physics::TissuePatch patch = simulation.make_patch();

  std::printf("depth_m,force_n\n");
  for (int step = 0; step < kIn + kOut; ++step) {
    if (step % kHapticSteps == 0) {
      simulation.step({.needle = &haptic.state()}, patch);
      simulation.worker().step();
    }
    hub.position.z() = start + kStep * (step < kIn ? step : 2 * kIn - step);
    const physics::NeedleState& needle = haptic.step(hub, 1e-3, patch);
    std::printf("%.17g,%.17g\n", needle.tip_depth, -needle.wrench.force.z());
  }
}
