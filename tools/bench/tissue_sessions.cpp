#include "engine/readers/motion.h"
#include "engine/readers/scenario.h"
#include "engine/session/coupled_loops.h"
#include "engine/session/lockstep.h"
#include "engine/session/recorded_stylus.h"
#include "physics/tissue/quadratic.h"
#include "physics/tissue/refinement.h"
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
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace stylet::bench {
namespace {

using physics::Element;

constexpr double kLongest = 20;      // s
constexpr double kLongestQuick = 3;  // s

/// As shipped, and of the linear tetrahedra that were shipped before.
constexpr std::array kVariants{"linear", "shipped"};

content::Scene scene_of(const std::string& name, const std::string& variant) {
  if (variant == "shipped") return readers::load_scene(readers::find_scenario(name));
  return scenario_variant(name, {.element = Element::linear, .poisson_ratio = 0.45, .wall_nodes = kLinearWallNodes});
}

/// Least det F of a body: where its strain is measured, and in the mean of an element, which is where a quadratic one
/// has its pressure.
struct LeastVolume {
  double at_point = std::numeric_limits<double>::infinity();
  double of_element = std::numeric_limits<double>::infinity();
  Eigen::Vector3d point = Eigen::Vector3d::Zero();  ///< a node of the element of at_point, m
};

LeastVolume least_volume(const physics::TissueModel& model, std::span<const Eigen::Array4d> volumes,
                         const Eigen::Matrix3Xd& positions) {
  LeastVolume least;
  if (model.is_quadratic()) {
    std::vector<Eigen::Matrix3d> cofactors(static_cast<std::size_t>(model.point_count()));
    physics::find_cofactors(model, positions, cofactors);
    for (std::size_t e = 0; e < volumes.size(); ++e) {
      Eigen::Array4d ratios;
      for (std::size_t q = 0; q < 4; ++q)  // det cof F = (det F)^2
        ratios[static_cast<Eigen::Index>(q)] = std::sqrt(std::max(cofactors[4 * e + q].determinant(), 0.0));
      if (ratios.minCoeff() < least.at_point) {
        least.at_point = ratios.minCoeff();
        least.point = positions.col(model.mesh.tets[physics::kTetsOfRefined * e][0]);
      }
      least.of_element = std::min(least.of_element, (ratios * volumes[e]).sum() / volumes[e].sum());
    }
    return least;
  }
  for (std::size_t t = 0; t < model.mesh.tets.size(); ++t) {
    const auto& n = model.mesh.tets[t];
    const Eigen::Vector3d origin = positions.col(n[0]);
    const Eigen::Vector3d a = positions.col(n[1]) - origin;
    const Eigen::Vector3d b = positions.col(n[2]) - origin;
    const double ratio = a.cross(b).dot(positions.col(n[3]) - origin) / (6 * model.tets[t].volume);
    if (ratio >= least.at_point) continue;
    least.at_point = ratio;
    least.point = origin;
  }
  least.of_element = least.at_point;
  return least;
}

/// K of a body's softest element, across its layers, and of its stiffest, along them, Pa.
std::pair<double, double> bulk_moduli(const content::DeformableBody& body) {
  double least = std::numeric_limits<double>::infinity();
  double greatest = 0;
  for (const physics::ElasticMaterial& m : body.tet_mechanics) {
    const double along = m.young_modulus / (3 * (1 - 2 * m.poisson_ratio));
    least = std::min(least, m.layers.across * along);
    greatest = std::max(greatest, along);
  }
  return {least, greatest};
}

/// The recorded motion in lockstep.
void run(const std::string& name, const std::string& variant, double longest, Report& report) {
  const content::Scene scene = scene_of(name, variant);
  std::vector<physics::TissueModel> models;
  std::vector<std::vector<Eigen::Array4d>> volumes;
  for (const content::DeformableBody& body : scene.bodies) {
    models.emplace_back(body.mesh, body.tet_mechanics, body.fixed_nodes, 0, body.element);
    volumes.emplace_back();
    if (body.element != Element::quadratic) continue;
    for (std::size_t e = 0; e * physics::kTetsOfRefined < body.mesh.tets.size(); ++e)
      volumes.back().push_back(physics::volumes_at_points(body.mesh, e));
  }
  const content::MotionSample first = readers::sample_motion(scene.motion.stylus, 0);
  session::CoupledLoops loops(scene, physics::Coupling::stylet, {first.pose.position, first.pose.orientation}, {});
  physics::TissuePatch patch = loops.make_patch();
  const double dt = 1 / scene.rates.simulation_hz;
  const auto per_step = static_cast<int>(std::lround(scene.rates.haptic_hz / scene.rates.simulation_hz));
  const double seconds = std::min(scene.motion.stylus.back().time_s, longest);
  LeastVolume least;
  LeastVolume before_puncture;
  std::string where, where_point;
  double pressure = 0;      // of the head, in the mean of its face, before the first puncture, Pa
  double tip_pressure = 0;  // Pa
  const double section = 0.25 * M_PI * scene.needle.outer_diameter * scene.needle.outer_diameter;
  double punctured = -1;
  int inverted = 0;
  session::LockstepFactors factors;
  Samples steps(2000);
  for (int step = 0; step * dt < seconds; ++step) {
    const session::LockstepFactors::Turn turn = factors.next();
    physics::SimulationReport done;
    steps.time([&] {
      done = loops.simulation_step(step * dt, loops.needle(), session::probe_pose(scene, step * dt), turn.take,
                                   turn.request, patch);
    });
    inverted += done.inverted_tets;
    const physics::RigidPose held = session::probe_pose(scene, step * dt);
    if (punctured < 0 && done.probe.area > 0)
      pressure = std::max(
          pressure, -done.probe.wrench.force.dot(held.orientation * Eigen::Vector3d::UnitZ()) / done.probe.area);
    factors.stepped(done, loops.worker());
    for (std::size_t b = 0; b < models.size(); ++b) {
      const LeastVolume of_body = least_volume(models[b], volumes[b], loops.tissue().positions[b]);
      least.at_point = std::min(least.at_point, of_body.at_point);
      least.of_element = std::min(least.of_element, of_body.of_element);
      if (punctured >= 0) continue;
      if (of_body.at_point < before_puncture.at_point) {
        before_puncture.at_point = of_body.at_point;
        const physics::NeedleState& needle = loops.needle();
        where_point = fmt::format(
            "in {} at {:.2f} s, {:.0f} mm from the tip of the needle, {:.0f} mm from the middle of the head's face",
            scene.bodies[b].name, step * dt,
            1e3 * (of_body.point - needle.positions.col(needle.node_count - 1)).norm(),
            1e3 * (of_body.point - held.position).norm());
      }
      if (of_body.of_element >= before_puncture.of_element) continue;
      before_puncture.of_element = of_body.of_element;
      where = fmt::format("in {} at {:.2f} s", scene.bodies[b].name, step * dt);
    }
    if (done.inverted_tets > 0) {  // a cofactor does not know the sign
      least.at_point = std::min(least.at_point, 0.0);
      if (punctured < 0) before_puncture.at_point = std::min(before_puncture.at_point, 0.0);
    }
    for (int k = 0; k < per_step; ++k) {
      const double now = step * dt + k * loops.haptic_dt();
      const haptic::StylusSample stylus =
          session::stylus_sample(readers::sample_motion(scene.motion.stylus, now), now);
      const physics::NeedleState& needle = loops.haptic_step(stylus, patch);
      if (punctured < 0) tip_pressure = std::max(tip_pressure, needle.wrench.force.norm() / section);
      if (needle.puncture_count > 0 && punctured < 0) punctured = now;
    }
  }
  const std::string key = fmt::format("sessions.{}.{}.", name, variant);
  std::size_t nodes = 0;
  for (const physics::TissueModel& model : models) nodes += model.mesh.nodes.size();
  report.add({.name = key + "nodes", .value = static_cast<double>(nodes), .unit = "1"});
  const auto before = [&](const std::string& name_of, double value, const std::string& note) {
    Measurement least_of = at_least(key + name_of, value, "1", 0.9);
    if (variant != "shipped") {
      least_of.target.clear();
      least_of.met.reset();
    }
    report.add(noted(std::move(least_of), note));
  };
  before("least_det_f_before_puncture", before_puncture.of_element,
         "in the mean of an element, " + where +
             (punctured < 0 ? "; nothing was punctured" : fmt::format("; first puncture at {:.2f} s", punctured)));
  before("least_det_f_before_puncture.at_point", before_puncture.at_point,
         "where strain is measured: " + where_point);
  // What the loads allow, whatever the mesh: det F = 1 - p/K under a pressure p.
  const auto allows = [&](const std::string& load, double p, double bulk, const std::string& of) {
    report.add(
        noted({.name = key + load + ".pressure", .value = 1e-3 * p, .unit = "kPa"}, "largest before the puncture"));
    report.add(noted({.name = key + load + ".least_det_f", .value = 1 - p / bulk, .unit = "1"},
                     fmt::format("1 - p/K, K = {:.0f} kPa of {}", 1e-3 * bulk, of)));
  };
  const auto [softest, stiffest] =
      bulk_moduli(scene.bodies[static_cast<std::size_t>(std::max(scene.probe.presses, 0))]);
  if (scene.probe.presses >= 0) allows("head", pressure, softest, "the softest element; p is the mean on the face");
  allows("tip", tip_pressure, stiffest, "the stiffest element; p is the needle's push over its section");
  report.add({.name = key + "least_det_f", .value = least.of_element, .unit = "1"});
  report.add({.name = key + "least_det_f.at_point", .value = least.at_point, .unit = "1"});
  report.add(at_most(key + "inverted", inverted, "1", 0));
  report.add({.name = key + "step.median", .value = 1e-3 * steps.median(), .unit = "ms"});
  report.add(at_most(key + "step.p99", 1e-3 * steps.p99(), "ms", 15));
}

}  // namespace

Report tissue_sessions(const BenchOptions& options) {
  Report report;
  for (const char* name : {"tutorial", "liver_biopsy", "rfa", "cyst_aspiration"}) {
    if (options.quick && std::string(name) != "tutorial") continue;
    for (const char* variant : kVariants) run(name, variant, options.quick ? kLongestQuick : kLongest, report);
  }
  return report;
}

}  // namespace stylet::bench
