#include "engine/content/tissue_table.h"
#include "engine/files/json_reader.h"
#include "engine/gltf/gltf.h"
#include "engine/mesh/solid.h"
#include "engine/readers/anatomy.h"
#include "engine/readers/deformable.h"
#include "engine/readers/instruments.h"
#include "engine/readers/patient_procedure.h"
#include "engine/readers/scenario.h"
#include "engine/readers/scenario_file.h"
#include "engine/session/coupled_loops.h"
#include "physics/contact/subgrid_compliance.h"
#include "physics/loops/simulation_loop.h"
#include "physics/tissue/tet_topology.h"
#include "physics/tissue/tissue_model.h"
#include "tools/bench/body_at_rest.h"
#include "tools/bench/samples.h"
#include "tools/bench/tissue_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

namespace stylet::bench {
namespace {

using Eigen::Vector3d;
using physics::Element;

/// The files of a scenario, without its tetrahedra.
struct Patient {
  readers::ScenarioFile scenario;
  std::vector<content::Tissue> tissues;
  std::vector<readers::Organ> organs;
  content::Probe probe;
  std::shared_ptr<const physics::TissueMap> resistance;
  double needle_radius = 0;  ///< m
  Vector3d entry, direction;
  double depth = 0;  ///< of the target's middle along the needle, m
};

void demand(const std::vector<std::string>& problems) {
  if (!problems.empty()) throw std::runtime_error(problems.front());
}

Patient read_patient(const std::string& name) {
  Patient patient;
  std::vector<std::string> problems;
  files::JsonFile file(readers::find_scenario(name));
  patient.scenario = readers::read_scenario_file(file);
  files::JsonFile table(patient.scenario.tissues);
  patient.tissues = content::read_tissues(table).tissues;
  files::JsonFile needle(patient.scenario.needle);
  patient.needle_radius = readers::read_needle(needle).outer_diameter / 2;
  files::JsonFile probe(patient.scenario.probe);
  patient.probe = readers::read_probe(probe);
  patient.probe.pose = patient.scenario.probe_pose;
  patient.resistance = session::tissue_map(readers::load_scene(patient.scenario.path));
  std::vector<gltf::GltfScene> files;
  for (const auto& organ : patient.scenario.organs) files.push_back(gltf::read_gltf(organ.path));
  patient.organs = readers::build_anatomy(patient.scenario, files, patient.tissues, problems);
  demand(problems);
  files::JsonFile plan(readers::content_directory() / "organs" / "abdomen.json");
  const readers::Procedure procedure = readers::read_procedure(plan);
  patient.entry = procedure.entry;
  patient.direction = procedure.needle_direction;
  patient.depth = procedure.needle_direction.dot(procedure.target - procedure.entry);
  return patient;
}

const readers::BodyRequest& request_of(const Patient& patient, const std::string& body) {
  return *std::ranges::find(patient.scenario.bodies, body, &readers::BodyRequest::name);
}

content::DeformableBody body_of(const Patient& patient, readers::BodyRequest request, Element element) {
  request.element = element;
  std::vector<std::string> problems, warnings;
  content::DeformableBody body = readers::build_body(request, patient.organs, patient.tissues,
                                                     patient.scenario.path.string(), problems, warnings);
  demand(problems);
  return body;
}

/// The tissue of bodies that hardly change their volume.
void set_poisson(content::DeformableBody& body, double poisson_ratio) {
  for (auto& material : body.tet_mechanics) material.poisson_ratio = poisson_ratio;
}

/// What differs within an element counts as one of the mean.
content::DeformableBody without_layers(content::DeformableBody body) {
  for (auto& material : body.tet_mechanics) material.layers = {};
  return body;
}

/// A force of 1 N: shares of it on points, each with what the mesh does not see of it.
struct Load {
  std::vector<physics::TetPoint> points;
  Vector3d direction = Vector3d::Zero();
};

class Body {
public:
  explicit Body(const content::DeformableBody& body)
      : at_rest_({body.mesh, body.tet_mechanics, body.fixed_nodes, 0, body.element}),
        rest_(physics::rest_positions(model())) {}

  /// Where the surface is nearest.
  physics::TetPoint on_surface(const Vector3d& x) const {
    double least = std::numeric_limits<double>::infinity();
    physics::TetPoint nearest;
    for (int t = 0; t < model().tet_count(); ++t) {
      for (int f = 0; f < 4; ++f) {
        if (model().topology.neighbour(t, f) >= 0) continue;
        const auto& corners = physics::kFaceCorners[static_cast<std::size_t>(f)];
        const auto node = [&](std::size_t c) -> Vector3d {
          return rest_.col(model().mesh.tets[static_cast<std::size_t>(t)][static_cast<std::size_t>(corners[c])]);
        };
        const Vector3d weights = physics::closest_weights(x, node(0), node(1), node(2));
        const double distance =
            (weights[0] * node(0) + weights[1] * node(1) + weights[2] * node(2) - x).squaredNorm();
        if (distance >= least) continue;
        least = distance;
        nearest.tet = t;
        nearest.barycentric.setZero();
        for (int c = 0; c < 3; ++c) nearest.barycentric[corners[static_cast<std::size_t>(c)]] = weights[c];
      }
    }
    return nearest;
  }
  physics::TetPoint inside(const Vector3d& x) const {
    const physics::TetPoint point = model().topology.locate(rest_, x, 0);
    return point.tet >= 0 ? point : on_surface(x);
  }

