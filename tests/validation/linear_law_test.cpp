// Linear tetrahedra of tissue that stiffens and relaxes, with a capsule, against theory.
#include "physics/loops/simulation_loop.h"
#include "physics/tissue/cavity.h"
#include "physics/tissue/corotational.h"
#include "tests/validation/residual.h"
#include "tests/validation/static_body.h"
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

using validation::report_residual;
using validation::StaticBody;

constexpr ElasticMaterial kTissue{.young_modulus = 10e3,
                                  .poisson_ratio = 0.45,
                                  .stiffening = 8,
                                  .relaxation = {{{.share = 0.2, .time_s = 0.3}, {.share = 0.25, .time_s = 4}}}};
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

void shake_nodes(Eigen::Matrix3Xd& positions, double amount, unsigned seed) {
  std::mt19937 random(seed);
  for (Eigen::Index i = 0; i < positions.size(); ++i) {
    positions.data()[i] +=
        amount * (2 * static_cast<double>(random()) / static_cast<double>(std::mt19937::max()) - 1);
  }
}

/// Deformed, with another deformation half forgotten: alpha has other axes than the strain.
void strain_body(StaticBody& body) {
  const Eigen::Matrix3Xd rest = body.positions;
  shake_nodes(body.positions, 0.08, 3);
  body.fade(1);
  body.positions = Eigen::AngleAxisd(2.2, Eigen::Vector3d(0.3, -0.8, 0.52).normalized()).toRotationMatrix() * rest;
  shake_nodes(body.positions, 0.08, 5);
  EXPECT_GT(body.memory[0].alpha[0][5].abs().maxCoeff(), 0.01);
}

TEST(LinearLaw, ForceIsTheGradientOfTheEnergy) {
  for (const double capsule : {0.0, 3000.0}) {
    StaticBody body(cube(2, kTissue, capsule, true));
    strain_body(body);
    const double error = body.gradient_error(2e-4);
    ASSERT_EQ(body.inverted_count(), 0);
    report_residual("|dU/dp - F_int| / |F_int|", error, 1e-7);
  }
}

// Four at a time, with rotations found anew, as the loop does; and those that are left over one by one.
TEST(LinearLaw, FourTetrahedraAtATimeAreAsOneByOne) {
  StaticBody body(cube(3, kTissue, 900, true));
  ASSERT_NE(body.model().tet_count() % 4, 0);
  strain_body(body);
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
  ElasticMaterial nearly = kTissue;  // takes the way of the other law
  nearly.stiffening = 1e-300;
  nearly.relaxation = {};
  ElasticMaterial plain = nearly;
  plain.stiffening = 0;
  StaticBody one(cube(2, nearly));
  StaticBody other(cube(2, plain));
  ASSERT_FALSE(one.model().laws.empty());
  ASSERT_TRUE(other.model().laws.empty());
  shake_nodes(one.positions, 0.08, 3);
  other.positions = one.positions;
  report_residual("force", (one.forces() - other.forces()).norm() / other.forces().norm(), 1e-14);
  report_residual("energy", std::abs(one.energy() / other.energy() - 1), 1e-14);
}

double pull_of_top(StaticBody& body) {
  const Eigen::Matrix3Xd forces = body.forces();
  double sum = 0;
  for (int n = 0; n < body.model().node_count(); ++n) {
    if (body.model().mesh.nodes[n].z() > 1 - 1e-9) sum += forces(2, n);
  }
  return sum;
}

TEST(LinearLaw, AStretchedBarFollowsTheAnalyticCurve) {
  ElasticMaterial material = kTissue;
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
    report_residual("stress off the curve / mu", std::abs(pull_of_top(body) - stress(along, low, along)) / mu, 1e-10);
  }
}

TEST(LinearLaw, AHeldBlockRelaxesAsPronySays) {
  ElasticMaterial material = kTissue;
  material.stiffening = 0;
  StaticBody body(cube(1, material));
  body.positions = Eigen::Vector3d(0.9, 0.9, 1.2).asDiagonal() * body.positions.eval();  // tr E = 0
  const double at_once = pull_of_top(body);
  double worst = 0;
  for (int step = 1; step <= 500; ++step) {
    body.fade(0.02);
    const double t = step * 0.02;
    const double theory = 0.55 + 0.2 * std::exp(-t / 0.3) + 0.25 * std::exp(-t / 4);
    worst = std::max(worst, std::abs(pull_of_top(body) / at_once - theory));
  }
  report_residual("off g_inf + sum g_i exp(-t/tau_i)", worst, 1e-12);
}

