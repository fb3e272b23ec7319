// W_bar from the trailing block of the factor: what it costs, and how exact it is.
#include "tools/bench/coupling_parts.h"

#include "physics/tissue/factorisation.h"
#include "physics/tissue/stiffness.h"
#include "physics/tissue/tissue_model.h"
#include "tools/bench/samples.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

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
  return report;
}

}  // namespace stylet::bench
