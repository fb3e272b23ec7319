// Corotational tetrahedra against what continuum mechanics says of them: patch, rigid motion, energy.
#include "tests/validation/residual.h"
#include "tests/validation/static_body.h"
#include "tools/reference/kuhn_box.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <utility>
#include <vector>

namespace stylet::physics {
namespace {

using validation::report_residual;
using validation::StaticBody;

constexpr double kTissueYoung = 10e3, kEdge = 0.1;

Eigen::Matrix3d some_rotation() {
  return Eigen::AngleAxisd(2.2, Eigen::Vector3d(0.3, -0.8, 0.52).normalized()).toRotationMatrix();
}

/// An irregular 100 mm cube; its nodes for which `is_fixed` holds are fixed.
StaticBody irregular_cube(int cells, double poisson_ratio, bool (*is_fixed)(const Eigen::Vector3d&)) {
  TetMesh mesh =
      reference::kuhn_box(Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(kEdge), {cells, cells, cells});
  reference::jitter_inner_nodes(mesh, 0.2 * kEdge / cells, 11);
  const auto fixed = reference::nodes_where(mesh, is_fixed);
  const std::vector<ElasticMaterial> materials(mesh.tets.size(), {kTissueYoung, poisson_ratio});
  return StaticBody(TissueModel(std::move(mesh), materials, fixed));
}

bool is_bottom(const Eigen::Vector3d& x) {
  return x.z() < 1e-9;
}
bool is_surface(const Eigen::Vector3d& x) {
  return (x.array() < 1e-9).any() || (x.array() > kEdge - 1e-9).any();
}

// All surface nodes follow an affine map of large rotation and 5 % strain; the inner nodes must find it.
TEST(Tetrahedra, PatchTestHoldsOnIrregularMesh) {
  for (const double poisson_ratio : {0.3, 0.45, 0.49}) {
    StaticBody body = irregular_cube(4, poisson_ratio, is_surface);
    Eigen::Matrix3d affine;
    affine << 1.04, 0.03, 0, 0.01, 0.97, -0.02, 0.02, 0, 1.05;
    affine = some_rotation() * affine;
    const Eigen::Matrix3Xd exact = (affine * body.positions).colwise() + Eigen::Vector3d(0.02, -0.05, 0.3);
    body.positions = exact;
    for (int n = 0; n < body.model().node_count(); ++n) {
      const bool free = body.model().free_index[n] >= 0;
      if (free) body.positions.col(n) += 0.001 * Eigen::Vector3d(1, -1, 0.5);
    }
    const Eigen::Matrix3Xd no_load = Eigen::Matrix3Xd::Zero(3, body.model().node_count());
    body.relax(no_load, 1e-14, 60);
    report_residual("patch test, nu " + std::to_string(poisson_ratio).substr(0, 4) + ", largest error / edge",
                    (body.positions - exact).cwiseAbs().maxCoeff() / kEdge, 1e-12);
  }
}

TEST(Tetrahedra, RigidMotionMakesNoForce) {
  StaticBody body = irregular_cube(4, 0.45, is_bottom);
  body.positions = ((some_rotation() * body.positions).colwise() + Eigen::Vector3d(0.1, 0.2, -0.3)).eval();
  const double scale = kTissueYoung * std::pow(kEdge / 4, 2);  // Young's modulus times the area of an element's face
  report_residual("force of a rigid motion / E h^2", body.forces().cwiseAbs().maxCoeff() / scale, 1e-12);
  EXPECT_EQ(body.inverted_count(), 0);
}

TEST(Tetrahedra, ForceIsTheGradientOfTheEnergy) {
  StaticBody body = irregular_cube(2, 0.45, is_bottom);
  std::mt19937 random(5);
  std::uniform_real_distribution<double> shift(-0.006, 0.006);
  body.positions = (some_rotation() * body.positions).eval();
  for (Eigen::Index i = 0; i < body.positions.size(); ++i) body.positions.data()[i] += shift(random);
  const double error = body.gradient_error(2e-5);
  ASSERT_EQ(body.inverted_count(), 0);
  report_residual("|dU/dp - F_int| / |F_int|", error, 1e-8);
}

}  // namespace
}  // namespace stylet::physics
