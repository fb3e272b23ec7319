// Tissue that stiffens and relaxes, and its capsule, against theory.
#include "physics/loops/simulation_loop.h"
#include "physics/tissue/membrane.h"
#include "physics/tissue/quadratic.h"
#include "physics/tissue/refinement.h"
#include "tests/validation/residual.h"
#include "tests/validation/static_body.h"
#include "tests/validation/strained_body.h"
#include "tools/reference/kuhn_box.h"

#include <gtest/gtest.h>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <functional>
#include <random>
#include <span>
#include <stdexcept>
#include <utility>
#include <vector>

namespace stylet::physics {
namespace {

using validation::expect_factor_as_stiff_as_pulled;
using validation::expect_no_energy_from_closed_paths;
using validation::expect_positive_stiffness;
using validation::expect_prony;
using validation::kLawTissue;
using validation::law_rotation;
using validation::pull_on_top;
using validation::report_residual;
using validation::shake;
using validation::StaticBody;
using validation::strain;

constexpr double kMu = 10e3 / 2.9;
constexpr double kLambda = 10e3 * 0.45 / (1.45 * 0.1);

using Where = std::function<bool(const Eigen::Vector3d&)>;

TissueModel unit_cube(int cells, const ElasticMaterial& material, const Where& is_fixed, double capsule = 0,
                      double jitter = 0) {
  TetMesh coarse = reference::kuhn_box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones(), {cells, cells, cells});
  if (jitter > 0) reference::jitter_inner_nodes(coarse, jitter, 11);
  TetMesh mesh = refined(coarse);
  const auto fixed = reference::nodes_where(mesh, is_fixed);
  const std::vector<ElasticMaterial> materials(mesh.tets.size(), material);
  return {std::move(mesh), materials, fixed, 0, Element::quadratic, capsule};
}

bool on_floor(const Eigen::Vector3d& x) {
  return x.z() < 1e-9;
}

TEST(QuadraticLaw, ForceIsTheGradientOfTheEnergy) {
  for (const double capsule : {0.0, 3000.0}) {
    StaticBody body(unit_cube(1, kLawTissue, on_floor, capsule));
    strain(body);
    const double error = body.gradient_error(2e-4);
    ASSERT_EQ(body.inverted_count(), 0);
    report_residual("|dU/dp - F_int| / |F_int|", error, 1e-7);
  }
}

TEST(QuadraticLaw, AnObserverWhoTurnsSeesTheSame) {
  StaticBody body(unit_cube(1, kLawTissue, on_floor, 3000));
  strain(body);
  const Eigen::Matrix3Xd forces = body.forces();
  const double energy = body.energy();
  const Eigen::Matrix3d turn = law_rotation();
  body.positions = ((turn * body.positions).colwise() + Eigen::Vector3d(1, -2, 3)).eval();
  report_residual("force", (body.forces() - turn * forces).cwiseAbs().maxCoeff() / forces.cwiseAbs().maxCoeff(),
                  1e-11);
  report_residual("energy", std::abs(body.energy() / energy - 1), 1e-12);
}

TEST(QuadraticLaw, WithoutStiffeningAndRelaxationItIsTheLinearLawToTheBit) {
  ElasticMaterial nearly = kLawTissue;  // takes the way of the other law
  nearly.stiffening = 1e-300;
  nearly.relaxation = {};
  ElasticMaterial plain = nearly;
  plain.stiffening = 0;
  StaticBody one(unit_cube(1, nearly, on_floor));
  StaticBody other(unit_cube(1, plain, on_floor));
  ASSERT_FALSE(one.model().quadratics[0].linear);
  ASSERT_TRUE(other.model().quadratics[0].linear);
  shake(one.positions, 0.08, 3);
  other.positions = one.positions;
  EXPECT_EQ(one.forces(), other.forces());
  report_residual("energy", std::abs(one.energy() / other.energy() - 1), 1e-14);
}

TEST(QuadraticLaw, AStretchedBarFollowsTheAnalyticCurve) {
  ElasticMaterial material = kLawTissue;
  material.relaxation = {};
  StaticBody body(unit_cube(2, material, on_floor));
  const Eigen::Matrix3Xd rest = body.positions;
  const auto stress = [&](double along, double across, double here) {
    const double squares = std::pow(along - 1, 2) + 2 * std::pow(across - 1, 2);
    const double j = along * across * across;
    return 2 * kMu * std::exp(8 * squares) * (here - 1) + kLambda * (j - 1) * j / here;
  };
  std::vector<double> stresses;
  for (const double along : {0.7, 0.85, 1.0, 1.1, 1.2, 1.3}) {
    double low = 0.7, high = 1.4;  // across, where its stress is nothing
    for (int i = 0; i < 100; ++i) {
      const double middle = 0.5 * (low + high);
      (stress(along, middle, middle) > 0 ? high : low) = middle;
    }
    body.positions = Eigen::Vector3d(low, low, along).asDiagonal() * rest;
    stresses.push_back(pull_on_top(body));
    report_residual("stress off the curve / mu", std::abs(stresses.back() - stress(along, low, along)) / kMu, 1e-10);
  }
  // Convex in stretch.
  EXPECT_GT(stresses[5] - stresses[4], 1.5 * (stresses[3] - stresses[2]));
}

TEST(QuadraticLaw, AHeldBlockRelaxesAsPronySays) {
  ElasticMaterial material = kLawTissue;
  material.stiffening = 0;
  StaticBody body(unit_cube(1, material, on_floor));
  const double stretch = 1.2;  // no change of volume: all of the stress is shape's
  body.positions =
      Eigen::Vector3d(1 / std::sqrt(stretch), 1 / std::sqrt(stretch), stretch).asDiagonal() * body.positions.eval();
  expect_prony(body);
}

TEST(QuadraticLaw, NoClosedPathGivesEnergy) {
  expect_no_energy_from_closed_paths(unit_cube(1, kLawTissue, on_floor, 2000));
}

TEST(QuadraticLaw, StiffnessIsPositiveAlsoWhereItIsPressedAndTurned) {
  for (const double capsule : {0.0, 3000.0}) {
    StaticBody body(unit_cube(1, kLawTissue, on_floor, capsule));
    expect_positive_stiffness(body);
  }
}

TEST(QuadraticLaw, TheFactorIsAsStiffAsThePulledTissue) {
  ElasticMaterial material = kLawTissue;
  material.stiffening = 20;
  StaticBody body(unit_cube(2, material, on_floor, 500));
  expect_factor_as_stiff_as_pulled(body);
}

// The two rates (eq. 48): in the step after the force the tissue goes as one that does not relax; in the end it is
// where one with g_inf mu is.
TEST(QuadraticLaw, TheHandFeelsItAtOnceAndTheTissueCreeps) {
  SimulationBody body;
  body.mesh = refined(reference::kuhn_box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.1), {2, 2, 2}));
  body.fixed_nodes = reference::nodes_where(body.mesh, on_floor);
  body.element = Element::quadratic;
  body.load = Eigen::Matrix3Xd::Zero(3, static_cast<Eigen::Index>(body.mesh.nodes.size()));
  const auto top = reference::nodes_where(body.mesh, [](const Eigen::Vector3d& x) { return x.z() > 0.1 - 1e-9; });
  for (const int n : top) body.load(0, n) = 1e-3;
  const auto moved = [&](const ElasticMaterial& material, int steps) {
    SimulationBody made = body;
    made.tet_materials.assign(body.mesh.tets.size(), material);
    SimulationLoop loop({made}, {.dt = 0.02});
    TissuePatch patch = loop.make_patch();
    for (int i = 0; i < steps; ++i) loop.step({.request_factorisation = false}, patch);
    return (loop.tissue().positions[0] - rest_positions(loop.model(0))).cwiseProduct(body.load).sum();
  };
  ElasticMaterial relaxing = kLawTissue;
  relaxing.stiffening = 0;
  ElasticMaterial elastic = relaxing;
  elastic.relaxation = {};
  ElasticMaterial relaxed = elastic;  // the same lambda
  const double mu = 0.55 * kMu;
  relaxed.young_modulus = mu * (3 * kLambda + 2 * mu) / (kLambda + mu);
  relaxed.poisson_ratio = kLambda / (2 * (kLambda + mu));
  EXPECT_NEAR(moved(relaxing, 1) / moved(elastic, 1), 1, 1e-12);
  // What fades in a period, 0.2 (1 - exp(-h/0.3)) + 0.25 (1 - exp(-h/4)), is what the hand's next patch brings.
  EXPECT_NEAR(moved(relaxing, 2) / moved(elastic, 2) - 1, 0.0141, 0.001);
  EXPECT_NEAR(moved(relaxing, 2500) / moved(relaxed, 100), 1, 2e-3);
  // Deterministic, and a new loop remembers nothing.
  EXPECT_EQ(moved(relaxing, 20), moved(relaxing, 20));
}

