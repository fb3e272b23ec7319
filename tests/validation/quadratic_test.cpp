// Quadratic tetrahedra with one dilatation each against theory: patch, gradient, order, beams, modes, stability.
#include "physics/tissue/quadratic.h"

#include "physics/tissue/refinement.h"
#include "tests/support/sanitized.h"
#include "tests/validation/residual.h"
#include "tests/validation/static_body.h"
#include "tools/reference/kuhn_box.h"

#include <gtest/gtest.h>
#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace stylet::physics {
namespace {

using validation::report_residual;
using validation::StaticBody;

constexpr double kTissueYoung = 10e3;
constexpr double kPi = std::numbers::pi;
constexpr double kSize = 1e-5;  // of a displacement to which the answer is linear

Eigen::Matrix3d some_rotation() {
  return Eigen::AngleAxisd(2.2, Eigen::Vector3d(0.3, -0.8, 0.52).normalized()).toRotationMatrix();
}

TissueModel quadratic_body(const TetMesh& coarse, double poisson_ratio, bool (*is_fixed)(const Eigen::Vector3d&)) {
  TetMesh mesh = refined(coarse);
  const auto fixed = reference::nodes_where(mesh, is_fixed);
  const std::vector<ElasticMaterial> materials(mesh.tets.size(), {kTissueYoung, poisson_ratio});
  return {std::move(mesh), materials, fixed, 0, Element::quadratic};
}

/// An irregular unit cube.
StaticBody irregular_cube(int cells, double poisson_ratio, bool (*is_fixed)(const Eigen::Vector3d&)) {
  TetMesh coarse = reference::kuhn_box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones(), {cells, cells, cells});
  reference::jitter_inner_nodes(coarse, 0.15 / cells, 11);
  return StaticBody(quadratic_body(coarse, poisson_ratio, is_fixed));
}

bool is_bottom(const Eigen::Vector3d& x) {
  return x.z() < 1e-9;
}
bool is_surface(const Eigen::Vector3d& x) {
  return (x.array() < 1e-9).any() || (x.array() > 1 - 1e-9).any();
}

TEST(Quadratic, EightTetrahedraFillTheOne) {
  const TetMesh coarse = reference::kuhn_box(Eigen::Vector3d::Zero(), Eigen::Vector3d(1, 2, 3), {2, 1, 1});
  const TetMesh fine = refined(coarse);
  ASSERT_EQ(fine.tets.size(), 8 * coarse.tets.size());
  const auto volume = [](const TetMesh& mesh, std::size_t t) {
    Eigen::Matrix3d edges;
    for (std::size_t a = 0; a < 3; ++a) {
      edges.col(static_cast<Eigen::Index>(a)) = mesh.nodes[mesh.tets[t][a + 1]] - mesh.nodes[mesh.tets[t][0]];
    }
    return edges.determinant() / 6;
  };
  for (std::size_t t = 0; t < fine.tets.size(); ++t) {
    EXPECT_NEAR(volume(fine, t), volume(coarse, t / 8) / 8, 1e-15) << t;
  }
}

TEST(Quadratic, OtherEightsAreRefused) {
  TetMesh mesh = refined(reference::kuhn_box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones(), {1, 1, 1}));
  std::swap(mesh.tets[0], mesh.tets[4]);
  const std::vector<ElasticMaterial> materials(mesh.tets.size(), {kTissueYoung, 0.3});
  const std::vector<int> fixed{0, 1, 2};
  EXPECT_THROW(TissueModel(mesh, materials, fixed, 0, Element::quadratic), std::invalid_argument);
  mesh.tets.pop_back();
  EXPECT_THROW(TissueModel(mesh, std::span(materials).first(mesh.tets.size()), fixed, 0, Element::quadratic),
               std::invalid_argument);
}

