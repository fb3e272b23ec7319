#include "engine/readers/motion.h"
#include "engine/session/coupled_loops.h"
#include "engine/session/recorded_stylus.h"
#include "physics/tissue/quadratic.h"
#include "tools/bench/samples.h"
#include "tools/bench/scenario_variant.h"
#include "tools/bench/tissue_parts.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <string>
#include <vector>

namespace stylet::bench {
namespace {

using physics::Element;

constexpr int kFactorSteps = 5;      // simulation steps from a request to its factor, as in lockstep sessions
constexpr double kLongest = 20;      // s
constexpr double kLongestQuick = 3;  // s

struct Variant {
  const char* name;
  MeshChoice choice;
};

constexpr std::array kVariants{
    Variant{"linear", {.element = Element::linear, .poisson_ratio = 0.45}},
    Variant{"quadratic", {.element = Element::quadratic, .poisson_ratio = 0.49, .wall_nodes = kQuadraticWallNodes}},
};

/// Least det F of a body, where its strain is measured.
double least_volume(const physics::TissueModel& model, const Eigen::Matrix3Xd& positions) {
  double least = std::numeric_limits<double>::infinity();
  if (model.is_quadratic()) {
    std::vector<Eigen::Matrix3d> cofactors(static_cast<std::size_t>(model.point_count()));
    physics::find_cofactors(model, positions, cofactors);
    // det cof F = (det F)^2
    for (const Eigen::Matrix3d& c : cofactors) least = std::min(least, std::sqrt(std::max(c.determinant(), 0.0)));
    return least;
  }
  for (std::size_t t = 0; t < model.mesh.tets.size(); ++t) {
    const auto& n = model.mesh.tets[t];
    const Eigen::Vector3d origin = positions.col(n[0]);
    const Eigen::Vector3d a = positions.col(n[1]) - origin;
    const Eigen::Vector3d b = positions.col(n[2]) - origin;
    least = std::min(least, a.cross(b).dot(positions.col(n[3]) - origin) / (6 * model.tets[t].volume));
  }
  return least;
}

/// The recorded motion in lockstep.
void run(const std::string& name, const Variant& variant, double longest, Report& report) {
  const content::Scene scene = scenario_variant(name, variant.choice);
  std::vector<physics::TissueModel> models;
  for (const content::DeformableBody& body : scene.bodies)
    models.emplace_back(body.mesh, body.tet_mechanics, body.fixed_nodes, 0, body.element);
  const content::MotionSample first = readers::sample_motion(scene.motion.stylus, 0);
  session::CoupledLoops loops(scene, physics::Coupling::stylet, {first.pose.position, first.pose.orientation}, {});
  physics::TissuePatch patch = loops.make_patch();
  const double dt = 1 / scene.rates.simulation_hz;
  const auto per_step = static_cast<int>(std::lround(scene.rates.haptic_hz / scene.rates.simulation_hz));
  const double seconds = std::min(scene.motion.stylus.back().time_s, longest);
  double least = std::numeric_limits<double>::infinity();
  double before_puncture = least;
  std::string where;
  double punctured = -1;
  int inverted = 0;
  int since_request = -1;
  Samples steps(2000);
  for (int step = 0; step * dt < seconds; ++step) {
    if (since_request >= 0) ++since_request;
    const bool take = since_request >= kFactorSteps;
    physics::SimulationReport done;
    steps.time([&] {
      done = loops.simulation_step(step * dt, loops.needle(), session::probe_pose(scene, step * dt), take,
                                   since_request < 0 || take, patch);
    });
    inverted += done.inverted_tets;
    if (take) since_request = -1;
    if (done.factorisation_requested) {
      loops.worker().step();
      since_request = 0;
    }
    for (std::size_t b = 0; b < models.size(); ++b) {
      const double of_body = least_volume(models[b], loops.tissue().positions[b]);
      least = std::min(least, of_body);
      if (punctured >= 0 || of_body >= before_puncture) continue;
      before_puncture = of_body;
      where = fmt::format("in {} at {:.2f} s", scene.bodies[b].name, step * dt);
    }
    if (done.inverted_tets > 0) {  // a cofactor does not know the sign
      least = std::min(least, 0.0);
      if (punctured < 0) before_puncture = std::min(before_puncture, 0.0);
    }
    for (int k = 0; k < per_step; ++k) {
      const double now = step * dt + k * loops.haptic_dt();
      const haptic::StylusSample stylus =
          session::stylus_sample(readers::sample_motion(scene.motion.stylus, now), now);
      if (loops.haptic_step(stylus, patch).puncture_count > 0 && punctured < 0) punctured = now;
    }
  }
  const bool quadratic = variant.choice.element == Element::quadratic;
  const std::string key = fmt::format("sessions.{}.{}.", name, variant.name);
  std::size_t nodes = 0;
  for (const physics::TissueModel& model : models) nodes += model.mesh.nodes.size();
  report.add({.name = key + "nodes", .value = static_cast<double>(nodes), .unit = "1"});
  report.add(noted(
      quadratic ? at_least(key + "least_det_f_before_puncture", before_puncture, "1", 0.9)
                : Measurement{.name = key + "least_det_f_before_puncture", .value = before_puncture, .unit = "1"},
      where + (punctured < 0 ? "; nothing was punctured" : fmt::format("; first puncture at {:.2f} s", punctured))));
  report.add({.name = key + "least_det_f", .value = least, .unit = "1"});
  report.add(at_most(key + "inverted", inverted, "1", 0));
  report.add({.name = key + "step.median", .value = 1e-3 * steps.median(), .unit = "ms"});
  report.add(at_most(key + "step.p99", 1e-3 * steps.p99(), "ms", 15));
}

}  // namespace

Report tissue_sessions(const BenchOptions& options) {
  Report report;
  for (const char* name : {"tutorial", "liver_biopsy", "rfa", "cyst_aspiration"}) {
    if (options.quick && std::string(name) != "tutorial") continue;
    for (const Variant& variant : kVariants) run(name, variant, options.quick ? kLongestQuick : kLongest, report);
  }
  return report;
}

}  // namespace stylet::bench
