#include "tools/bench/insertion_trace.h"

#include "physics/contact/shaft.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace stylet::bench {
namespace {

double along_shaft(const physics::NeedleState& needle) {
  const auto nodes = needle.positions.leftCols(needle.node_count);
  double sum = 0;
  for (int i = 0; i < needle.contact_count; ++i) {
    const physics::NeedleContact& contact = needle.contacts[i];
    sum += contact.force.dot(physics::project_on_shaft(nodes, contact.position).tangent);
  }
  return sum;
}

/// Against the directions that the simulation step laid: what a frozen coupling would be off by.
std::vector<double> direction_changes(const physics::NeedleState& needle, const physics::BodyPatch& patch) {
  std::vector<double> norms;
  const auto nodes = needle.positions.leftCols(needle.node_count);
  for (int i = 0; i < needle.contact_count; ++i) {
    const physics::NeedleContact& contact = needle.contacts[i];
    const auto laid = std::find_if(patch.contacts.begin(), patch.contacts.begin() + patch.contact_count,
                                   [&](const physics::PatchContact& c) { return c.id == contact.id; });
    if (laid == patch.contacts.begin() + patch.contact_count) continue;
    const physics::ShaftPoint point = physics::shaft_point(nodes, contact.beam, contact.beam_fraction);
    const auto& orientation = needle.orientations[contact.beam];
    const Eigen::Matrix<double, 3, 2> now = physics::lateral_directions(point.tangent, orientation);
    norms.push_back((now - laid->directions).colwise().norm().maxCoeff());
  }
  return norms;
}

}  // namespace

InsertionTrace trace_insertion(const reference::ReferenceInsertion& insertion, const reference::ReferenceRun& run) {
  std::vector<physics::SimulationBody> bodies;
  bodies.push_back(insertion.body());
  physics::SimulationLoop simulation(
      std::move(bodies), {.dt = 1 / insertion.simulation_hz, .contact_spacing = insertion.contact_spacing});
  physics::HapticLoop haptic({.needle = insertion.needle,
                              .base = {},
                              .coupling = run.coupling,
                              .relative_compliance = run.relative_compliance},
                             insertion.base(0));
  std::vector<physics::TissuePatch> patches;  // newest first
  for (int i = 0; i <= run.latency_steps; ++i) patches.push_back(simulation.make_patch());

  InsertionTrace trace;
  const auto simulation_steps = std::lround(insertion.duration * insertion.simulation_hz);
  const double dt = 1 / insertion.haptic_hz;
  long haptic_step = 0;
  for (long step = 1; step <= simulation_steps; ++step) {
    std::rotate(patches.begin(), patches.end() - 1, patches.end());
    simulation.step({.needle = &haptic.state(), .time_s = dt * static_cast<double>(haptic_step)}, patches.front());
    if (run.worker_period > 0 && step % run.worker_period == 0) simulation.worker().step();
    for (int i = 0; i < insertion.haptic_steps_per_simulation_step(); ++i) {
      const double time = dt * static_cast<double>(++haptic_step);
      const physics::NeedleState& needle = haptic.step(insertion.base(time), dt, patches.back());
      trace.time_s.push_back(time);
      trace.forces.push_back(needle.wrench.force);
      trace.along_shaft.push_back(along_shaft(needle));
    }
    trace.direction_changes.push_back(
        {trace.time_s.back(), direction_changes(haptic.state(), patches.back().bodies[0])});
  }
  return trace;
}

}  // namespace stylet::bench
