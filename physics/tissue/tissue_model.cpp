#include "physics/tissue/tissue_model.h"

#include "physics/tissue/membrane.h"
#include "physics/tissue/quadratic.h"

#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>

namespace stylet::physics {
namespace {

constexpr int kTetsWorthSharing = 8192;  // tetrahedra; a step over fewer is done before another thread wakes
constexpr int kRunUnit = 8;              // tetrahedra: two times four lanes, or a quadratic element
constexpr int kRuns = 4;                 // enough that two threads end together

[[noreturn]] void refuse(const std::string& what) {
  throw std::invalid_argument("tissue model: " + what);
}

void check(const TetMesh& mesh, std::span<const ElasticMaterial> materials, std::span<const int> fixed,
           double damping_time_s) {
  const auto nodes = static_cast<int>(mesh.nodes.size());
  if (mesh.tets.empty()) refuse("no tetrahedra");
  if (materials.size() != mesh.tets.size()) {
    refuse(std::to_string(materials.size()) + " materials for " + std::to_string(mesh.tets.size()) + " tetrahedra");
  }
  if (!(damping_time_s >= 0)) refuse("damping time must be 0 or more");
  for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
    if (!mesh.nodes[i].allFinite()) refuse("node " + std::to_string(i) + " is not finite");
  }
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) {
    for (const int n : mesh.tets[t]) {
      if (n < 0 || n >= nodes) refuse("tetrahedron " + std::to_string(t) + " names node " + std::to_string(n));
    }
    const ElasticMaterial& m = materials[t];
    if (!(m.young_modulus > 0) || !(m.poisson_ratio > -1 && m.poisson_ratio < 0.5)) {
      refuse("material of tetrahedron " + std::to_string(t) + " needs E > 0 and -1 < nu < 0.5");
    }
    const auto& [x, y, z] = m.layers.normal;
    const double squared = x * x + y * y + z * z;
    if (!(m.layers.across > 0 && m.layers.across <= 1) || !(squared == 0 || std::abs(squared - 1) < 1e-6)) {
      refuse("layers of tetrahedron " + std::to_string(t) +
             " need a share across in (0, 1] and a unit normal or none");
    }
    const auto& [first, second] = m.relaxation;
    if (!(m.stiffening >= 0) || !(first.share >= 0 && second.share >= 0 && first.share + second.share < 1) ||
        !(first.time_s > 0 && second.time_s > 0)) {
      refuse("material of tetrahedron " + std::to_string(t) +
             " needs stiffening >= 0, shares of relaxation below 1 together, and their times > 0");
    }
  }
  for (std::size_t i = 0; i < fixed.size(); ++i) {
    if (fixed[i] < 0 || fixed[i] >= nodes) refuse("fixed node " + std::to_string(fixed[i]) + " does not exist");
    if (i > 0 && fixed[i] <= fixed[i - 1]) refuse("fixed nodes must ascend without duplicates");
  }
  if (fixed.size() < 3) refuse("at least three nodes must be fixed");
}

TetRest make_rest(const TetMesh& mesh, std::size_t t, const ElasticMaterial& material) {
  const auto& n = mesh.tets[t];
  const auto x = [&](int a) { return mesh.nodes[n[a]]; };
  Eigen::Matrix3d edges;
  for (int a = 0; a < 3; ++a) edges.col(a) = x(a + 1) - x(0);
  const double determinant = edges.determinant();
  if (!(determinant > 0)) refuse("tetrahedron " + std::to_string(t) + " is not positively oriented");
  TetRest rest;
  rest.volume = determinant / 6;
  rest.gradients.rightCols<3>() = edges.inverse().transpose();
  rest.gradients.col(0) = -rest.gradients.rightCols<3>().rowwise().sum();
  const double e = material.young_modulus;
  const double nu = material.poisson_ratio;
  rest.lambda = e * nu / ((1 + nu) * (1 - 2 * nu));
  rest.mu = e / (2 * (1 + nu));
  return rest;
}

/// The check comes before the topology is built from the mesh.
TetMesh checked(TetMesh mesh, std::span<const ElasticMaterial> materials, std::span<const int> fixed,
                double damping_time_s) {
  check(mesh, materials, fixed, damping_time_s);
  return mesh;
}

}  // namespace

TissueModel::TissueModel(TetMesh rest_mesh, std::span<const ElasticMaterial> tet_materials,
                         std::span<const int> fixed_nodes, double damping_time, Element element, double capsule)
    : mesh(checked(std::move(rest_mesh), tet_materials, fixed_nodes, damping_time)),
      topology(mesh),
      materials(tet_materials.begin(), tet_materials.end()),
      free_index(mesh.nodes.size(), 0),
      damping_time_s(damping_time) {
  tets.reserve(mesh.tets.size());
  for (std::size_t t = 0; t < mesh.tets.size(); ++t) tets.push_back(make_rest(mesh, t, materials[t]));
  if (element == Element::quadratic) quadratics = quadratic_elements(mesh, materials);
  find_laws();
  if (!(capsule >= 0)) refuse("the stiffness of a capsule must be 0 or more");
  if (capsule > 0) membrane = membrane_of(mesh, topology, capsule);

  for (const int n : fixed_nodes) free_index[n] = -1;
  for (int& index : free_index) {
    if (index >= 0) index = free_node_count++;
  }
  if (free_node_count == 0) refuse("all nodes are fixed");

  incident_start.assign(mesh.nodes.size() + 1, 0);
  for (const auto& tet : mesh.tets) {
    for (const int n : tet) ++incident_start[static_cast<std::size_t>(n) + 1];
  }
  for (std::size_t n = 0; n < mesh.nodes.size(); ++n) {
    if (incident_start[n + 1] == 0) refuse("node " + std::to_string(n) + " belongs to no tetrahedron");
    incident_start[n + 1] += incident_start[n];
  }
  incident_tets.resize(4 * mesh.tets.size());
  std::vector<int> next(incident_start.begin(), incident_start.end() - 1);
  for (int t = 0; t < tet_count(); ++t) {
    for (const int n : mesh.tets[t]) {
      incident_tets[next[n]++] = t;
    }
  }
  find_surroundings(capsule);
  find_runs();
}