// Along a random closed path, at random speeds: what is put in is what the fading takes, and that is never negative.
TEST(LinearLaw, NoClosedPathGivesEnergy) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    StaticBody body(cube(2, kTissue, 2000, true));
    const Eigen::Matrix3Xd rest = body.positions;
    std::mt19937 random(seed);
    double work = 0;
    double taken = 0;
    for (int step = 0; step < 40; ++step) {
      Eigen::Matrix3Xd next = rest;
      if (step < 39) shake_nodes(next, 0.05, static_cast<unsigned>(random()));
      const Eigen::Matrix3Xd before = body.positions;
      for (int part = 0; part < 4; ++part) {
        for (const auto& [at, weight] : {std::pair{0.11270166537925831, 5.0 / 18}, std::pair{0.5, 8.0 / 18},
                                         std::pair{0.8872983346207417, 5.0 / 18}}) {
          body.positions = before + 0.25 * (part + at) * (next - before);
          work += 0.25 * weight * body.forces().cwiseProduct(next - before).sum();
        }
      }
      body.positions = next;
      const double loaded = body.energy();
      body.fade(0.01 * std::pow(10.0, static_cast<double>(random() % 3)));
      const double lost = loaded - body.energy();
      EXPECT_GE(lost, -1e-15 * loaded) << step;
      taken += lost;
    }
    const double stored = body.energy();
    report_residual("work - taken - stored, over the work", std::abs(work - taken - stored) / work, 1e-6);
    EXPECT_GT(work, stored);
    EXPECT_GT(taken, 0.05 * work);
  }
}

TEST(LinearLaw, StiffnessIsPositive) {
  for (const double capsule : {0.0, 3000.0}) {
    StaticBody body(cube(2, kTissue, capsule, true));
    strain_body(body);
    body.positions.row(0) *= 0.8;
    const Eigen::MatrixXd k = body.dense_stiffness();
    const Eigen::VectorXd values =
        Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(k, Eigen::EigenvaluesOnly).eigenvalues();
    EXPECT_GT(values[0], -1e-12 * values[values.size() - 1]);
    EXPECT_GT(values[6], 1e-3 * values[values.size() / 2]);
  }
}

// A pulled cube: what the factor says of the next bit of force is what the tissue does, not what it did at rest.
TEST(LinearLaw, TheFactorIsAsStiffAsThePulledTissue) {
  ElasticMaterial material = kTissue;
  material.stiffening = 20;
  StaticBody body(cube(3, material, 500));
  Eigen::Matrix3Xd load = Eigen::Matrix3Xd::Zero(3, body.model().node_count());
  const auto top =
      reference::nodes_where(body.model().mesh, [](const Eigen::Vector3d& x) { return x.z() > 1 - 1e-9; });
  for (const int n : top) load(2, n) = 1 / static_cast<double>(top.size());
  const double at_rest = body.linear_answer(load).cwiseProduct(load).sum();
  ASSERT_LE(body.relax(4000 * load, 1e-9, 400), 400);
  const Eigen::Matrix3Xd pulled = body.positions;
  const double foreseen = body.linear_answer(load).cwiseProduct(load).sum();
  ASSERT_LE(body.relax(4010 * load, 1e-9, 400), 400);
  const double done = (body.positions - pulled).cwiseProduct(load).sum() / 10;
  std::printf("  compliance %.3e at rest, pulled %.3e, of the factor %.3e m/N\n", at_rest, done, foreseen);
  EXPECT_LT(done, 0.6 * at_rest);
  EXPECT_NEAR(foreseen / done, 1, 0.12);
}

// Its pressure is the work of all its stress as it grows, that of the law too.
TEST(LinearLaw, PressureOfACavityIsTheWorkOfItsLaw) {
  ElasticMaterial material = kTissue;
  StaticBody body(cube(1, material));
  std::vector<int> all(static_cast<std::size_t>(body.model().tet_count()));
  std::iota(all.begin(), all.end(), 0);
  const Cavity cavity(body.model(), all);
  strain_body(body);
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
  ElasticMaterial relaxing = kTissue;
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
  EXPECT_LT(moved(kTissue, 100, 500), 0.98 * moved(kTissue, 100, 0)) << "its capsule holds it, too";
  EXPECT_EQ(moved(kTissue, 20, 500), moved(kTissue, 20, 500));
}

}  // namespace
}  // namespace stylet::physics