  physics::SubgridSite site(const physics::TetPoint& point) const {
    physics::SubgridSite site{
        .tet_volume = 0, .material = {.young_modulus = 0, .poisson_ratio = 0}, .barycentric = point.barycentric};
    for (std::size_t a = 0; a < 4; ++a) {
      const auto& around = model().surroundings[static_cast<std::size_t>(model().topology.nodes(point.tet)[a])];
      const double weight = point.barycentric[static_cast<Eigen::Index>(a)];
      site.tet_volume += weight * around.tet_volume;
      site.material.young_modulus += weight * around.material.young_modulus;
      site.material.poisson_ratio += weight * around.material.poisson_ratio;
    }
    return site;
  }

  /// Mean motion of the load's points along it, m/N.
  double compliance(const Load& load) {
    Eigen::Matrix3Xd forces = Eigen::Matrix3Xd::Zero(3, model().node_count());
    for (const physics::TetPoint& point : load.points) {
      for (std::size_t a = 0; a < 4; ++a) {
        forces.col(model().topology.nodes(point.tet)[a]) += point.barycentric[static_cast<Eigen::Index>(a)] /
                                                            static_cast<double>(load.points.size()) * load.direction;
      }
    }
    return at_rest_.compliance(forces);
  }

  int nodes() const { return model().node_count(); }
  std::size_t factor_nonzeros() const { return at_rest_.factor_nonzeros(); }

private:
  const physics::TissueModel& model() const { return at_rest_.model(); }

