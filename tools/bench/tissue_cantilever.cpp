#include "physics/tissue/refinement.h"
#include "tools/bench/body_at_rest.h"
#include "tools/bench/tissue_parts.h"
#include "tools/reference/kuhn_box.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

namespace stylet::bench {
namespace {

constexpr double kBarYoung = 10e3;  // Pa
constexpr double kSide = 0.2;       // m, of a bar 1 m long

/// A uniform traction of 1 N on the end, as the element's shape functions have it.
Eigen::Matrix3Xd end_load(const physics::TissueModel& model) {
  Eigen::Matrix3Xd load = Eigen::Matrix3Xd::Zero(3, model.node_count());
  const auto at_end = [&](int n) { return model.mesh.nodes[n].x() > 1 - 1e-9; };
  const auto share = [&](const auto& nodes, std::size_t first, std::size_t last) {
    std::vector<int> corners;
    std::copy_if(nodes.begin(), nodes.begin() + 4, std::back_inserter(corners), at_end);
    if (corners.size() != 3) return;
    const Eigen::Vector3d& x = model.mesh.nodes[corners[0]];
    const double area = 0.5 * (model.mesh.nodes[corners[1]] - x).cross(model.mesh.nodes[corners[2]] - x).norm();
    for (std::size_t a = first; a < last; ++a) {
      if (at_end(nodes[a])) load(2, nodes[a]) += area / (3 * kSide * kSide);
    }
  };
  for (const physics::QuadraticRest& element : model.quadratics) share(element.nodes, 4, 10);
  if (!model.is_quadratic()) {
    for (const auto& tet : model.mesh.tets) share(tet, 0, 4);
  }
  return load;
}

double deflection(physics::Element element, double poisson_ratio) {
  physics::TetMesh mesh = reference::kuhn_box(Eigen::Vector3d::Zero(), {1, kSide, kSide}, {10, 2, 2});
  if (element == physics::Element::quadratic) mesh = refined(mesh);
  const std::vector<physics::ElasticMaterial> materials(mesh.tets.size(), {kBarYoung, poisson_ratio});
  const std::vector<int> clamped = reference::nodes_where(mesh, [](const auto& x) { return x.x() < 1e-9; });
  BodyAtRest bar(physics::TissueModel(std::move(mesh), materials, clamped, 0, element));
  return bar.compliance(end_load(bar.model()));
}

}  // namespace

Report tissue_cantilever(const BenchOptions& /*options*/) {
  Report report;
  for (const double poisson_ratio : {0.3, 0.45, 0.49, 0.499}) {
    const double shear_modulus = kBarYoung / (2 * (1 + poisson_ratio));
    const double timoshenko =
        1 / (3 * kBarYoung * std::pow(kSide, 4) / 12) + 1 / (5.0 / 6.0 * shear_modulus * kSide * kSide);
    const std::string key = fmt::format("cantilever.nu_{}.", poisson_ratio);
    const double linear = deflection(physics::Element::linear, poisson_ratio) / timoshenko;
    report.add(noted({.name = key + "linear", .value = linear, .unit = "1", .reference = 1},
                     "deflection of 10 x 2 x 2 cells over Timoshenko's"));
    report.add(at_least(key + "quadratic", deflection(physics::Element::quadratic, poisson_ratio) / timoshenko, "1",
                        0.95, 1));
  }
  return report;
}

}  // namespace stylet::bench
