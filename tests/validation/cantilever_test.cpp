// Bars of tetrahedra against beam theory: small deflections (with the locking of linear tetrahedra) and the elastica.
#include "tests/support/beam_chain.h"
#include "tests/support/sanitized.h"
#include "tests/validation/residual.h"
#include "tests/validation/static_body.h"
#include "tools/reference/kuhn_box.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <span>
#include <string>
#include <vector>

namespace stylet::physics {
namespace {

using validation::report_residual;
using validation::StaticBody;

constexpr double kBarYoung = 1e6;

/// A bar of unit length along x, clamped at x = 0, with a load shared by the nodes of its end.
struct Cantilever {
  StaticBody body;
  std::vector<int> end;

  Cantilever(double thickness, std::array<int, 3> cells, double poisson_ratio)
      : body(make(thickness, cells, poisson_ratio)),
        end(reference::nodes_where(body.model().mesh, [](const Eigen::Vector3d& x) { return x.x() > 1 - 1e-9; })) {}

  Eigen::Matrix3Xd end_load(double force) const {
    Eigen::Matrix3Xd load = Eigen::Matrix3Xd::Zero(3, body.model().node_count());
    for (const int n : end) load(2, n) = force / double(end.size());
    return load;
  }
  Eigen::Vector3d end_mean(const Eigen::Matrix3Xd& of) const {
    Eigen::Vector3d mean = Eigen::Vector3d::Zero();
    for (const int n : end) mean += of.col(n) / double(end.size());
    return mean;
  }

private:
  static StaticBody make(double thickness, std::array<int, 3> cells, double poisson_ratio) {
    TetMesh mesh = reference::kuhn_box(Eigen::Vector3d::Zero(), {1, thickness, thickness}, cells);
    const auto clamped = reference::nodes_where(mesh, [](const Eigen::Vector3d& x) { return x.x() < 1e-9; });
    const std::vector<ElasticMaterial> materials(mesh.tets.size(), {kBarYoung, poisson_ratio});
    return StaticBody(TissueModel(std::move(mesh), materials, clamped));
  }
};

/// Tip deflection of 1 x 0.2 x 0.2 over PL^3/3EI + PL/kGA, k = 5/6; cells 5 n x n x n.
double deflection_ratio(int n, double poisson_ratio) {
  Cantilever bar(0.2, {5 * n, n, n}, poisson_ratio);
  const double deflection = bar.end_mean(bar.body.linear_answer(bar.end_load(1))).z();
  const double shear_modulus = kBarYoung / (2 * (1 + poisson_ratio));
  const double timoshenko = 1 / (3 * kBarYoung * std::pow(0.2, 4) / 12) + 1 / (5.0 / 6.0 * shear_modulus * 0.04);
  return deflection / timoshenko;
}

// Linear tetrahedra lock; how much is known. The reference values are of Kuhn tetrahedra, three digits.
TEST(Cantilever, LocksAsLinearTetrahedraDo) {
  const struct {
    int n;
    double poisson_ratio, expected;
  } rows[] = {{2, .3, .507}, {2, .45, .306}, {2, .49, .125}, {4, .3, .782},  {4, .45, .589}, {4, .49, .294},
              {8, .3, .923}, {8, .45, .819}, {8, .49, .569}, {12, .3, .957}, {12, .45, .892}};
  for (const auto& row : rows) {
    if (support::kSanitized && row.n > 4) break;
    const double ratio = deflection_ratio(row.n, row.poisson_ratio);
    std::printf("  %d x %d x %d cells, nu %.2f: tip / Timoshenko %.4f (reference %.3f)\n", 5 * row.n, row.n, row.n,
                row.poisson_ratio, ratio, row.expected);
    report_residual("relative difference", std::abs(ratio / row.expected - 1), 0.02);
  }
}

// Without lateral contraction only bending locks, and the clamp is that of beam theory. The order is still rising at
// the coarse end, where the error is no small number.
TEST(Cantilever, ConvergesToTimoshenkoWithAlmostSecondOrder) {
  double previous_error = 0, previous_order = 0;
  int previous_n = 0;
  for (const int n : {2, 4, 8, 12}) {
    const double error = std::abs(1 - deflection_ratio(n, 0));
    std::printf("  %2d cells thick: error %.4f\n", n, error);
    if (previous_n > 0) {
      const double order = std::log(previous_error / error) / std::log(double(n) / previous_n);
      std::printf("    observed order %.2f\n", order);
      EXPECT_GT(order, previous_order);
      previous_order = order;
    }
    previous_error = error;
    previous_n = n;
  }
  report_residual("1 x 0.2 x 0.2 cantilever, nu 0, 12 cells thick, tip error", previous_error, 0.03);
  report_residual("observed order less 2", std::abs(previous_order - 2), 0.15);
}

/// The tip of the same bar as a chain of beams with its shear stiffness: the limit of finer tetrahedra. The elastica
/// has neither shear nor extension.
Eigen::Vector3d beam_tip(double thickness, double force) {
  const double area = thickness * thickness, inertia = area * area / 12;
  auto chain = support::BeamChain::straight(128, 1,
                                            {.axial = kBarYoung * area,
                                             .shear = 5.0 / 6.0 * 0.5 * kBarYoung * area,
                                             .bending = kBarYoung * inertia,
                                             .torsion = kBarYoung * inertia});
  Vector6d load = Vector6d::Zero();
  for (int step = 1; step <= 10; ++step) {
    load[2] = force * step / 10;
    EXPECT_LE(chain.solve(load, 1e-9), 15);
  }
  return chain.tip();
}

// A bar of 1 x 0.1 x 0.1 under a dead end load, nu = 0. Rotations of the tip up to 80 degrees.
TEST(Cantilever, ConvergesToTheElasticaWithSecondOrder) {
  struct Row {
    double load;  // P L^2 / EI
    Eigen::Vector3d elastica;
    double previous_error = 0;
  };
  Row all_rows[] = {{1, {.943567, 0, .301721}},
                    {2, {.839358, 0, .493457}},
                    {5, {.612372, 0, .713792}},
                    {10, {.445004, 0, .810609}}};
  const std::span rows(all_rows, support::kSanitized ? 1 : std::size(all_rows));
  const double thickness = 0.1, bending = kBarYoung * std::pow(thickness, 4) / 12;
  for (const int n : {2, 4}) {
    Cantilever bar(thickness, {20 * n, 2 * n, 2 * n}, 0);
    const Eigen::Vector3d centre(0, 0.5 * thickness, 0.5 * thickness);
    for (Row& row : rows) {
      // Forces left over of 1e-6 of the load move the tip by less than its sixth digit; with a sanitizer the third.
      const double tolerance = (support::kSanitized ? 1e-3 : 1e-6) * bending;
      ASSERT_LE(bar.body.relax(bar.end_load(row.load * bending), tolerance), 100);
      const Eigen::Vector3d tip = bar.end_mean(bar.body.positions) - centre;
      const double error = (tip - beam_tip(thickness, row.load * bending)).norm();
      const std::string name = "PL^2/EI " + std::to_string(static_cast<int>(row.load)) + ", ";
      std::printf("  %d cells thick, PL^2/EI %2.0f: tip (%.5f, %.5f), elastica (%.5f, %.5f), error %.4f\n", 2 * n,
                  row.load, tip.x(), tip.z(), row.elastica.x(), row.elastica.z(), error);
      if (n == 4) {
        report_residual(name + "tip off the elastica / L", (tip - row.elastica).norm(), 0.02);
        report_residual(name + "observed order less 2", std::abs(std::log2(row.previous_error / error) - 2), 0.3);
      }
      row.previous_error = error;
    }
  }
}

}  // namespace
}  // namespace stylet::physics
