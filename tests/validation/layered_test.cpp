// Elements of parallel layers thinner than they are, against layers that a mesh resolves and against theory.
#include "physics/tissue/quadratic.h"
#include "physics/tissue/refinement.h"
#include "physics/tissue/tissue_model.h"
#include "tests/validation/residual.h"
#include "tests/validation/static_body.h"
#include "tools/reference/kuhn_box.h"

#include <gtest/gtest.h>
#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <functional>
#include <memory>
#include <random>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace stylet::physics {
namespace {

using validation::report_residual;
using validation::StaticBody;

using Material = std::function<ElasticMaterial(const Eigen::Vector3d&)>;
using Where = std::function<bool(const Eigen::Vector3d&)>;

constexpr double kSkin = 200e3, kFat = 5e3;  // Pa

/// Layers of skin and fat, half of each.
ElasticMaterial skin_and_fat(double poisson_ratio, const Eigen::Vector3d& normal) {
  const double along = 0.5 * (kSkin + kFat);
  const double across = 2 / (1 / kSkin + 1 / kFat);
  return {.young_modulus = along,
          .poisson_ratio = poisson_ratio,
          .layers = {.across = across / along, .normal = {normal.x(), normal.y(), normal.z()}}};
}

/// @param jitter  of the inner nodes, m
StaticBody box(const Eigen::Vector3d& size, const std::array<int, 3>& cells, const Material& material,
               const Where& is_fixed, double jitter = 0) {
  TetMesh coarse = reference::kuhn_box(Eigen::Vector3d::Zero(), size, cells);
  if (jitter > 0) reference::jitter_inner_nodes(coarse, jitter, 11);
  TetMesh mesh = refined(coarse);
  std::vector<ElasticMaterial> materials;
  for (const auto& tet : mesh.tets) {
    Eigen::Vector3d middle = Eigen::Vector3d::Zero();
    for (const int n : tet) middle += mesh.nodes[static_cast<std::size_t>(n)] / 4;
    materials.push_back(material(middle));
  }
  const auto fixed = reference::nodes_where(mesh, is_fixed);
  return StaticBody(TissueModel(std::move(mesh), materials, fixed, 0, Element::quadratic));
}

bool on_base(const Eigen::Vector3d& x) {
  return x.z() < 1e-9;
}

Eigen::Vector3d some_normal() {
  return Eigen::Vector3d(0.3, -0.5, 0.8).normalized();
}

/// What layers of skin and fat hold together under a strain, J/m^3: each takes its own sym(d n^T) on top, the two of
/// them nothing in the mean, so that the energy is least.
double energy_of_layers(const Eigen::Matrix3d& strain, const Eigen::Vector3d& n, double poisson_ratio) {
  const auto energy = [&](double young, const Eigen::Matrix3d& e) {
    const double mu = young / (2 * (1 + poisson_ratio));
    const double lambda = young * poisson_ratio / ((1 + poisson_ratio) * (1 - 2 * poisson_ratio));
    return mu * e.squaredNorm() + 0.5 * lambda * e.trace() * e.trace();
  };
  const auto of_both = [&](const Eigen::Vector3d& d) {
    const Eigen::Matrix3d own = 0.5 * (d * n.transpose() + n * d.transpose());
    return 0.5 * energy(kSkin, strain + own) + 0.5 * energy(kFat, strain - own);
  };
  // Quadratic in d: its minimum from values.
  Eigen::Vector3d slope;
  Eigen::Matrix3d curvature;
  const double here = of_both(Eigen::Vector3d::Zero());
  for (int i = 0; i < 3; ++i) {
    const Eigen::Vector3d u = Eigen::Vector3d::Unit(i);
    slope[i] = 0.5 * (of_both(u) - of_both(-u));
    for (int j = 0; j < 3; ++j) {
      const Eigen::Vector3d v = Eigen::Vector3d::Unit(j);
      curvature(i, j) = of_both(u + v) - of_both(u) - of_both(v) + here;
    }
  }
  return of_both(-curvature.inverse() * slope);
}

// Backus 1962. Six strains, and so all of the stiffness.
TEST(Layered, AnElementYieldsAsTheLayersInItDo) {
  for (const double poisson_ratio : {0.3, 0.45, 0.49}) {
    for (const Eigen::Vector3d& normal : {Eigen::Vector3d(0, 0, 1), some_normal()}) {
      StaticBody body = box(
          Eigen::Vector3d::Ones(), {1, 1, 1},
          [&](const Eigen::Vector3d&) { return skin_and_fat(poisson_ratio, normal); }, on_base);
      const Eigen::Matrix3Xd rest = body.positions;
      const double size = 1e-5;
      double worst = 0;
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j <= i; ++j) {
          Eigen::Matrix3d strain = Eigen::Matrix3d::Zero();
          strain(i, j) = strain(j, i) = 1;
          body.positions = rest + size * strain * rest;
          const double expected = size * size * energy_of_layers(strain, normal, poisson_ratio);
          worst = std::max(worst, std::abs(body.energy() / expected - 1));
        }
      }
      report_residual("energy of a strain over that of its layers, nu " + std::to_string(poisson_ratio).substr(0, 4),
                      worst, 1e-4);
    }
  }
}