void TissueModel::find_laws() {
  const auto note = [&](const StrainLaw& law) {
    stiffens_ = stiffens_ || (law.stiffening > 0).any();
    relaxes_ = relaxes_ || (law.share[0] > 0).any() || (law.share[1] > 0).any();
  };
  if (is_quadratic()) {
    for (const QuadraticRest& rest : quadratics) note(rest);
    return;
  }
  laws.resize((tets.size() + kLanes - 1) / kLanes);
  for (std::size_t t = 0; t < tets.size(); ++t) {
    StrainLaw& law = laws[t / kLanes];
    const auto lane = static_cast<Eigen::Index>(t % kLanes);
    law.stiffening[lane] = materials[t].stiffening;
    law.linear = law.linear && materials[t].stiffening == 0;
    for (std::size_t i = 0; i < law.share.size(); ++i) {
      const Relaxation& term = materials[t].relaxation[i];
      law.share[i][lane] = term.share;
      law.rate[i][lane] = 1 / term.time_s;
      law.linear = law.linear && term.share == 0;
    }
    note(law);
  }
  if (!stiffens_ && !relaxes_) laws.clear();
}

void TissueModel::find_runs() {
  if (!is_quadratic()) lanes.resize(tets.size() / kLanes);
  for (std::size_t t = 0; t < kLanes * lanes.size(); ++t) {
    TetLanes& four = lanes[t / kLanes];
    const auto lane = static_cast<Eigen::Index>(t % kLanes);
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t e = 0; e < 3; ++e) {
        four.gradients[i][e][lane] =
            tets[t].gradients(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(e) + 1);
      }
    }
    four.volume[lane] = tets[t].volume;
    four.lambda[lane] = tets[t].lambda;
    four.mu[lane] = tets[t].mu;
  }
  const int count = tet_count() < kTetsWorthSharing ? 1 : kRuns;
  for (int r = 0; r < count; ++r) {
    const auto border = [&](int i) {
      return i == count ? tet_count() : static_cast<int>(std::int64_t{tet_count()} * i / count) / kRunUnit * kRunUnit;
    };
    TetRun run{.begin = border(r), .end = border(r + 1), .first_node = node_count(), .end_node = 0};
    for (int t = run.begin; t < run.end; ++t) {
      for (const int n : mesh.tets[t]) {
        run.first_node = std::min(run.first_node, n);
        run.end_node = std::max(run.end_node, n + 1);
      }
    }
    runs.push_back(run);
  }
}

void TissueModel::find_surroundings(double capsule) {
  surroundings.resize(mesh.nodes.size());
  for (std::size_t n = 0; n < surroundings.size(); ++n) {
    NodeSurroundings mean{.tet_volume = 0, .material = {.young_modulus = 0, .poisson_ratio = 0}};
    for (int k = incident_start[n]; k < incident_start[n + 1]; ++k) {
      const auto t = static_cast<std::size_t>(incident_tets[k]);
      mean.tet_volume += tets[t].volume;
      add_part(mean.material, materials[t], tets[t].volume);
    }
    mean.material.young_modulus /= mean.tet_volume;
    mean.material.poisson_ratio /= mean.tet_volume;
    mean.material.stiffening /= mean.tet_volume;
    for (Relaxation& term : mean.material.relaxation) term.share /= mean.tet_volume;
    mean.capsule = capsule;
    mean.tet_volume /= incident_start[n + 1] - incident_start[n];
    surroundings[n] = mean;
  }
}

Eigen::Matrix3Xd rest_positions(const TissueModel& model) {
  Eigen::Matrix3Xd positions(3, model.node_count());
  for (int n = 0; n < model.node_count(); ++n) positions.col(n) = model.mesh.nodes[n];
  return positions;
}

void take_free(const TissueModel& model, const Eigen::Matrix3Xd& all, Eigen::VectorXd& free) {
  for (Eigen::Index n = 0; n < all.cols(); ++n) {
    const int i = model.free_index[n];
    if (i >= 0) free.segment<3>(3 * i) = all.col(n);
  }
}

void add_free(const TissueModel& model, const Eigen::VectorXd& x, double scale, Eigen::Matrix3Xd& target) {
  for (int n = 0; n < model.node_count(); ++n) {
    const int i = model.free_index[n];
    if (i >= 0) target.col(n) += scale * x.segment<3>(3 * i);
  }
}

}  // namespace stylet::physics