// All surface nodes follow an affine map of large rotation and 5 % strain; the inner nodes must find it.
TEST(Quadratic, PatchTestHoldsOnIrregularMesh) {
  for (const double poisson_ratio : {0.3, 0.45, 0.49, 0.499}) {
    StaticBody body = irregular_cube(2, poisson_ratio, is_surface);
    Eigen::Matrix3d affine;
    affine << 1.04, 0.03, 0, 0.01, 0.97, -0.02, 0.02, 0, 1.05;
    affine = some_rotation() * affine;
    const Eigen::Matrix3Xd exact = (affine * body.positions).colwise() + Eigen::Vector3d(0.2, -0.5, 3);
    body.positions = exact;
    for (int n = 0; n < body.model().node_count(); ++n) {
      if (body.model().free_index[n] >= 0) body.positions.col(n) += 0.01 * Eigen::Vector3d(1, -1, 0.5);
    }
    const Eigen::Matrix3Xd no_load = Eigen::Matrix3Xd::Zero(3, body.model().node_count());
    body.relax(no_load, 1e-9, 100);
    report_residual("patch test, nu " + std::to_string(poisson_ratio).substr(0, 5) + ", largest error / edge",
                    (body.positions - exact).cwiseAbs().maxCoeff(), 1e-11);
  }
}

TEST(Quadratic, RigidMotionMakesNoForce) {
  StaticBody body = irregular_cube(2, 0.499, is_bottom);
  body.positions = ((some_rotation() * body.positions).colwise() + Eigen::Vector3d(1, 2, -3)).eval();
  report_residual("force of a rigid motion / lambda h^2",
                  body.forces().cwiseAbs().maxCoeff() / (body.model().quadratics[0].lambda * 0.25), 1e-12);
  EXPECT_EQ(body.inverted_count(), 0);
}

TEST(Quadratic, ForceIsTheGradientOfTheEnergy) {
  for (const double poisson_ratio : {0.3, 0.499}) {
    StaticBody body = irregular_cube(1, poisson_ratio, is_bottom);
    std::mt19937 random(5);
    std::uniform_real_distribution<double> shift(-0.05, 0.05);
    body.positions = (some_rotation() * body.positions).eval();
    for (Eigen::Index i = 0; i < body.positions.size(); ++i) body.positions.data()[i] += shift(random);
    const double error = body.gradient_error(2e-4);
    ASSERT_EQ(body.inverted_count(), 0);
    report_residual("|dU/dp - F_int| / |F_int|, nu " + std::to_string(poisson_ratio).substr(0, 5), error, 1e-8);
  }
}

/// The middle of an edge is so far on its way into the face opposite it that a tetrahedron keeps a share of its
/// volume, while that of the points is another. Returns that tetrahedron.
int flatten(StaticBody& body, double kept) {
  constexpr int kTet = 0;
  const auto& n = body.model().mesh.tets[kTet];  // node 1 is the middle of the edge from node 0
  const Eigen::Vector3d others = (body.positions.col(n[0]) + body.positions.col(n[2]) + body.positions.col(n[3])) / 3;
  body.positions.col(n[1]) = others + kept * (body.positions.col(n[1]) - others);
  return kTet;
}

// The tetrahedra that contacts and pictures see would be squeezed flat while the points of the element are not.
TEST(Quadratic, FlatTetrahedraPushBackAsTheEnergySays) {
  StaticBody body = irregular_cube(1, 0.49, is_bottom);
  body.positions = (some_rotation() * body.positions).eval();
  const int tet = flatten(body, 0.2);
  std::vector<SqueezedTet> squeezed;
  find_squeezed(body.model(), body.positions, {}, squeezed);
  EXPECT_TRUE(std::ranges::any_of(squeezed, [&](const SqueezedTet& s) { return s.tet == 4 + tet; }));
  report_residual("|dU/dp - F_int| / |F_int|", body.gradient_error(1e-4), 1e-7);
  ASSERT_EQ(body.inverted_count(), 0);

  // What they add to K: V psi'' (dJ/dp)(dJ/dp)^T.
  const std::vector<Eigen::Quaterniond> rotations(body.model().point_count(), Eigen::Quaterniond::Identity());
  const StiffnessPattern pattern(body.model());
  std::vector<double> with(pattern.nonzeros()), without(pattern.nonzeros());
  pattern.assemble(body.model(), rotations, 1, with, squeezed);
  pattern.assemble(body.model(), rotations, 1, without);
  Eigen::MatrixXd added = Eigen::MatrixXd::Zero(body.model().dof_count(), body.model().dof_count());
  for (int c = 0; c < body.model().dof_count(); ++c) {
    for (int i = pattern.column_start()[c]; i < pattern.column_start()[c + 1]; ++i) {
      added(pattern.rows()[i], c) = added(c, pattern.rows()[i]) = with[i] - without[i];
    }
  }
  Eigen::MatrixXd expected = Eigen::MatrixXd::Zero(added.rows(), added.cols());
  for (const SqueezedTet& s : squeezed) {
    const auto element = static_cast<std::size_t>(s.tet / kSqueezable);
    const int which = s.tet % kSqueezable;
    Eigen::VectorXd slope = Eigen::VectorXd::Zero(added.rows());
    const auto add = [&](int node, const Eigen::Vector3d& g) {
      if (body.model().free_index[node] >= 0) slope.segment<3>(3 * body.model().free_index[node]) += s.cofactor * g;
    };
    double volume = 0;
    if (which < 4) {
      const QuadraticRest& rest = body.model().quadratics[element];
      volume = rest.volume[which];
      const auto gradients = gradients_of(rest);
      for (std::size_t a = 0; a < 10; ++a) {
        add(rest.nodes[a], {gradients[a][0][which], gradients[a][1][which], gradients[a][2][which]});
      }
    } else {
      const std::size_t t = kTetsOfRefined * element + static_cast<std::size_t>(which - 4);
      volume = body.model().tets[t].volume;
      for (int k = 0; k < 4; ++k) add(body.model().mesh.tets[t][k], body.model().tets[t].gradients.col(k));
    }
    expected += volume * s.curvature * slope * slope.transpose();
  }
  report_residual("|what flat tetrahedra add - expected| / expected",
                  (added - expected).cwiseAbs().maxCoeff() / expected.cwiseAbs().maxCoeff(), 1e-10);
}