ElasticMaterial layered_liver() {
  ElasticMaterial material = skin_and_fat(0.45, some_normal());
  material.stiffening = 8;
  material.relaxation = {{{.share = 0.2, .time_s = 0.3}, {.share = 0.25, .time_s = 4}}};
  return material;
}

void shake_layers(StaticBody& body, double amount, unsigned seed) {
  std::mt19937 random(seed);
  for (Eigen::Index i = 0; i < body.positions.size(); ++i) {
    body.positions.data()[i] +=
        amount * (2 * static_cast<double>(random()) / static_cast<double>(std::mt19937::max()) - 1);
  }
}

Eigen::Matrix3d turn_of_layers() {
  return Eigen::AngleAxisd(2.2, Eigen::Vector3d(0.3, -0.8, 0.52).normalized()).toRotationMatrix();
}

TEST(Layered, ForceIsTheGradientOfTheEnergy) {
  for (const bool law : {false, true}) {
    StaticBody body = box(
        Eigen::Vector3d::Ones(), {1, 1, 1},
        [&](const Eigen::Vector3d&) { return law ? layered_liver() : skin_and_fat(0.49, some_normal()); }, on_base);
    const Eigen::Matrix3Xd rest = body.positions;
    if (law) {  // another deformation half forgotten
      shake_layers(body, 0.05, 3);
      body.fade(1);
    }
    body.positions = turn_of_layers() * rest;
    shake_layers(body, 0.05, 5);
    const double error = body.gradient_error(2e-4);
    ASSERT_EQ(body.inverted_count(), 0);
    report_residual("|dU/dp - F_int| / |F_int|", error, 1e-7);
    const Eigen::Matrix3Xd forces = body.forces();
    const double energy = body.energy();
    body.positions = (turn_of_layers() * body.positions).eval();
    report_residual("turned: force",
                    (body.forces() - turn_of_layers() * forces).cwiseAbs().maxCoeff() / forces.cwiseAbs().maxCoeff(),
                    1e-11);
    report_residual("turned: energy", std::abs(body.energy() / energy - 1), 1e-12);
  }
}

TEST(Layered, StiffnessAtRestIsTheDerivativeOfTheForce) {
  StaticBody body = box(
      Eigen::Vector3d::Ones(), {1, 1, 1}, [](const Eigen::Vector3d&) { return skin_and_fat(0.49, some_normal()); },
      on_base);
  body.positions = (turn_of_layers() * body.positions).eval();
  report_residual("|dF/dp - K| / |K| at rest", body.stiffness_error(1e-5), 1e-8);
}

// All surface nodes follow an affine map of large rotation and 5 % strain; the inner nodes must find it.
TEST(Layered, PatchTestHoldsOnIrregularMesh) {
  const Where on_surface = [](const Eigen::Vector3d& x) {
    return (x.array() < 1e-9).any() || (x.array() > 1 - 1e-9).any();
  };
  for (const double poisson_ratio : {0.3, 0.499}) {
    StaticBody body = box(
        Eigen::Vector3d::Ones(), {2, 2, 2},
        [&](const Eigen::Vector3d&) { return skin_and_fat(poisson_ratio, some_normal()); }, on_surface, 0.07);
    Eigen::Matrix3d affine;
    affine << 1.04, 0.03, 0, 0.01, 0.97, -0.02, 0.02, 0, 1.05;
    const Eigen::Matrix3Xd exact = turn_of_layers() * affine * body.positions;
    body.positions = exact;
    for (int n = 0; n < body.model().node_count(); ++n) {
      if (body.model().free_index[static_cast<std::size_t>(n)] >= 0)
        body.positions.col(n) += 0.01 * Eigen::Vector3d(1, -1, 0.5);
    }
    body.relax(Eigen::Matrix3Xd::Zero(3, body.model().node_count()), 1e-9, 200);
    report_residual("patch test, nu " + std::to_string(poisson_ratio).substr(0, 5) + ", largest error / edge",
                    (body.positions - exact).cwiseAbs().maxCoeff(), 1e-11);
  }
}

