// A bevelled tip: which way it steers, how much against theory, at which speed, in which tissue.
#include "engine/content/tissue_table.h"
#include "engine/files/json_reader.h"
#include "physics/contact/subgrid_compliance.h"
#include "tools/bench/coupling_parts.h"
#include "tools/bench/mechanics_parts.h"

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

namespace stylet::bench {
namespace {

constexpr double kBevelRatio = 0.2;
constexpr double kUnfelt = 1e-3;  // m: a compliance-free tissue's margin

/// Straight in along x, the needle's bevel facing +y; the cube is wider than R1's.
reference::ReferenceInsertion straight_in(double depth, double speed, const physics::ElasticMaterial& material) {
  reference::ReferenceInsertion insertion;
  insertion.cube_edge = 0.120;
  insertion.nodes_per_edge = 7;
  insertion.material = material;
  insertion.tip_start = {-kUnfelt, 0.5 * insertion.cube_edge + 0.003, 0.5 * insertion.cube_edge - 0.002};
  insertion.contact_spacing = 0.005;
  insertion.haptic_hz = 1000;
  insertion.simulation_hz = 50;
  insertion.duration = (depth + kUnfelt) / speed;
  insertion.axial_speed = {{0, speed}, {insertion.duration, speed}};
  return insertion;
}

struct Steering {
  double aside = 0;           // of the tip towards the side that the bevel faces, m
  double curvature = 0;       // of the last half of the track at rest, positive: towards that side, 1/m
  double stiffness = 0;       // of the foundation there without the mesh, mean over its contacts, N/m^2
  double tip_compliance = 0;  // mean, m/N
  std::uint32_t flags = 0;
};

/// Second derivative of the parabola through points (x, y), 1/m.
double curvature_of(const std::vector<Eigen::Vector2d>& points) {
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  const double middle = points[points.size() / 2].x();
  for (const Eigen::Vector2d& point : points) {
    const double x = point.x() - middle;
    const Eigen::Vector3d row(1, x, x * x);
    normal += row * row.transpose();
    right += row * point.y();
  }
  return 2 * normal.ldlt().solve(right)[2];
}

Steering steer(const reference::ReferenceInsertion& insertion, const physics::InsertionResistance& resistance,
               double bevel_ratio, double roll_deg = 0) {
  reference::ReferenceRun run{.coupling = physics::Coupling::stylet,
                              .track = {.bevel_ratio = bevel_ratio},
                              .tissues = one_tissue(resistance)};
  run.roll_deg = roll_deg;
  reference::ReferenceExperiment experiment(insertion, run);
  const Eigen::Vector3d facing =
      insertion.base(0).orientation *
      (Eigen::AngleAxisd(roll_deg * std::numbers::pi / 180, Eigen::Vector3d::UnitZ()) * Eigen::Vector3d::UnitX());
  while (experiment.time_s() < insertion.duration - 1e-9) experiment.advance();
  const physics::NeedleState& needle = experiment.needle();
  const physics::TissueModel& model = experiment.simulation().model(0);
  Steering result;
  result.flags = experiment.needle_flags();
  const Eigen::Vector3d tip = needle.positions.col(needle.node_count - 1);
  result.aside = (tip - insertion.tip_start).dot(facing);
  std::vector<Eigen::Vector2d> track;
  int counted = 0;
  for (int c = 0; c < needle.contact_count; ++c) {
    const physics::NeedleContact& contact = needle.contacts[c];
    const auto& nodes = model.mesh.tets[contact.tet];
    Eigen::Vector3d at = Eigen::Vector3d::Zero();
    physics::SubgridSite site{.tet_volume = 0, .material = insertion.material, .barycentric = contact.barycentric};
    for (std::size_t k = 0; k < 4; ++k) {
      const double weight = contact.barycentric[static_cast<Eigen::Index>(k)];
      at += weight * model.mesh.nodes[nodes[k]];
      site.tet_volume += weight * model.surroundings[nodes[k]].tet_volume;
    }
    const double offset = (at - insertion.tip_start).dot(facing);
    if (at.x() < 0.5 * (tip.x() - insertion.tip_start.x())) continue;
    track.emplace_back(at.x(), offset);
    const double radius = 0.5 * insertion.needle.outer_diameter;
    result.stiffness +=
        1 / physics::shaft_compliance(site, radius, insertion.contact_spacing).lateral / insertion.contact_spacing;
    result.tip_compliance += physics::channel_tip_compliance(site, physics::NeedleTrackSettings{}.tip_radius);
    ++counted;
  }
  result.stiffness /= counted;
  result.tip_compliance /= counted;
  result.curvature = track.size() > 2 ? curvature_of(track) : std::nan("");
  return result;
}

/// Of the path of a tip that cuts its way and is pushed aside by `steering`, going on steadily in an elastic
/// foundation that begins `dent` behind the tip, 1/m (physics/README.md eq. 26b).
double path_curvature(double bending_stiffness, double foundation, double tip_compliance, double side_length,
                      double steering, double dent) {
  const double l = std::pow(foundation / (4 * bending_stiffness), 0.25);
  const double held = side_length / (2 * bending_stiffness * l * l * tip_compliance * (1 + 2 * l * side_length));
  const double load = steering / (1 + held);
  return load / (bending_stiffness * l) * ((1 + l * side_length) / (1 + 2 * l * side_length) + l * dent);
}

double bending_stiffness(const physics::NeedleProperties& needle) {
  return needle.young_modulus * std::numbers::pi / 64 *
         (std::pow(needle.outer_diameter, 4) - std::pow(needle.inner_diameter, 4));
}

/// A needle much longer than its bends, in tissue whose mesh is held: what gives way is around the shaft alone.
void against_theory(bool quick, Report& report) {
  constexpr double kCutting = 0.94;  // N, liver
  reference::ReferenceInsertion insertion = straight_in(0.110, 0.045, {.young_modulus = 40e3, .poisson_ratio = 0.45});
  insertion.needle.outer_diameter = 0.7e-3;
  insertion.needle.inner_diameter = 0.4e-3;
  insertion.needle.beams = 32;
  insertion.contact_spacing = 0.00125;
  for (const bool held : {true, false}) {
    if (held)
      insertion.held_height = 0.110;
    else
      insertion.held_height = 1e-9;
    const Steering s = steer(insertion, {.cutting_force = kCutting}, kBevelRatio);
    const double theory = path_curvature(bending_stiffness(insertion.needle), s.stiffness, s.tip_compliance,
                                         physics::NeedleTrackSettings{}.side_length, kBevelRatio * kCutting,
                                         s.tip_compliance * kCutting);
    if (held) {
      report.add(noted(within("bevel.curvature.foundation", -s.curvature, "1/m", theory, 0.1 * theory),
                       "needle of 0.7 mm in 40 kPa, nodes of the mesh held: the foundation of eq. 19 alone"));
    } else {
      report.add(
          noted({"bevel.curvature.elastic", -s.curvature, "1/m", theory}, "the same, the mesh free to give way too"));
    }
    report.add(at_most(held ? "bevel.curvature.foundation.flags" : "bevel.curvature.elastic.flags", s.flags, "1", 0));
    if (quick) break;
  }
}

const content::Tissue& named(const content::TissueTable& table, const std::string& name) {
  const int at = content::find_tissue(table.tissues, name);
  if (at < 0) throw std::runtime_error("no tissue '" + name + "' in the table");
  return table.tissues[at];
}

}  // namespace

Report mechanics_bevel(const BenchOptions& options) {
  Report report;
  against_theory(options.quick, report);
  constexpr double kDepth = 0.100, kSpeed = 0.020, kMillimetres = 1e3;

  // Every tissue that needles are driven into.
  const auto folder = options.reference_insertion.parent_path().parent_path();
  files::JsonFile body_file(folder / "tissues.json"), phantom_file(folder / "phantom_tissues.json");
  const content::TissueTable body = content::read_tissues(body_file), phantom = content::read_tissues(phantom_file);
  const std::vector<std::string> names =
      options.quick ? std::vector<std::string>{"skin", "liver", "agar"}
                    : std::vector<std::string>{"skin", "muscle", "tumour", "agar", "liver", "fat"};
  for (const std::string& name : names) {
    const content::Tissue& tissue = named(name == "agar" ? phantom : body, name);
    const Steering s =
        steer(straight_in(kDepth, options.quick ? 0.1 : kSpeed, tissue.mechanics), tissue.needle, kBevelRatio);
    report.add(noted(at_most("bevel.aside." + name, kMillimetres * s.aside, "mm", -0.1),
                     "of the tip towards the bevel's face, 18G, 100 mm deep"));
  }

  const content::Tissue& liver = named(body, "liver");
  std::vector<double> aside;
  for (const double speed : options.quick ? std::vector{0.05, 0.1} : std::vector{0.005, 0.01, 0.02, 0.05, 0.1}) {
    aside.push_back(steer(straight_in(kDepth, speed, liver.mechanics), liver.needle, kBevelRatio).aside);
  }
  report.add(noted(at_most("bevel.speed.spread", kPercent * std::abs(relative_spread(aside)), "%", 10),
                   options.quick ? "liver, 50 and 100 mm/s" : "liver, 5 to 100 mm/s"));
  // Where the block leads a symmetric tip, it does so whichever way that is turned.
  const reference::ReferenceInsertion insertion = straight_in(kDepth, 0.1, liver.mechanics);
  const double symmetric = steer(insertion, liver.needle, 0).aside + steer(insertion, liver.needle, 0, 180).aside;
  report.add(noted(at_most("bevel.symmetric.aside", kMillimetres * 0.5 * std::abs(symmetric), "mm", 1e-6),
                   "half the difference between a symmetric tip and the same turned by half a turn"));
  return report;
}

}  // namespace stylet::bench
