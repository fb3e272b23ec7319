#include "tests/validation/strained_body.h"

#include "tests/validation/residual.h"
#include "tools/reference/kuhn_box.h"

#include <gtest/gtest.h>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>
#include <utility>

namespace stylet::validation {

void shake(Eigen::Matrix3Xd& positions, double amount, unsigned seed) {
  std::mt19937 random(seed);
  for (Eigen::Index i = 0; i < positions.size(); ++i) {
    positions.data()[i] +=
        amount * (2 * static_cast<double>(random()) / static_cast<double>(std::mt19937::max()) - 1);
  }
}

Eigen::Matrix3d law_rotation() {
  return Eigen::AngleAxisd(2.2, Eigen::Vector3d(0.3, -0.8, 0.52).normalized()).toRotationMatrix();
}

void strain(StaticBody& body) {
  const Eigen::Matrix3Xd rest = body.positions;
  shake(body.positions, 0.08, 3);
  body.fade(1);
  body.positions = law_rotation() * rest;
  shake(body.positions, 0.08, 5);
  EXPECT_GT(body.memory[0].alpha[0][5].abs().maxCoeff(), 0.01);
}

double pull_on_top(StaticBody& body) {
  const Eigen::Matrix3Xd forces = body.forces();
  double sum = 0;
  for (int n = 0; n < body.model().node_count(); ++n) {
    if (body.model().mesh.nodes[n].z() > 1 - 1e-9) sum += forces(2, n);
  }
  return sum;
}

void expect_prony(StaticBody& body) {
  const double at_once = pull_on_top(body);
  double worst = 0;
  const double dt = 0.02;
  for (int step = 1; step <= 500; ++step) {
    body.fade(dt);
    const double t = step * dt;
    const double theory = 0.55 + 0.2 * std::exp(-t / 0.3) + 0.25 * std::exp(-t / 4);
    worst = std::max(worst, std::abs(pull_on_top(body) / at_once - theory));
  }
  report_residual("off g_inf + sum g_i exp(-t/tau_i)", worst, 1e-12);
  std::printf("  after 10 s it has lost %.1f %%\n", 100 * (1 - pull_on_top(body) / at_once));
}

void expect_no_energy_from_closed_paths(const physics::TissueModel& model) {
  for (const unsigned seed : {1U, 2U, 3U}) {
    StaticBody body(model);
    const Eigen::Matrix3Xd rest = body.positions;
    std::mt19937 random(seed);
    double work = 0;
    double taken = 0;
    for (int step = 0; step < 40; ++step) {
      Eigen::Matrix3Xd next = rest;
      if (step < 39) shake(next, 0.05, static_cast<unsigned>(random()));
      const Eigen::Matrix3Xd before = body.positions;
      // Gauss on four parts of the way: the work of a stress that is as good as a polynomial of the sixth degree.
      for (int part = 0; part < 4; ++part) {
        for (const auto& [at, weight] : {std::pair{0.11270166537925831, 5.0 / 18}, std::pair{0.5, 8.0 / 18},
                                         std::pair{0.8872983346207417, 5.0 / 18}}) {
          body.positions = before + 0.25 * (part + at) * (next - before);
          work += 0.25 * weight * body.forces().cwiseProduct(next - before).sum();
        }
      }
      body.positions = next;
      const double loaded = body.energy();
      EXPECT_GE(loaded, 0) << step;
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

void expect_positive_stiffness(StaticBody& body) {
  strain(body);
  body.positions.row(0) *= 0.8;
  const Eigen::MatrixXd k = body.dense_stiffness();
  const Eigen::VectorXd values =
      Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(k, Eigen::EigenvaluesOnly).eigenvalues();
  std::printf("  least: %.2e %.2e ... %.2e %.2e, largest %.2e N/m\n", values[0], values[1], values[5], values[6],
              values[values.size() - 1]);
  EXPECT_GT(values[0], -1e-12 * values[values.size() - 1]);
  EXPECT_GT(values[6], 1e-3 * values[values.size() / 2]);
}

void expect_factor_as_stiff_as_pulled(StaticBody& body) {
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

}  // namespace stylet::validation