TEST(QuadraticLaw, ImpossibleMaterialsAreRefused) {
  const auto refused = [](const std::function<void(ElasticMaterial&)>& spoil) {
    ElasticMaterial material = kLawTissue;
    spoil(material);
    EXPECT_THROW(unit_cube(1, material, on_floor), std::invalid_argument);
  };
  refused([](ElasticMaterial& m) { m.stiffening = -1; });
  refused([](ElasticMaterial& m) { m.relaxation[0].share = 0.8; });
  refused([](ElasticMaterial& m) { m.relaxation[1].share = -0.1; });
  refused([](ElasticMaterial& m) { m.relaxation[1].time_s = 0; });
  EXPECT_THROW(unit_cube(1, kLawTissue, on_floor, -1), std::invalid_argument);
}

// A flat irregular face stretched evenly: no force inside, and at its rim that of a neo-Hookean sheet.
TEST(Capsule, PatchTestHoldsOnAFlatFace) {
  const double stiffness = 900;  // E t, N/m
  TetMesh coarse = reference::kuhn_box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones(), {3, 3, 1});
  std::mt19937 random(4);
  for (Eigen::Vector3d& x : coarse.nodes) {
    const double shift = 0.1 * (static_cast<double>(random()) / static_cast<double>(std::mt19937::max()) - 0.5);
    for (const int axis : {0, 1}) {
      if (x[axis] > 1e-9 && x[axis] < 1 - 1e-9) x[axis] += shift;
    }
  }
  TetMesh mesh = refined(coarse);
  const auto fixed = reference::nodes_where(mesh, on_floor);
  const std::vector<ElasticMaterial> materials(mesh.tets.size());
  const TissueModel model(mesh, materials, fixed, 0, Element::quadratic, stiffness);
  EXPECT_EQ(model.membrane.size(), 4U * (2 * 18 + 4 * 6));
  for (const double stretch : {0.9, 1.3}) {
    const Eigen::Matrix3Xd positions = Eigen::Vector3d(stretch, stretch, 1).asDiagonal() * rest_positions(model);
    Eigen::Matrix3Xd forces = Eigen::Matrix3Xd::Zero(3, model.node_count());
    add_membrane_forces(model, positions, false, forces);
    double inside = 0;
    double rim = 0;  // of the four triangles' rows that end at x = 1: top and bottom pull along x, the face there not
    for (int n = 0; n < model.node_count(); ++n) {
      const Eigen::Vector3d& x = model.mesh.nodes[n];
      const bool in_face = x.z() > 1 - 1e-9 && x.x() > 1e-9 && x.x() < 1 - 1e-9 && x.y() > 1e-9 && x.y() < 1 - 1e-9;
      if (in_face) inside = std::max(inside, forces.col(n).norm());
      if (x.x() > 1 - 1e-9) rim += forces(0, n);
    }
    report_residual("force inside / E t", inside / stiffness, 1e-13);
    // Top and bottom are pulled in both directions, two sides in x alone.
    const double both = stiffness / 3 * (stretch - std::pow(stretch, -5));
    const double alone = stiffness / 3 * (stretch - std::pow(stretch, -3));
    report_residual("force on the rim off the sheet's / E t", std::abs(rim - 2 * both - 2 * alone) / stiffness,
                    1e-12);
  }
}

// Pulled evenly, so that nothing is compressed: all of the second derivative is there.
TEST(Capsule, StiffnessOfATautSheetIsTheDerivativeOfTheForce) {
  ElasticMaterial soft{.young_modulus = 1e-6, .poisson_ratio = 0.3};
  StaticBody body(unit_cube(1, soft, on_floor, 900));
  body.positions = law_rotation() * (1.25 * body.positions);
  shake(body.positions, 0.01, 7);
  report_residual("|dF/dp - K| / |K|", body.stiffness_error(1e-5), 1e-7);
}

}  // namespace
}  // namespace stylet::physics
