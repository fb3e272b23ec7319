#include "physics/tissue/quadratic.h"
#include "physics/tissue/refinement.h"
#include "physics/tissue/tissue_model.h"
#include "tools/bench/tissue_parts.h"
#include "tools/reference/dense_algebra.h"
#include "tools/reference/kuhn_box.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <array>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

namespace stylet::bench {
namespace {

constexpr double kElementYoung = 10e3;  // Pa
constexpr double kNoEnergy = 1e-9;      // of the largest eigenvalue
constexpr double kJitter = 0.15;        // of a cell
constexpr std::size_t kListed = 14;     // of the eigenvalues of an element, from the softest on

/// [3 nodes x 3 nodes] at rest, no node held, N/m.
Eigen::MatrixXd stiffness_of(const physics::TissueModel& model) {
  const std::vector<Eigen::Quaterniond> upright(static_cast<std::size_t>(model.point_count()),
                                                Eigen::Quaterniond::Identity());
  const Eigen::Matrix3Xd rest = physics::rest_positions(model);
  const Eigen::Index size = rest.size();
  Eigen::MatrixXd stiffness(size, size);
  Eigen::Matrix3Xd moved = rest;
  Eigen::Matrix3Xd forces = rest;
  for (Eigen::Index i = 0; i < size; ++i) {
    // Linear in the positions, so the step may be of any size.
    moved.reshaped()[i] += 1e-3;
    physics::quadratic_forces(model, moved, upright, forces, {}, true, {});
    stiffness.col(i) = 1e3 * forces.reshaped();
    moved.reshaped()[i] = rest.reshaped()[i];
  }
  return 0.5 * (stiffness + stiffness.transpose());
}

physics::TissueModel quadratic_body(const physics::TetMesh& coarse, double poisson_ratio) {
  physics::TetMesh mesh = physics::refined(coarse);
  const std::vector<physics::ElasticMaterial> materials(
      mesh.tets.size(), {.young_modulus = kElementYoung, .poisson_ratio = poisson_ratio});
  return {std::move(mesh), materials, std::array{0, 1, 2}, 0, physics::Element::quadratic};
}

int without_energy(const Eigen::VectorXd& eigenvalues) {
  return static_cast<int>((eigenvalues.array() < kNoEnergy * eigenvalues.maxCoeff()).count());
}

/// A tetrahedron with edges of 1 along the axes: 30 degrees of freedom.
Eigen::VectorXd of_one_element(double poisson_ratio) {
  physics::TetMesh mesh;
  mesh.nodes = {Eigen::Vector3d::Zero(), Eigen::Vector3d::UnitX(), Eigen::Vector3d::UnitY(),
                Eigen::Vector3d::UnitZ()};
  mesh.tets = {{0, 1, 2, 3}};
  return reference::symmetric_eigenvalues(stiffness_of(quadratic_body(mesh, poisson_ratio)));
}

/// A free unit cube of cells^3 cells without order.
Eigen::VectorXd of_free_cube(int cells, double poisson_ratio) {
  physics::TetMesh mesh =
      reference::kuhn_box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones(), {cells, cells, cells});
  reference::jitter_inner_nodes(mesh, kJitter / cells, 11);
  return reference::symmetric_eigenvalues(stiffness_of(quadratic_body(mesh, poisson_ratio)));
}

}  // namespace

Report tissue_elements(const BenchOptions& options) {
  Report report;
  std::array<Eigen::VectorXd, 2> one;  // at nu 0.3 and 0.499
  for (const bool hardly_yields : {false, true}) {
    const double poisson_ratio = hardly_yields ? 0.499 : 0.3;
    const double shear = kElementYoung / (2 * (1 + poisson_ratio));
    const std::string key = fmt::format("elements.nu_{}.", poisson_ratio);
    Eigen::VectorXd& values = one[hardly_yields ? 1 : 0];
    values = of_one_element(poisson_ratio);
    report.add(within(key + "one.without_energy", without_energy(values), "1", 6, 0));
    std::string list;
    for (std::size_t i = 6; i < kListed; ++i)
      list += fmt::format(" {:.4f}", values[static_cast<Eigen::Index>(i)] / shear);
    report.add(noted({.name = key + "one.softest", .value = values[6] / shear, .unit = "1"},
                     "eigenvalues of an element with edges of 1 m over mu, from the seventh on:" + list));
    report.add(noted({.name = key + "one.stiffest", .value = values.maxCoeff() / shear, .unit = "1"},
                     "the one that changes the volume"));
    const Eigen::VectorXd cube = of_free_cube(options.quick ? 1 : 2, poisson_ratio);
    report.add(within(key + "cube.without_energy", without_energy(cube), "1", 6, 0));
    report.add(noted({.name = key + "cube.softest", .value = cube[6] / shear, .unit = "1"},
                     "seventh eigenvalue over mu times 1 m; a shape of the whole cube, not a zigzag"));
  }
  // Constant pressure ties one way of an element's 24, that of its volume; the rest go with mu alone.
  const Eigen::Index ways = one[0].size();
  report.add(within("elements.one.tied_by_volume",
                    static_cast<double>((one[1].array() > 2 * one[0].maxCoeff()).count()), "1", 1, 0));
  report.add(at_most("elements.one.stiffer_at_0.499", one[1][ways - 2] / one[0][ways - 2], "1", 1.2));
  return report;
}

}  // namespace stylet::bench