  BodyAtRest at_rest_;
  Eigen::Matrix3Xd rest_;
};

// The wall's layers and the gaps between its ribs want more than the liver, which is of one tissue for the most part.
// 27,000 nodes change what the wall gives way by 11 (needle), 0.1 (probe) and 7 % (track): near the needle what the
// mesh does not see counts.
constexpr int kReferenceNodes = 20'000, kWallReferenceNodes = 40'000;
constexpr int kQuickReferenceNodes = 9'000, kQuickWallReferenceNodes = 14'000;  // of the wall above what it judges

constexpr std::array kSites{"needle", "probe", "capsule", "track"};

/// [site] m/N: of the mesh, and with what it does not see of the needle (eq. 19, 20).
struct Compliances {
  std::array<double, 4> of_mesh{};
  std::array<double, 4> whole{};
};

/// The needle on its first surface, the probe's face on it, the needle through the body across its way.
Compliances measure(Body& body, const Patient& patient, const Vector3d& surface, double from, double to) {
  Compliances result;
  const auto punch = [&](std::size_t site) {
    const Load load{{body.on_surface(surface)}, patient.direction};
    result.of_mesh[site] = body.compliance(load);
    result.whole[site] =
        result.of_mesh[site] + physics::surface_tip_compliance(body.site(load.points.front()), patient.needle_radius);
  };
  punch(0);
  punch(2);
  Load probe{{}, patient.probe.pose.orientation * Vector3d::UnitZ()};
  for (int i = -7; i <= 7; ++i) {
    for (int j = -3; j <= 3; ++j) {
      // A face of 50 by 14 mm, as flat as the skin there.
      const Vector3d on_face(0.025 * i / 7, 0.007 * j / 3, 0);
      probe.points.push_back(body.on_surface(patient.probe.pose.position + patient.probe.pose.orientation * on_face));
    }
  }
  result.of_mesh[1] = result.whole[1] = body.compliance(probe);
  constexpr double kSpacing = 0.005;
  const auto points = static_cast<int>((to - from) / kSpacing);
  Load track{{}, patient.direction.cross(Vector3d::UnitY()).normalized()};
  double below = 0;
  const double share = (to - from) / points;
  for (int i = 0; i < points; ++i) {
    const Vector3d start = patient.entry + (from + i * share) * patient.direction;
    track.points.push_back(body.inside(start + 0.5 * share * patient.direction));
    physics::SubgridSite site = body.site(track.points.back());
    site.material.young_modulus = patient.resistance->modulus_along(start, start + share * patient.direction, 16);
    below += physics::shaft_compliance(site, patient.needle_radius, share).lateral / (points * points);
  }
  result.of_mesh[3] = body.compliance(track);
  result.whole[3] = result.of_mesh[3] + below;
  return result;
}

/// Median time of a step that has something to correct, and no new factor, ms.
double step_time(const content::DeformableBody& body) {
  physics::SimulationBody simulated;
  simulated.mesh = body.mesh;
  simulated.element = body.element;
  simulated.tet_materials = body.tet_mechanics;
  simulated.fixed_nodes = body.fixed_nodes;
  simulated.load = Eigen::Matrix3Xd::Constant(3, static_cast<Eigen::Index>(body.mesh.nodes.size()), 1e-4);
  physics::SimulationLoop loop({simulated}, {.dt = 0.02});
  physics::TissuePatch patch = loop.make_patch();
  Samples times;
  for (int step = 0; step < 40; ++step) {
    const auto start = Clock::now();
    loop.step({}, patch);
    if (step >= 5) times.add(Clock::now() - start);
  }
  return 1e-3 * times.median();
}

/// Where the needle's way is in a body, m from the entry.
struct Way {
  double from = 0;
  double to = 0;
};

Way way_in(const Patient& patient, const mesh::Solid& solid) {
  constexpr double kStep = 0.2e-3;
  Way way{.from = -1, .to = patient.depth};
  for (double s = -0.005; s < patient.depth; s += kStep) {
    const bool within = solid.contains(patient.entry + s * patient.direction);
    if (within && way.from < -0.5) way.from = s;
    if (!within && way.from > -0.5) {
      way.to = s;
      break;
    }
  }
  return way;
}

}  // namespace

Report tissue_compliance(const BenchOptions& options) {
  Report report;
  const Patient patient = read_patient("liver_biopsy");
  for (const char* name : {"abdominal_wall", "liver"}) {
    const bool wall = std::string(name) == "abdominal_wall";
    const readers::BodyRequest& request = request_of(patient, name);
    const mesh::Solid solid(readers::find_organ(patient.organs, request.boundary)->mesh);
    const Way way = way_in(patient, solid);
    const Vector3d surface = patient.entry + way.from * patient.direction;
    const double margin = 0.002;
    struct Variant {
      const char* name;
      content::DeformableBody body;
      bool judged;
    };
    readers::BodyRequest before = request;
    if (wall) before.target_nodes = kLinearWallNodes;
    std::vector<Variant> variants{{"linear", body_of(patient, before, Element::linear), false},
                                  {"shipped", body_of(patient, request, request.element), true}};
    if (wall) variants.push_back({"shipped_of_the_mean", without_layers(variants[1].body), false});
    // The same holds and layers, as regions of space, not as nodes and tetrahedra of another mesh.
    readers::BodyRequest finest = request;
    finest.target_nodes = wall ? (options.quick ? kQuickWallReferenceNodes : kWallReferenceNodes)
                               : (options.quick ? kQuickReferenceNodes : kReferenceNodes);
    content::DeformableBody reference = body_of(patient, finest, Element::quadratic);
    for (const double poisson : {0.45, 0.49}) {
      set_poisson(reference, poisson);
      std::fprintf(stderr, "bench tissue: %s, nu %.2f, reference of %zu nodes\n", name, poisson,
                   reference.mesh.nodes.size());
      Compliances truth;
      {
        Body body(reference);
        truth = measure(body, patient, surface, way.from + margin, way.to - margin);
      }
      for (Variant& variant : variants) {
        set_poisson(variant.body, poisson);
        Body body(variant.body);
        const Compliances c = measure(body, patient, surface, way.from + margin, way.to - margin);
        for (std::size_t site = 0; site < kSites.size(); ++site) {
          if (wall ? site == 2 : site == 0) continue;
          const std::string key =
              fmt::format("compliance.{}.{}.{}.nu_{:.2f}", name, kSites[site], variant.name, poisson);
          Measurement ratio = variant.judged
                                  ? within(key, c.whole[site] / truth.whole[site], "1", 1, 0.05)
                                  : Measurement{.name = key, .value = c.whole[site] / truth.whole[site], .unit = "1"};
          report.add(noted(
              std::move(ratio),
              fmt::format("over {:.4g} mm/N; of the mesh alone {:.3f} over {:.4g} mm/N", 1e3 * truth.whole[site],
                          c.of_mesh[site] / truth.of_mesh[site], 1e3 * truth.of_mesh[site])));
        }
        if (poisson != 0.49) continue;
        const std::string key = fmt::format("compliance.{}.cost.{}.", name, variant.name);
        report.add({.name = key + "nodes", .value = static_cast<double>(body.nodes()), .unit = "1"});
        report.add(
            {.name = key + "factor_nonzeros", .value = static_cast<double>(body.factor_nonzeros()), .unit = "1"});
        report.add({.name = key + "step", .value = step_time(variant.body), .unit = "ms"});
      }
    }
  }
  return report;
}

}  // namespace stylet::bench