// Softer than the layers across all of it nothing gets: six rigid motions are free, and no other.
TEST(Layered, OnlyRigidMotionsAreFree) {
  for (const double poisson_ratio : {0.3, 0.499}) {
    const auto eigenvalues = [&](const Material& material) {
      StaticBody body = box(Eigen::Vector3d::Ones(), {2, 2, 2}, material, on_base, 0.07);
      body.positions = (turn_of_layers() * body.positions).eval();
      body.forces();  // finds the rotations
      return Eigen::VectorXd(
          Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(body.dense_stiffness(), Eigen::EigenvaluesOnly)
              .eigenvalues());
    };
    const Eigen::VectorXd layered =
        eigenvalues([&](const Eigen::Vector3d&) { return skin_and_fat(poisson_ratio, some_normal()); });
    const Eigen::VectorXd softest = eigenvalues([&](const Eigen::Vector3d&) {
      const ElasticMaterial material = skin_and_fat(poisson_ratio, some_normal());
      return ElasticMaterial{.young_modulus = material.young_modulus * material.layers.across,
                             .poisson_ratio = poisson_ratio};
    });
    report_residual("largest of six that must be zero / largest",
                    layered.head<6>().cwiseAbs().maxCoeff() / layered.maxCoeff(), 1e-12);
    std::printf("  softest shape %.3f of what is as soft all over\n", layered[6] / softest[6]);
    EXPECT_GT(layered[6], softest[6]);
  }
}

// A soft sheet of a tenth between stiff ones, in the middle of an element: sheared along it, and pressed where it can
// give way to the sides.
TEST(Layered, ASoftSheetInsideAnElementShears) {
  const auto is_soft = [](const Eigen::Vector3d& x) { return std::abs(x.z() - 0.5) < 0.05; };
  const auto deflection = [&](int cells, const Material& material) {
    StaticBody body = box({2, 2, 1}, {2, 2, cells}, material, on_base);
    Eigen::Matrix3Xd load = Eigen::Matrix3Xd::Zero(3, body.model().node_count());
    int loaded = 0;
    for (int n = 0; n < body.model().node_count(); ++n) {
      if (body.model().mesh.nodes[static_cast<std::size_t>(n)].z() < 1 - 1e-9) continue;
      load(0, n) = 1;
      ++loaded;
    }
    load /= loaded;
    return body.linear_answer(load).cwiseProduct(load).sum();
  };
  const double resolved = deflection(20, [&](const Eigen::Vector3d& x) {
    return ElasticMaterial{.young_modulus = is_soft(x) ? kFat : kSkin, .poisson_ratio = 0.45};
  });
  ElasticMaterial mean = {.young_modulus = 0.1 * kFat + 0.9 * kSkin, .poisson_ratio = 0.45};
  const double of_mean = deflection(1, [&](const Eigen::Vector3d&) { return mean; });
  mean.layers = {.across = 1 / ((0.1 / kFat + 0.9 / kSkin) * mean.young_modulus), .normal = {0, 0, 1}};
  const double of_layers = deflection(1, [&](const Eigen::Vector3d&) { return mean; });
  std::printf("  of the mean %.3f, of layers %.3f of what the layers give way\n", of_mean / resolved,
              of_layers / resolved);
  EXPECT_LT(of_mean, 0.5 * resolved);
  report_residual("layers in an element over layers of elements", std::abs(of_layers / resolved - 1), 0.1);
}

/// Skin, fat and muscle of the abdominal wall by depth below the upper face, m.
double young_at(double depth) {
  return depth < 0.002 ? 200e3 : depth < 0.014 ? 5e3 : 30e3;
}

constexpr double kWall = 0.024;  // m

/// A wall of 48 x 48 mm, held below, pressed on 12 x 12 mm of its skin.
class Wall {
public:
  /// @param depths   where elements end, m
  /// @param layered  layers in an element, else their mean
  Wall(int cells, const std::vector<double>& depths, bool layered) {
    TetMesh coarse = reference::kuhn_box(Eigen::Vector3d::Zero(), {0.048, 0.048, static_cast<double>(depths.size())},
                                         {cells, cells, static_cast<int>(depths.size())});
    for (Eigen::Vector3d& x : coarse.nodes) {
      const auto layer = static_cast<std::size_t>(std::lround(x.z()));
      x.z() = kWall - (layer == depths.size() ? 0 : depths[depths.size() - 1 - layer]);
    }
    TetMesh mesh = refined(coarse);
    std::vector<ElasticMaterial> materials;
    for (const auto& tet : mesh.tets) {
      double along = 0, softness = 0;
      int samples = 0;
      for (int a = 0; a <= 7; ++a) {
        for (int b = 0; a + b <= 7; ++b) {
          for (int c = 0; a + b + c <= 7; ++c, ++samples) {
            const Eigen::Vector4d weights = (Eigen::Vector4d(a, b, c, 7 - a - b - c).array() + 0.25) / 8;
            double z = 0;
            for (std::size_t i = 0; i < 4; ++i)
              z += weights[static_cast<Eigen::Index>(i)] * mesh.nodes[static_cast<std::size_t>(tet[i])].z();
            along += young_at(kWall - z);
            softness += 1 / young_at(kWall - z);
          }
        }
      }
      along /= samples;
      softness /= samples;
      materials.push_back(
          {.young_modulus = along,
           .poisson_ratio = 0.45,
           .layers = layered ? Layering{.across = std::min(1.0, 1 / (softness * along)), .normal = {0, 0, 1}}
                             : Layering{}});
    }
    const auto fixed = reference::nodes_where(mesh, on_base);
    body_ = std::make_unique<StaticBody>(TissueModel(std::move(mesh), materials, fixed, 0, Element::quadratic));
  }

