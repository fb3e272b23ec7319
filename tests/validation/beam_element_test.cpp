// The corotational Timoshenko element by itself: energy, force, tangent, invariances.
#include "physics/needle/beam.h"

#include "tests/support/random.h"
#include "tests/validation/residual.h"
#include "tools/reference/dense_algebra.h"

#include <gtest/gtest.h>

#include <Eigen/Core>

#include <algorithm>
#include <cstdio>

namespace stylet::physics {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using support::Random;
using validation::report_residual;

// A stocky beam in round numbers, so that no stiffness drowns another in the comparisons.
Beam test_beam() {
  Beam beam;
  beam.length = 0.8;
  beam.rest_frame = Random(7).rotation(1.1);
  beam.section = {.axial = 3.0, .shear = 1.3, .bending = 0.2, .torsion = 0.15};
  return beam;
}

struct Ends {
  BeamEnd a, b;
};

// Beam anywhere in space with local rotations up to `bend` rad and up to 5 % of strain.
Ends deformed(const Beam& beam, Random& random, double bend) {
  const Matrix3d world = random.rotation(2.0);
  const Matrix3d node = world * beam.rest_frame.transpose();
  const Vector3d start = random.vector(1);
  return {{start, Matrix3d(world * random.rotation(bend) * world.transpose() * node)},
          {Vector3d(start + world.col(0) * beam.length * (1 + 0.05 * random.vector(1).x())),
           Matrix3d(world * random.rotation(bend) * world.transpose() * node)}};
}

Ends moved(const Ends& ends, const Vector12d& x) {
  const auto turn = [](const Vector3d& w) {
    return w.norm() == 0 ? Matrix3d(Matrix3d::Identity()) : Eigen::AngleAxisd(w.norm(), w.normalized()).matrix();
  };
  return {{ends.a.position + x.segment<3>(0), turn(x.segment<3>(3)) * ends.a.orientation},
          {ends.b.position + x.segment<3>(6), turn(x.segment<3>(9)) * ends.b.orientation}};
}

TEST(Beam, ForceIsGradientOfEnergy) {
  const Beam beam = test_beam();
  Random random(3);
  double worst = 0;
  for (double bend : {0.0, 0.002, 0.1, 0.6}) {
    for (int i = 0; i < 20; ++i) {
      const Ends ends = deformed(beam, random, bend);
      const Vector12d force = beam_response(beam, ends.a, ends.b).force;
      for (int k = 0; k < 12; ++k) {
        const double h = 1e-3;  // fourth-order differences: error ~h^4 against rounding/h
        const auto energy = [&](double s) {
          const Ends e = moved(ends, s * Vector12d::Unit(k));
          return beam_energy(beam, e.a, e.b);
        };
        const double gradient = (8 * (energy(h) - energy(-h)) - (energy(2 * h) - energy(-2 * h))) / (12 * h);
        worst = std::max(worst, std::abs(gradient - force[k]));
      }
    }
  }
  report_residual("|dU/dq - f|, forces of order 0.1", worst, 1e-8);
}

// The tangent leaves out terms of third order in the local rotations: halving them must cut the error against
// differences of the (exact) force at least sixfold.
TEST(Beam, TangentMatchesDifferencesToThirdOrder) {
  const Beam beam = test_beam();
  double previous = 0;
  for (double bend : {0.4, 0.2, 0.1, 0.05}) {
    Random random(4);
    double worst = 0;
    for (int i = 0; i < 20; ++i) {
      const Ends ends = deformed(beam, random, bend);
      const Matrix12d tangent = beam_response(beam, ends.a, ends.b).tangent;
      Matrix12d difference;
      for (int k = 0; k < 12; ++k) {
        const double h = 1e-3;
        const auto force = [&](double s) -> Vector12d {
          const Ends e = moved(ends, s * Vector12d::Unit(k));
          return beam_response(beam, e.a, e.b).force;
        };
        difference.col(k) = (8 * (force(h) - force(-h)) - (force(2 * h) - force(-2 * h))) / (12 * h);
      }
      difference = (0.5 * (difference + difference.transpose())).eval();
      worst = std::max(worst, (tangent - difference).norm() / difference.norm());
    }
    std::printf("  local rotation %.2f rad: relative tangent error %.2e\n", bend, worst);
    if (previous > 0) {
      EXPECT_LT(worst, previous / 6);
    }
    previous = worst;
  }
  report_residual("relative tangent error at 0.05 rad", previous, 1e-6);
}

TEST(Beam, TangentOfUnloadedBeamIsTheTimoshenkoMatrix) {
  Beam beam = test_beam();
  beam.rest_frame.setIdentity();
  const double l = beam.length, ei = beam.section.bending;
  const double phi = 12 * ei / (beam.section.shear * l * l);
  Matrix12d k = Matrix12d::Zero();  // textbook order u v w rx ry rz
  const double a = 12 * ei / (l * l * l * (1 + phi)), b = 6 * ei / (l * l * (1 + phi));
  const double c = (4 + phi) * ei / (l * (1 + phi)), d = (2 - phi) * ei / (l * (1 + phi));
  const double ax = beam.section.axial / l, t = beam.section.torsion / l;
  k(0, 0) = k(6, 6) = ax, k(0, 6) = -ax;
  k(3, 3) = k(9, 9) = t, k(3, 9) = -t;
  k(1, 1) = k(7, 7) = k(2, 2) = k(8, 8) = a, k(1, 7) = k(2, 8) = -a;
  k(1, 5) = k(1, 11) = b, k(2, 4) = k(2, 10) = -b;
  k(5, 7) = k(7, 11) = -b, k(4, 8) = k(8, 10) = b;
  k(4, 4) = k(5, 5) = k(10, 10) = k(11, 11) = c, k(4, 10) = k(5, 11) = d;
  k = Matrix12d(k.selfadjointView<Eigen::Upper>());
  const BeamEnd first{Vector3d::Zero(), Matrix3d::Identity()}, second{l * Vector3d::UnitX(), Matrix3d::Identity()};
  const BeamResponse response = beam_response(beam, first, second);
  report_residual("|K - textbook| / |K|", (response.tangent - k).norm() / k.norm(), 1e-14);
  report_residual("force at rest", response.force.norm(), 1e-15);
}

TEST(Beam, IsObjective) {
  const Beam beam = test_beam();
  Random random(5);
  double worst = 0;
  for (int i = 0; i < 50; ++i) {
    const Ends ends = deformed(beam, random, 0.3);
    const Matrix3d q = random.rotation(2.5);
    const Vector3d shift = random.vector(10);
    const BeamEnd a{q * ends.a.position + shift, q * ends.a.orientation};
    const BeamEnd b{q * ends.b.position + shift, q * ends.b.orientation};
    const BeamResponse here = beam_response(beam, ends.a, ends.b);
    const BeamResponse there = beam_response(beam, a, b);
    Matrix12d turn = Matrix12d::Zero();
    for (int k = 0; k < 12; k += 3) turn.block<3, 3>(k, k) = q;
    const Matrix12d turned = turn.lazyProduct(here.tangent);
    worst = std::max({worst, std::abs(beam_energy(beam, ends.a, ends.b) - beam_energy(beam, a, b)),
                      (turn * here.force - there.force).norm(),
                      (turned.lazyProduct(turn.transpose()) - there.tangent).norm()});
  }
  report_residual("change of energy, force and tangent by a rigid motion of 2.5 rad", worst, 1e-13);
}

TEST(Beam, ForcesBalanceAndTangentIsBlindToTranslation) {
  const Beam beam = test_beam();
  Random random(6);
  double worst_force = 0, worst_moment = 0, worst_tangent = 0;
  for (int i = 0; i < 50; ++i) {
    const Ends ends = deformed(beam, random, 0.3);
    const BeamResponse r = beam_response(beam, ends.a, ends.b);
    const Vector3d force = r.force.segment<3>(0) + r.force.segment<3>(6);
    const Vector3d arm = ends.b.position - ends.a.position;
    const Vector3d moment = r.force.segment<3>(3) + r.force.segment<3>(9) + arm.cross(r.force.segment<3>(6));
    worst_force = std::max(worst_force, force.norm());
    worst_moment = std::max(worst_moment, moment.norm());
    worst_tangent = std::max({worst_tangent, (r.tangent - r.tangent.transpose()).norm(),
                              (r.tangent.middleCols<3>(0) + r.tangent.middleCols<3>(6)).norm()});
  }
  report_residual("sum of forces", worst_force, 1e-15);
  report_residual("sum of moments", worst_moment, 1e-14);
  report_residual("asymmetry of the tangent, and its answer to a translation", worst_tangent, 1e-14);
}

TEST(Beam, MaterialTangentIsPositiveSemiDefiniteUnderAnyLoad) {
  const Beam beam = test_beam();
  Random random(8);
  double worst = 0;
  for (int i = 0; i < 50; ++i) {
    Ends ends = deformed(beam, random, 0.8);
    ends.b.position = ends.a.position + 0.4 * (ends.b.position - ends.a.position);  // crushed to 40 %
    const Matrix12d k = beam_response(beam, ends.a, ends.b, Tangent::material).tangent;
    const Eigen::VectorXd eigenvalues = reference::symmetric_eigenvalues(k);
    worst = std::max(worst, -eigenvalues[0] / eigenvalues[11]);
  }
  report_residual("most negative eigenvalue over the largest", worst, 1e-13);
}

}  // namespace
}  // namespace stylet::physics
