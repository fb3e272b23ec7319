#include "tools/bench/insertion_trace.h"

#include "physics/contact/shaft.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
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

/// The normals of a haptic step, two a contact, by contact.
struct Normals {
  std::vector<std::uint32_t> ids;
  Eigen::Matrix3Xd directions;  // [3 x 2 contacts]
};

Normals normals_of(const physics::HapticLoop& haptic) {
  Normals normals{.ids = {}, .directions = haptic.directions()};
  for (int i = 0; i < haptic.state().contact_count; ++i) normals.ids.push_back(haptic.state().contacts[i].id);
  return normals;
}

std::vector<double> direction_changes(const Normals& first, const Normals& last) {
  std::vector<double> norms;
  for (std::size_t i = 0; i < last.ids.size(); ++i) {
    const auto before = std::ranges::find(first.ids, last.ids[i]);
    if (before == first.ids.end()) continue;
    const auto of = [](const Normals& normals, std::size_t contact) {
      return normals.directions.middleCols<2>(2 * static_cast<Eigen::Index>(contact));
    };
    const auto was = static_cast<std::size_t>(before - first.ids.begin());
    norms.push_back((of(last, i) - of(first, was)).colwise().norm().maxCoeff());
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
    Normals first;
    for (int i = 0; i < insertion.haptic_steps_per_simulation_step(); ++i) {
      const double time = dt * static_cast<double>(++haptic_step);
      const physics::NeedleState& needle = haptic.step(insertion.base(time), dt, patches.back());
      trace.time_s.push_back(time);
      trace.forces.push_back(needle.wrench.force);
      trace.along_shaft.push_back(along_shaft(needle));
      if (i == 0) first = normals_of(haptic);
    }
    trace.direction_changes.push_back({trace.time_s.back(), direction_changes(first, normals_of(haptic))});
  }
  return trace;
}

}  // namespace stylet::bench
