// Simulation step of a scenario with all its organs: CPU time of the thread, contact rows and forces, with the breath
// held and with quiet breathing; needle, probe and motion as the scenario says.
//
//   bin/stylet_organ_contact_bench [SCENARIO] [SECONDS]
#include "engine/readers/motion.h"
#include "engine/readers/scenario.h"
#include "engine/session/coupled_loops.h"
#include "engine/session/recorded_stylus.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <string>
#include <vector>

namespace stylet {
namespace {

/// CPU time of this thread, s: what the work costs when other programs are pressing on the cores.
double thread_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

void run(const content::Scene& scene, const std::string& name, double seconds) {
  const content::MotionSample first = readers::sample_motion(scene.motion.stylus, 0);
  session::CoupledLoops loops(scene, physics::Coupling::paper_updated, {first.pose.position, first.pose.orientation},
                              {});
  physics::TissuePatch patch = loops.make_patch();
  const auto per_step = static_cast<int>(std::lround(scene.rates.haptic_hz / scene.rates.simulation_hz));
  const double dt = 1 / scene.rates.simulation_hz;
  std::vector<double> times;
  int rows = 0, pressing = 0, left_out = 0;
  double deepest = 0, force = 0, probe_force = 0, probe_area = 0, target_motion = 0;
  std::uint32_t flags = 0;
  const Eigen::Matrix3Xd rest = loops.tissue().positions[scene.bodies.size() > 1 ? 1 : 0];
  for (int step = 0; step * dt < seconds; ++step) {
    const double t = step * dt;
    const double before = thread_seconds();
    const physics::SimulationReport report = loops.simulation_step(t, loops.needle(), true, true, patch);
    times.push_back(1e3 * (thread_seconds() - before));
    loops.worker().step();
    for (int k = 0; k < per_step; ++k) {
      const double now = t + k * loops.haptic_dt();
      const haptic::StylusSample stylus =
          session::stylus_sample(readers::sample_motion(scene.motion.stylus, now), now);
      loops.haptic_step(stylus, patch);
    }
    flags |= report.flags;
    rows = std::max(rows, report.organs.rows);
    pressing = std::max(pressing, report.organs.pressing);
    left_out = std::max(left_out, report.organs.left_out);
    deepest = std::max(deepest, report.organs.deepest);
    force = std::max(force, report.organs.force_n);
    probe_force = std::max(probe_force, report.probe.wrench.force.norm());
    probe_area = std::max(probe_area, report.probe.area);
    const Eigen::Matrix3Xd moved = loops.tissue().positions[scene.bodies.size() > 1 ? 1 : 0] - rest;
    target_motion = std::max(target_motion, moved.colwise().norm().mean());
  }
  const double first_step = times.front();
  std::sort(times.begin(), times.end());
  const auto at = [&](double q) {
    return times[static_cast<std::size_t>(q * static_cast<double>(times.size() - 1))];
  };
  fmt::print(
      "{:<24} step {:6.2f} ms median, {:6.2f} p99, {:6.2f} max, {:6.2f} first: {:5.0f} Hz | rows {:3d}, pressing "
      "{:3d}, left out {:3d} | organs {:6.2f} N, overlap {:5.3f} mm | probe {:5.2f} N on {:4.0f} mm2 | mean motion "
      "{:4.1f} mm | flags {:#x}\n",
      name, at(0.5), at(0.99), times.back(), first_step, 1e3 / at(0.5), rows, pressing, left_out, force,
      1e3 * deepest, probe_force, 1e6 * probe_area, 1e3 * target_motion, flags);
}

}  // namespace
}  // namespace stylet

int main(int argc, char** argv) {
  using namespace stylet;
  const std::string scenario = argc > 1 ? argv[1] : "liver_biopsy";
  const double seconds = argc > 2 ? std::strtod(argv[2], nullptr) : 10;
  content::Scene scene = readers::load_scene(readers::find_scenario(scenario));
  for (const content::DeformableBody& body : scene.bodies) {
    fmt::print("{}: {} nodes, {} held\n", body.name, body.mesh.nodes.size(), body.fixed_nodes.size());
  }
  content::Scene apart = scene;
  apart.contacts.clear();
  apart.probe.presses = -1;
  apart.breathing.amplitude = 0;
  run(apart, "no contact", seconds);
  scene.breathing.amplitude = 0;
  run(scene, "contact, breath held", seconds);
  scene.breathing.amplitude = 1;
  scene.breathing.holds.clear();
  run(scene, "contact, breathing", seconds);
  // The probe pushed 10 mm further in over the first seconds.
  content::MotionSample still;
  still.pose = {scene.probe.pose.position, scene.probe.pose.orientation};
  content::MotionSample pressed = still;
  pressed.time_s = 0.4 * seconds;
  pressed.pose.position += 0.010 * (still.pose.orientation * Eigen::Vector3d::UnitZ());
  scene.motion.probe = {still, pressed};
  run(scene, "and probe 10 mm deeper", seconds);
}