/// det F of a point of an element.
double volume_at(const QuadraticRest& rest, const Eigen::Matrix3Xd& positions, int point) {
  const auto gradients = gradients_of(rest);
  Eigen::Matrix3d f = Eigen::Matrix3d::Zero();
  for (std::size_t a = 0; a < 10; ++a) {
    f += positions.col(rest.nodes[a]) *
         Eigen::RowVector3d(gradients[a][0][point], gradients[a][1][point], gradients[a][2][point]);
  }
  return f.determinant();
}

TEST(Quadratic, AStepEndsWhereTheFirstPointOrTetrahedronHasThreeTenthsOfItsVolumeLeft) {
  StaticBody body = irregular_cube(1, 0.49, is_bottom);
  const Eigen::Matrix3Xd before = body.positions;
  std::srand(1);
  int of_points = 0;
  for (int trial = 0; trial < 20; ++trial) {
    const Eigen::Matrix3Xd after = before + Eigen::Matrix3Xd::Random(3, before.cols());
    const double fraction = uninverted_fraction(body.model(), before, after);
    ASSERT_LT(fraction, 1);
    const Eigen::Matrix3Xd there = before + fraction * (after - before);
    double of_tet = 1;
    for (int t = 0; t < body.model().tet_count(); ++t) {
      of_tet = std::min(of_tet, deformation_gradient(body.model(), there, t).determinant() /
                                    deformation_gradient(body.model(), before, t).determinant());
    }
    double of_point = 1;
    for (const QuadraticRest& rest : body.model().quadratics) {
      for (int q = 0; q < 4; ++q)
        of_point = std::min(of_point, volume_at(rest, there, q) / volume_at(rest, before, q));
    }
    EXPECT_NEAR(std::min(of_tet, of_point), 0.3, 1e-4);
    if (of_point < of_tet) ++of_points;
  }
  std::printf("  a point came first %d times of 20\n", of_points);
  EXPECT_GT(of_points, 0);
  EXPECT_LT(of_points, 20);
}

/// K of all nodes as a dense matrix: nothing is fixed.
Eigen::MatrixXd dense_stiffness(TissueModel model) {
  std::fill(model.free_index.begin(), model.free_index.end(), 0);
  for (int n = 0; n < model.node_count(); ++n) model.free_index[n] = n;
  model.free_node_count = model.node_count();
  const StiffnessPattern pattern(model);
  std::vector<double> values(pattern.nonzeros());
  pattern.assemble(model, std::vector<Eigen::Quaterniond>(model.point_count(), Eigen::Quaterniond::Identity()), 1,
                   values);
  Eigen::MatrixXd k = Eigen::MatrixXd::Zero(model.dof_count(), model.dof_count());
  for (int c = 0; c < model.dof_count(); ++c) {
    for (int i = pattern.column_start()[c]; i < pattern.column_start()[c + 1]; ++i) {
      k(pattern.rows()[i], c) = k(c, pattern.rows()[i]) = values[i];
    }
  }
  return k;
}