  /// Mean motion of the pressed skin, m/N.
  double compliance(const Eigen::Vector3d& direction) {
    const TissueModel& model = body_->model();
    Eigen::Matrix3Xd load = Eigen::Matrix3Xd::Zero(3, model.node_count());
    constexpr int kPoints = 12;
    for (int i = 0; i < kPoints; ++i) {
      for (int j = 0; j < kPoints; ++j) {
        const Eigen::Vector3d at(0.018 + 0.012 * (i + 0.5) / kPoints, 0.018 + 0.012 * (j + 0.5) / kPoints,
                                 kWall - 1e-6);
        const TetPoint point = model.topology.locate(rest_positions(model), at, 0);
        for (std::size_t a = 0; a < 4; ++a) {
          load.col(model.topology.nodes(point.tet)[a]) +=
              point.barycentric[static_cast<Eigen::Index>(a)] / (kPoints * kPoints) * direction;
        }
      }
    }
    return body_->linear_answer(load).cwiseProduct(load).sum();
  }

private:
  std::unique_ptr<StaticBody> body_;
};

// Elements that end where the layers do are the measure. Those of the same number that do not, 6 mm thick across skin
// of 2 mm, are too stiff by far with the mean of what lies in them.
TEST(Layered, AWallGivesWayWhereElementsCrossItsLayers) {
  Wall resolved(8, {0.002, 0.005, 0.008, 0.011, 0.014, 0.019, 0.024}, false);
  Wall mean(8, {0.006, 0.012, 0.018, 0.024}, false);
  Wall layered(8, {0.006, 0.012, 0.018, 0.024}, true);
  for (const Eigen::Vector3d& direction : {Eigen::Vector3d(0, 0, -1), Eigen::Vector3d(1, 0, 0)}) {
    const double truth = resolved.compliance(direction);
    const double of_layers = layered.compliance(direction) / truth;
    const double of_mean = mean.compliance(direction) / truth;
    std::printf("  %s: %.3f mm/N; of the mean %.3f, of layers %.3f\n", direction.z() != 0 ? "pressed" : "dragged",
                1e3 * truth, of_mean, of_layers);
    report_residual("pressed on layers: off", std::abs(of_layers - 1), 0.1);
    EXPECT_LT(of_mean, 0.9);
  }
}

TEST(Layered, WithoutLayersNothingChanges) {
  ElasticMaterial material = skin_and_fat(0.45, some_normal());
  material.layers.across = 1;
  StaticBody one = box(
      Eigen::Vector3d::Ones(), {1, 1, 1}, [&](const Eigen::Vector3d&) { return material; }, on_base);
  material.layers = {};
  StaticBody other = box(
      Eigen::Vector3d::Ones(), {1, 1, 1}, [&](const Eigen::Vector3d&) { return material; }, on_base);
  ASSERT_TRUE(one.model().quadratics[0].linear);
  shake_layers(one, 0.05, 3);
  other.positions = one.positions;
  const Eigen::Matrix3Xd forces = other.forces();
  report_residual("force", (one.forces() - forces).cwiseAbs().maxCoeff() / forces.cwiseAbs().maxCoeff(), 1e-13);
}

TEST(Layered, SomethingElseIsRefused) {
  for (const Layering& wrong : {Layering{.across = 0}, Layering{.across = 1.1}, Layering{.normal = {0, 0, 2}}}) {
    EXPECT_THROW(box(
                     Eigen::Vector3d::Ones(), {1, 1, 1},
                     [&](const Eigen::Vector3d&) { return ElasticMaterial{.layers = wrong}; }, on_base),
                 std::invalid_argument);
  }
}

}  // namespace
}  // namespace stylet::physics
