// W_bar from the trailing block of the factor: what it costs, how exact it is, and what warping it gains.
#include "tools/bench/coupling_parts.h"

#include "physics/tissue/corotational.h"
#include "physics/tissue/factorisation.h"
#include "physics/tissue/stiffness.h"
#include "physics/tissue/tissue_model.h"
#include "physics/tissue/warped_compliance.h"
#include "tools/bench/samples.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <utility>

namespace stylet::bench {
namespace {

using physics::TissueModel;

constexpr double kExact = 1e-12;  // relative, against full solves
constexpr int kCorridorNodes = 100;

/// The insertion's cube with a factor of its stiffness.
struct FactorisedCube {
  explicit FactorisedCube(const physics::SimulationBody& body)
      : model(body.mesh, body.tet_materials, body.fixed_nodes) {}

  bool factorise() {
    pattern.assemble(model, rotations, 1, values);
    return factor.factorise(pattern, values, workspace);
  }
  int free_dof(int node) const { return 3 * model.free_index[node]; }

  TissueModel model;
  Eigen::Matrix3Xd positions = physics::rest_positions(model);
  Eigen::Matrix3Xd forces{3, model.node_count()};
  std::vector<Eigen::Quaterniond> rotations{model.tets.size(), Eigen::Quaterniond::Identity()};
  physics::StiffnessPattern pattern{model};
  std::vector<double> values = std::vector<double>(pattern.nonzeros());
  physics::SolveWorkspace workspace;
  physics::Factorisation factor{pattern, workspace};
};

/// The free nodes nearest to the line along x that the needle takes.
std::vector<int> nodes_on_the_way(const TissueModel& model, const Eigen::Vector3d& start, int count) {
  std::vector<int> nodes;
  for (int n = 0; n < model.node_count(); ++n) {
    if (model.free_index[n] >= 0) nodes.push_back(n);
  }
  const auto distance = [&](int n) {
    const Eigen::Vector3d& x = model.mesh.nodes[n];
    return std::hypot(x.y() - start.y(), x.z() - start.z());
  };
  std::stable_sort(nodes.begin(), nodes.end(), [&](int a, int b) { return distance(a) < distance(b); });
  nodes.resize(std::min(nodes.size(), static_cast<std::size_t>(count)));
  return nodes;
}

std::vector<int> dofs_of(const FactorisedCube& cube, const std::vector<int>& nodes) {
  std::vector<int> dofs;
  for (const int node : nodes) {
    for (int c = 0; c < 3; ++c) dofs.push_back(cube.free_dof(node) + c);
  }
  return dofs;
}

double relative_error(const Eigen::MatrixXd& value, const Eigen::MatrixXd& exact) {
  return (value - exact).norm() / exact.norm();
}

/// @param bound_ms  for the median; 0: none
Report trailing_block(const reference::ReferenceInsertion& insertion, int nodes_per_edge, double bound_ms,
                      int repetitions) {
  reference::ReferenceInsertion mesh = insertion;
  mesh.nodes_per_edge = nodes_per_edge;
  FactorisedCube cube(mesh.body());
  cube.factorise();
  const std::vector<int> dofs = dofs_of(cube, nodes_on_the_way(cube.model, insertion.tip_start, kCorridorNodes));
  const auto size = static_cast<Eigen::Index>(dofs.size());
  Eigen::MatrixXd columns = Eigen::MatrixXd::Zero(cube.model.dof_count(), size);
  for (Eigen::Index k = 0; k < size; ++k) columns(dofs[k], k) = 1;
  // The reference: full solves with the factor in its usual order.
  const auto solving = Clock::now();
  cube.factor.solve(columns, columns, cube.workspace);
  const double solve_us = microseconds(Clock::now() - solving);
  const Eigen::MatrixXd exact = columns(dofs, Eigen::all);
  cube.factor.order_last(dofs, cube.pattern, cube.workspace);
  cube.factorise();

  Eigen::MatrixXd w_bar(size, size);
  Samples times(static_cast<std::size_t>(repetitions));
  for (int i = 0; i < repetitions; ++i) times.time([&] { cube.factor.trailing_compliance(w_bar); });
  const std::string prefix = fmt::format("w_bar.{}.", cube.model.node_count());
  Report report;
  report.add({prefix + "dofs", static_cast<double>(size), "1", {}, {}, {}});
  const double median_ms = 1e-3 * times.median();
  report.add(bound_ms > 0 ? at_most(prefix + "median", median_ms, "ms", bound_ms)
                          : Measurement{prefix + "median", median_ms, "ms", {}, {}, {}});
  report.add({prefix + "p99", 1e-3 * times.p99(), "ms", {}, {}, {}});
  report.add({prefix + "full_solves", 1e-3 * solve_us, "ms", {}, {}, {}});
  report.add(at_most(prefix + "error", relative_error(w_bar, exact), "1", kExact));
  return report;
}

/// Newton's method to the equilibrium under a load [free DOFs], with a fresh factor each time.
void settle(FactorisedCube& cube, const Eigen::VectorXd& load) {
  constexpr int kNewtonSteps = 4;
  for (int step = 0; step < kNewtonSteps; ++step) {
    physics::internal_forces(cube.model, cube.positions, cube.rotations, cube.forces);
    Eigen::VectorXd x = load;
    for (int n = 0; n < cube.model.node_count(); ++n) {
      if (cube.free_dof(n) >= 0) x.segment<3>(cube.free_dof(n)) -= cube.forces.col(n);
    }
    cube.factorise();
    cube.factor.solve(x, x, cube.workspace);
    for (int n = 0; n < cube.model.node_count(); ++n) {
      if (cube.free_dof(n) >= 0) cube.positions.col(n) += x.segment<3>(cube.free_dof(n));
    }
    physics::update_rotations(cube.model, cube.positions, cube.rotations);
  }
}

/// The top of the cube pushed aside until the nodes near the needle have turned by 5, 10 and 20 degrees since the
/// factorisation at rest; W_bar of rest, as it is and warped, against one of a fresh factor.
Report warped(const reference::ReferenceInsertion& insertion, bool quick) {
  constexpr int kNodes = 40;
  constexpr double kLoadStep = 0.25;  // N
  constexpr double kMostLoad = 20;    // N
  reference::ReferenceInsertion mesh = insertion;
  mesh.nodes_per_edge = quick ? 7 : 12;
  FactorisedCube cube(mesh.body());
  const std::vector<int> nodes = nodes_on_the_way(cube.model, insertion.tip_start, kNodes);
  const std::vector<int> dofs = dofs_of(cube, nodes);
  const auto size = static_cast<Eigen::Index>(dofs.size());
  const std::vector<Eigen::Quaterniond> rest = cube.rotations;
  cube.factor.order_last(dofs, cube.pattern, cube.workspace);
  cube.factorise();
  Eigen::MatrixXd frozen(size, size), exact(size, size);
  cube.factor.trailing_compliance(frozen);

  std::vector<int> top;
  for (int n = 0; n < cube.model.node_count(); ++n) {
    if (cube.model.mesh.nodes[n].z() > 0.999 * insertion.cube_edge) top.push_back(n);
  }
  std::vector<double> asked = quick ? std::vector{5.0} : std::vector{5.0, 10.0, 20.0};
  std::vector<Eigen::Quaterniond> turned(nodes.size());
  Eigen::VectorXd load = Eigen::VectorXd::Zero(cube.model.dof_count());
  Report report;
  auto next = asked.begin();
  for (double force = kLoadStep; next != asked.end() && force <= kMostLoad; force += kLoadStep) {
    for (const int n : top) load[cube.free_dof(n)] = force / static_cast<double>(top.size());
    settle(cube, load);
    double angle = 0;
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      turned[k] = physics::node_rotation(cube.model, nodes[k], rest, cube.rotations);
      angle += turned[k].angularDistance(Eigen::Quaterniond::Identity()) * 180 / std::numbers::pi /
               static_cast<double>(nodes.size());
    }
    if (angle < *next) continue;
    cube.factorise();
    cube.factor.trailing_compliance(exact);
    Eigen::MatrixXd carried = frozen;
    physics::warp_compliance(turned, carried);
    const std::string prefix = fmt::format("w_bar.warped.{:g}deg.", *next);
    report.add({prefix + "angle", angle, "deg", {}, {}, {}});
    report.add({prefix + "error_frozen", relative_error(frozen, exact), "1", {}, {}, {}});
    report.add({prefix + "error_warped", relative_error(carried, exact), "1", {}, {}, {}});
    ++next;
  }
  return report;
}

}  // namespace

Report coupling_w_bar(const reference::ReferenceInsertion& insertion, const BenchOptions& options) {
  struct Mesh {
    int nodes_per_edge;
    double bound_ms;
    int repetitions;
  };
  const std::vector<Mesh> meshes =
      options.quick ? std::vector<Mesh>{{8, 0, 20}} : std::vector<Mesh>{{18, 1, 200}, {27, 15, 200}};
  Report report;
  for (const Mesh& mesh : meshes) {
    std::fprintf(stderr, "bench coupling: W_bar, %d nodes an edge\n", mesh.nodes_per_edge);
    report.append(trailing_block(insertion, mesh.nodes_per_edge, mesh.bound_ms, mesh.repetitions));
  }
  report.append(warped(insertion, options.quick));
  return report;
}

}  // namespace stylet::bench