TEST(Quadratic, StiffnessAtRestIsTheDerivativeOfTheForce) {
  StaticBody body = irregular_cube(1, 0.49, is_bottom);
  report_residual("|dF/dp - K| / |K| at rest", body.stiffness_error(1e-5), 1e-8);
}

// K leaves out what pressure adds to the derivative H of the force, p (d2 J), which at a point is as large as mu
// where 4 % of volume are lost at nu 0.49. The volume of a held body does not change with what is inside: evenly
// pressed it adds nothing, and K is right to leave it out.
TEST(Quadratic, EvenPressureAddsNothingToTheStiffnessOfAHeldBody) {
  for (const double lost : {0.03, 0.1}) {
    StaticBody body = irregular_cube(2, 0.49, is_surface);
    body.positions.row(2) *= 1 - lost;
    const Eigen::MatrixXd k_all = body.dense_stiffness();
    std::vector<Eigen::Index> dofs;
    for (int n = 0; n < body.model().node_count(); ++n) {
      for (int c = 0; c < 3 && body.model().free_index[n] >= 0; ++c) dofs.push_back(3 * n + c);
    }
    const auto count = static_cast<Eigen::Index>(dofs.size());
    Eigen::MatrixXd h(count, count);
    constexpr double kStep = 1e-5;
    for (Eigen::Index i = 0; i < count; ++i) {
      double& moved = body.positions.data()[dofs[static_cast<std::size_t>(i)]];
      const double here = moved;
      moved = here + kStep;
      const Eigen::Matrix3Xd up = body.forces();
      moved = here - kStep;
      const Eigen::Matrix3Xd down = body.forces();
      moved = here;
      h.col(i) = (up - down).reshaped()(dofs) / (2 * kStep);
    }
    const Eigen::VectorXd ratios = Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd>(
                                       0.5 * (h + h.transpose()), k_all(dofs, dofs), Eigen::EigenvaluesOnly)
                                       .eigenvalues();
    std::printf("  %.0f %% of volume lost: H over K from %.3f to %.3f\n", 100 * lost, ratios.minCoeff(),
                ratios.maxCoeff());
    EXPECT_GT(ratios.minCoeff(), 0.9);
    EXPECT_LT(ratios.maxCoeff(), 1.05);
  }
}

// A free cube moves rigidly in six ways and in no other without energy. What is softest then is a shape of the whole
// body, which a finer mesh has too: no hourglass, no checkerboard.
TEST(Quadratic, OnlyRigidMotionsAreFree) {
  for (const double poisson_ratio : {0.3, 0.499}) {
    double coarse_softest = 0;
    for (const int cells : {2, 3}) {
      const TetMesh mesh =
          reference::kuhn_box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones(), {cells, cells, cells});
      const TissueModel model = quadratic_body(mesh, poisson_ratio, is_bottom);
      // Against the mass matrix, lumped by the volume of the tetrahedra around each node.
      Eigen::VectorXd mass = Eigen::VectorXd::Zero(3 * model.node_count());
      for (std::size_t t = 0; t < model.tets.size(); ++t) {
        for (const int n : model.mesh.tets[t]) mass.segment<3>(3 * n).array() += model.tets[t].volume / 4;
      }
      const Eigen::VectorXd root = mass.cwiseSqrt().cwiseInverse();
      const Eigen::VectorXd values =
          Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(
              root.asDiagonal() * dense_stiffness(model) * root.asDiagonal(), Eigen::EigenvaluesOnly)
              .eigenvalues();
      std::printf("  nu %.3f, %d cells: lambda_6 %.2e, lambda_7 to 12 / E: %.3f %.3f %.3f %.3f %.3f %.3f\n",
                  poisson_ratio, cells, values[5] / kTissueYoung, values[6] / kTissueYoung, values[7] / kTissueYoung,
                  values[8] / kTissueYoung, values[9] / kTissueYoung, values[10] / kTissueYoung,
                  values[11] / kTissueYoung);
      report_residual("largest of six that must be zero / largest", std::abs(values[5]) / values.maxCoeff(), 1e-12);
      if (cells > 2) {
        report_residual("softest shape, two cells against three: relative difference",
                        std::abs(coarse_softest / values[6] - 1), 0.1);
      }
      coarse_softest = values[6];
    }
  }
}

