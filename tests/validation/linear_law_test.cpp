// Linear tetrahedra of tissue that stiffens and relaxes, with a capsule, against theory.
#include "physics/loops/simulation_loop.h"
#include "physics/tissue/cavity.h"
#include "physics/tissue/corotational.h"
#include "tests/validation/residual.h"
#include "tests/validation/static_body.h"
#include "tests/validation/strained_body.h"
#include "tools/reference/kuhn_box.h"

#include <gtest/gtest.h>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <random>
#include <utility>
#include <vector>

namespace stylet::physics {
namespace {

using validation::expect_factor_as_stiff_as_pulled;
using validation::expect_no_energy_from_closed_paths;
using validation::expect_positive_stiffness;
using validation::expect_prony;
using validation::kLawTissue;
using validation::pull_on_top;
using validation::report_residual;
using validation::shake;
using validation::StaticBody;
using validation::strain;

constexpr ElasticMaterial kPlain{.young_modulus = 20e3, .poisson_ratio = 0.4};

/// Fixed at its floor. Of 6 cells^3 tetrahedra, so one alone beside the last four where `cells` is odd and one is
/// left out.
TissueModel cube(int cells, const ElasticMaterial& material, double capsule = 0, bool mixed = false) {
  TetMesh mesh = reference::kuhn_box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones(), {cells, cells, cells});
  if (mixed) mesh.tets.pop_back();  // no multiple of four
  const auto fixed = reference::nodes_where(mesh, [](const Eigen::Vector3d& x) { return x.z() < 1e-9; });
  std::vector<ElasticMaterial> materials(mesh.tets.size(), material);
  if (mixed) std::fill(materials.begin() + 3, materials.begin() + 9, kPlain);
  return {std::move(mesh), materials, fixed, 0, Element::linear, capsule};
}

TEST(LinearLaw, ForceIsTheGradientOfTheEnergy) {
  for (const double capsule : {0.0, 3000.0}) {
    StaticBody body(cube(2, kLawTissue, capsule, true));
    strain(body);
    const double error = body.gradient_error(2e-4);
    ASSERT_EQ(body.inverted_count(), 0);
    report_residual("|dU/dp - F_int| / |F_int|", error, 1e-7);
  }
}

// Four at a time, with rotations found anew, as the loop does; and those that are left over one by one.
TEST(LinearLaw, FourTetrahedraAtATimeAreAsOneByOne) {
  StaticBody body(cube(3, kLawTissue, 900, true));
  ASSERT_NE(body.model().tet_count() % 4, 0);
  strain(body);
  const Eigen::Matrix3Xd one_by_one = body.forces();
  std::vector<Eigen::Quaterniond> rotations(static_cast<std::size_t>(body.model().point_count()),
                                            Eigen::Quaterniond::Identity());
  update_rotations(body.model(), body.positions, rotations);
  Eigen::Matrix3Xd together(3, body.model().node_count());
  ElementScratch scratch;
  update_rotations_and_forces(body.model(), body.positions, rotations, together, {}, body.memory, scratch);
  report_residual("force", (together - one_by_one).cwiseAbs().maxCoeff() / one_by_one.cwiseAbs().maxCoeff(), 1e-12);
}

TEST(LinearLaw, WithoutStiffeningAndRelaxationItIsTheCorotationalLaw) {
  ElasticMaterial nearly = kLawTissue;  // takes the way of the other law
  nearly.stiffening = 1e-300;
  nearly.relaxation = {};
  ElasticMaterial plain = nearly;
  plain.stiffening = 0;
  StaticBody one(cube(2, nearly));
  StaticBody other(cube(2, plain));
  ASSERT_FALSE(one.model().laws.empty());
  ASSERT_TRUE(other.model().laws.empty());
  shake(one.positions, 0.08, 3);
  other.positions = one.positions;
  report_residual("force", (one.forces() - other.forces()).norm() / other.forces().norm(), 1e-14);
  report_residual("energy", std::abs(one.energy() / other.energy() - 1), 1e-14);
}

TEST(LinearLaw, AStretchedBarFollowsTheAnalyticCurve) {
  ElasticMaterial material = kLawTissue;
  material.relaxation = {};
  StaticBody body(cube(2, material));
  const Eigen::Matrix3Xd rest = body.positions;
  const double mu = 10e3 / 2.9;
  const double lambda = 10e3 * 0.45 / (1.45 * 0.1);
  const auto stress = [&](double along, double across, double here) {
    const double squares = std::pow(along - 1, 2) + 2 * std::pow(across - 1, 2);
    return 2 * mu * std::exp(8 * squares) * (here - 1) + lambda * (along + 2 * across - 3);
  };
  for (const double along : {0.7, 0.85, 1.0, 1.1, 1.3}) {
    double low = 0.7, high = 1.4;  // across, where its stress is nothing
    for (int i = 0; i < 100; ++i) {
      const double middle = 0.5 * (low + high);
      (stress(along, middle, middle) > 0 ? high : low) = middle;
    }
    body.positions = Eigen::Vector3d(low, low, along).asDiagonal() * rest;
    report_residual("stress off the curve / mu", std::abs(pull_on_top(body) - stress(along, low, along)) / mu, 1e-10);
  }
}

TEST(LinearLaw, AHeldBlockRelaxesAsPronySays) {
  ElasticMaterial material = kLawTissue;
  material.stiffening = 0;
  StaticBody body(cube(1, material));
  body.positions = Eigen::Vector3d(0.9, 0.9, 1.2).asDiagonal() * body.positions.eval();  // tr E = 0
  expect_prony(body);
}

TEST(LinearLaw, NoClosedPathGivesEnergy) {
  expect_no_energy_from_closed_paths(cube(2, kLawTissue, 2000, true));
}

TEST(LinearLaw, StiffnessIsPositive) {
  for (const double capsule : {0.0, 3000.0}) {
    StaticBody body(cube(2, kLawTissue, capsule, true));
    expect_positive_stiffness(body);
  }
}

TEST(LinearLaw, TheFactorIsAsStiffAsThePulledTissue) {
  ElasticMaterial material = kLawTissue;
  material.stiffening = 20;
  StaticBody body(cube(3, material, 500));
  expect_factor_as_stiff_as_pulled(body);
}

// Its pressure is the work of all its stress as it grows, that of the law too.
TEST(LinearLaw, PressureOfACavityIsTheWorkOfItsLaw) {
  ElasticMaterial material = kLawTissue;
  StaticBody body(cube(1, material));
  std::vector<int> all(static_cast<std::size_t>(body.model().tet_count()));
  std::iota(all.begin(), all.end(), 0);
  const Cavity cavity(body.model(), all);
  strain(body);
  std::vector<Eigen::Quaterniond> rotations(all.size(), Eigen::Quaterniond::Identity());
  update_rotations(body.model(), body.positions, rotations);
  const CavityState state = cavity.state(body.model(), body.positions, rotations, body.memory);
  const Eigen::Matrix3Xd shape = body.positions;
  const auto energy_at = [&](double size) {
    body.positions = size * shape;
    return body.energy();
  };
  const double h = 1e-4;
  const double work =
      (8 * (energy_at(1 + h) - energy_at(1 - h)) - (energy_at(1 + 2 * h) - energy_at(1 - 2 * h))) / (12 * h);
  report_residual("pressure", std::abs(-work / (3 * state.volume) / state.pressure - 1), 1e-7);
}

// The two rates (eq. 48): in the step after the force the tissue goes as one that does not relax; in the end it is
// where one with g_inf mu is. Four at a time and with a request for a factor at every step.
TEST(LinearLaw, TheHandFeelsItAtOnceAndTheTissueCreeps) {
  SimulationBody body;
  body.mesh = reference::kuhn_box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.1), {3, 3, 3});
  body.fixed_nodes = reference::nodes_where(body.mesh, [](const Eigen::Vector3d& x) { return x.z() < 1e-9; });
  body.load = Eigen::Matrix3Xd::Zero(3, static_cast<Eigen::Index>(body.mesh.nodes.size()));
  const auto top = reference::nodes_where(body.mesh, [](const Eigen::Vector3d& x) { return x.z() > 0.1 - 1e-9; });
  for (const int n : top) body.load(0, n) = 1e-3;
  const auto moved = [&](const ElasticMaterial& material, int steps, double capsule) {
    SimulationBody made = body;
    made.tet_materials.assign(body.mesh.tets.size(), material);
    made.capsule = capsule;
    SimulationLoop loop({made}, {.dt = 0.02});
    TissuePatch patch = loop.make_patch();
    for (int i = 0; i < steps; ++i) {
      loop.step({}, patch);
      loop.worker().step();
    }
    return (loop.tissue().positions[0] - rest_positions(loop.model(0))).cwiseProduct(body.load).sum();
  };
  ElasticMaterial relaxing = kLawTissue;
  relaxing.stiffening = 0;
  ElasticMaterial elastic = relaxing;
  elastic.relaxation = {};
  ElasticMaterial relaxed = elastic;  // the same lambda
  const double lambda = 10e3 * 0.45 / (1.45 * 0.1);
  const double mu = 0.55 * 10e3 / 2.9;
  relaxed.young_modulus = mu * (3 * lambda + 2 * mu) / (lambda + mu);
  relaxed.poisson_ratio = lambda / (2 * (lambda + mu));
  EXPECT_NEAR(moved(relaxing, 1, 0) / moved(elastic, 1, 0), 1, 1e-12);
  EXPECT_GT(moved(relaxing, 2, 0) / moved(elastic, 2, 0), 1.003);
  EXPECT_NEAR(moved(relaxing, 2500, 0) / moved(relaxed, 100, 0), 1, 2e-3);
  EXPECT_LT(moved(kLawTissue, 100, 500), 0.98 * moved(kLawTissue, 100, 0)) << "its capsule holds it, too";
  EXPECT_EQ(moved(kLawTissue, 20, 500), moved(kLawTissue, 20, 500));
}

}  // namespace
}  // namespace stylet::physics