// Pressure is held by the displacement: the least singular value beta of the divergence, in the norms of both (the
// inf-sup condition), hardly falls with the size of the elements. In a regular lattice of Kuhn tetrahedra it does, as
// 1/n, for want of nodes inside faces: there the pressure of single elements says little, displacements converge all
// the same. Linear tetrahedra with a pressure each have beta = 0.
TEST(Quadratic, PressureIsStableOnIrregularMeshes) {
  double previous = 0;
  for (const int cells : {2, 3, 4}) {
    if (support::kSanitized && cells > 2) break;
    TetMesh mesh = reference::kuhn_box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones(), {cells, cells, cells});
    reference::jitter_inner_nodes(mesh, 0.15 / cells, 11);
    const TissueModel model = quadratic_body(mesh, 0.3, is_bottom);
    const auto elements = static_cast<Eigen::Index>(model.quadratics.size());
    // a: the H1 seminorm on the free nodes; b: divergence by elements, over the root of their volume.
    Eigen::MatrixXd a = Eigen::MatrixXd::Zero(model.dof_count(), model.dof_count());
    Eigen::MatrixXd b = Eigen::MatrixXd::Zero(elements, model.dof_count());
    for (Eigen::Index e = 0; e < elements; ++e) {
      const QuadraticRest& rest = model.quadratics[static_cast<std::size_t>(e)];
      const double root = std::sqrt(rest.volume.sum());
      const auto gradients = gradients_of(rest);
      for (std::size_t n = 0; n < 10; ++n) {
        const int i = model.free_index[rest.nodes[n]];
        if (i < 0) continue;
        for (std::size_t c = 0; c < 3; ++c) {
          b(e, 3 * i + static_cast<int>(c)) += (rest.volume * gradients[n][c]).sum() / root;
        }
        for (std::size_t m = 0; m < 10; ++m) {
          const int j = model.free_index[rest.nodes[m]];
          if (j < 0) continue;
          double product = 0;
          for (std::size_t c = 0; c < 3; ++c) {
            product += (rest.volume * gradients[n][c] * gradients[m][c]).sum();
          }
          for (int c = 0; c < 3; ++c) a(3 * i + c, 3 * j + c) += product;
        }
      }
    }
    const Eigen::MatrixXd schur = b * a.llt().solve(b.transpose());
    const Eigen::VectorXd values =
        Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(schur, Eigen::EigenvaluesOnly).eigenvalues();
    const double beta = std::sqrt(std::max(values[0], 0.0));
    std::printf("  %d cells: beta %.4f\n", cells, beta);
    EXPECT_GT(beta, 0.15);
    EXPECT_GT(beta, 0.7 * previous);
    previous = beta;
  }
}

// u = curl of a smooth potential, times 1e-4: no change of volume, no load but a body force; boundary held by u.
TEST(Quadratic, ConvergesWithSecondOrderAndMoreWhereVolumeHardlyChanges) {
  const auto exact = [](const Eigen::Vector3d& x) -> Eigen::Vector3d {
    return kSize * Eigen::Vector3d(std::sin(kPi * x.x()) * std::cos(kPi * x.y()),
                                   -std::cos(kPi * x.x()) * std::sin(kPi * x.y()) + std::cos(kPi * x.z()),
                                   std::sin(kPi * x.x()));
  };
  // -div sigma = -mu laplacian u (div u = 0).
  const auto body_force = [](const Eigen::Vector3d& x, double mu) -> Eigen::Vector3d {
    return kSize * mu * kPi * kPi *
           Eigen::Vector3d(2 * std::sin(kPi * x.x()) * std::cos(kPi * x.y()),
                           -2 * std::cos(kPi * x.x()) * std::sin(kPi * x.y()) + std::cos(kPi * x.z()),
                           std::sin(kPi * x.x()));
  };
  for (const double poisson_ratio : {0.3, 0.499}) {
    double previous = 0;
    for (const int cells : {2, 4, 8}) {
      if (support::kSanitized && cells > 4) break;
      StaticBody body(
          quadratic_body(reference::kuhn_box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Ones(), {cells, cells, cells}),
                         poisson_ratio, is_surface));
      const TissueModel& model = body.model();
      const double mu = kTissueYoung / (2 * (1 + poisson_ratio));
      Eigen::Matrix3Xd load = Eigen::Matrix3Xd::Zero(3, model.node_count());
      for (const QuadraticRest& rest : model.quadratics) {
        for (int p = 0; p < 4; ++p) {
          Eigen::Vector4d l = Eigen::Vector4d::Constant(0.13819660112501051518);
          l[p] = 0.58541019662496845446;
          Eigen::Matrix<double, 10, 1> shape;
          Eigen::Vector3d at = Eigen::Vector3d::Zero();
          for (int a = 0; a < 4; ++a) shape[a] = l[a] * (2 * l[a] - 1);
          for (std::size_t e = 0; e < kTetEdges.size(); ++e) {
            shape[static_cast<Eigen::Index>(e) + 4] = 4 * l[kTetEdges[e].first] * l[kTetEdges[e].second];
          }
          for (std::size_t a = 0; a < 10; ++a)
            at += shape[static_cast<Eigen::Index>(a)] * model.mesh.nodes[rest.nodes[a]];
          for (std::size_t a = 0; a < 10; ++a) {
            load.col(rest.nodes[a]) += rest.volume[p] * shape[static_cast<Eigen::Index>(a)] * body_force(at, mu);
          }
        }
      }
      for (int n = 0; n < model.node_count(); ++n) {
        if (model.free_index[n] < 0) body.positions.col(n) = model.mesh.nodes[n] + exact(model.mesh.nodes[n]);
      }
      body.relax(load, 1e-7 * load.cwiseAbs().maxCoeff(), 60);
      double squares = 0;
      double volume = 0;
      for (std::size_t t = 0; t < model.tets.size(); ++t) {
        for (const int n : model.mesh.tets[t]) {
          const Eigen::Vector3d off = body.positions.col(n) - model.mesh.nodes[n] - exact(model.mesh.nodes[n]);
          squares += model.tets[t].volume / 4 * off.squaredNorm();
          volume += model.tets[t].volume / 4;
        }
      }
      const double error = std::sqrt(squares / volume) / kSize;
      std::printf("  nu %.3f, %d cells: relative error %.2e", poisson_ratio, cells, error);
      if (previous > 0) {
        const double order = std::log2(previous / error);
        std::printf(", order %.2f", order);
        EXPECT_GT(order, 1.9);
      }
      std::printf("\n");
      previous = error;
    }
  }
}

// The bar on which linear tetrahedra are 2 to 20 times too stiff (Cantilever.LocksAsLinearTetrahedraDo), in cells of
// the same size.
TEST(Quadratic, CantileverBendsAsTimoshenkoSays) {
  for (const double poisson_ratio : {0.3, 0.45, 0.49, 0.499}) {
    StaticBody body(quadratic_body(reference::kuhn_box(Eigen::Vector3d::Zero(), {1, 0.2, 0.2}, {10, 2, 2}),
                                   poisson_ratio, [](const Eigen::Vector3d& x) { return x.x() < 1e-9; }));
    const TissueModel& model = body.model();
    // A uniform traction on the end: a third to the middles of the edges of each face of an element.
    Eigen::Matrix3Xd load = Eigen::Matrix3Xd::Zero(3, model.node_count());
    const auto at_end = [&](int n) { return model.mesh.nodes[n].x() > 1 - 1e-9; };
    for (const QuadraticRest& rest : model.quadratics) {
      std::vector<int> corners;
      for (std::size_t a = 0; a < 4; ++a) {
        if (at_end(rest.nodes[a])) corners.push_back(rest.nodes[a]);
      }
      if (corners.size() != 3) continue;
      const Eigen::Vector3d& x = model.mesh.nodes[corners[0]];
      const double area = 0.5 * (model.mesh.nodes[corners[1]] - x).cross(model.mesh.nodes[corners[2]] - x).norm();
      for (std::size_t a = 4; a < 10; ++a) {
        if (at_end(rest.nodes[a])) load(2, rest.nodes[a]) += area / 3;
      }
    }
    const double force = load.row(2).sum();
    EXPECT_NEAR(force, 0.04, 1e-12);
    const double deflection = body.linear_answer(load).cwiseProduct(load).sum() / force;
    const double shear_modulus = kTissueYoung / (2 * (1 + poisson_ratio));
    const double timoshenko =
        force / (3 * kTissueYoung * std::pow(0.2, 4) / 12) + force / (5.0 / 6.0 * shear_modulus * 0.04);
    std::printf("  nu %.3f: tip / Timoshenko %.4f\n", poisson_ratio, deflection / timoshenko);
    report_residual("relative difference", std::abs(deflection / timoshenko - 1), 0.05);
  }
}

}  // namespace
}  // namespace stylet::physics
