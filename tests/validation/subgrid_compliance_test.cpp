// Sub-grid compliance: what a needle tied to coarse tetrahedra at points feels, against a needle resolved down to its
// radius by quadratic hexahedra, and against Kelvin and Boussinesq.
#include "physics/contact/subgrid_compliance.h"
#include "tests/support/sanitized.h"
#include "tests/validation/residual.h"
#include "tools/reference/resolved_needle.h"
#include "tools/reference/tied_needle.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace stylet::validation {
namespace {

using physics::SubgridSite;
using reference::MeshedCube;
using reference::NeedleMotion;
using reference::ResolvedCube;
using reference::Subgrid;
using reference::Support;
using reference::TiedNeedle;
using std::numbers::pi;
using support::kSanitized;

constexpr double kY = 0.05, kZ = 0.05;  // the needle, m
const std::vector<int> kMeshes = kSanitized ? std::vector{7, 10} : std::vector{7, 10, 12, 14, 17};
// Of the resolved needle, in the tissue along all of it.
constexpr reference::Resolution kShaft = kSanitized ? reference::Resolution{4, 8, 3} : reference::Resolution{8, 8, 6};
constexpr reference::Resolution kFineShaft =
    kSanitized ? reference::Resolution{4, 16, 3} : reference::Resolution{8, 16, 6};

/// Stiffness of the resolved needle's flat end. The error of its singular edge goes with the element: extrapolated.
double resolved_end_stiffness(NeedleMotion motion) {
  const double coarse = reference::resolved_stiffness(
      {}, motion, kSanitized ? reference::Resolution{4, 8, 3} : reference::Resolution{6, 8, 5});
  const double fine = reference::resolved_stiffness(
      {}, motion, kSanitized ? reference::Resolution{8, 8, 6} : reference::Resolution{12, 8, 10});
  return 2 * fine - coarse;
}

double spread(const std::vector<double>& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  double mean = 0;
  for (const double v : values) mean += v / static_cast<double>(values.size());
  return (*high - *low) / mean;
}

SubgridSite site_of(double size, double young, double nu) {
  return {.tet_volume = size * size * size / 6, .material = {.young_modulus = young, .poisson_ratio = nu}};
}

/// A quantity on every mesh, without and with sub-grid compliance.
template <typename Measure>
std::array<std::vector<double>, 2> over_meshes(const Measure& measure) {
  std::array<std::vector<double>, 2> values;
  for (const int nodes : kMeshes) {
    MeshedCube mesh({}, reference::lattice_of_r1(nodes));
    for (const Subgrid s : {Subgrid::off, Subgrid::on})
      values[static_cast<std::size_t>(s)].push_back(measure(mesh, s));
  }
  return values;
}

TEST(ResolvedNeedle, ThickerNeedlesFollowKelvinsLogarithm) {
  // Far from its ends a cylinder's stiffness depends on its radius as Kelvin's line load does, whatever is around it.
  // Radii 20 and 40 times smaller than the cube; the free ends, r long, are left out of account: 5 %.
  const double e = 10e3, nu = 0.3;
  ResolvedCube thin{.material = {.young_modulus = e, .poisson_ratio = nu}, .support = Support::walls};
  ResolvedCube thick = thin;
  thick.needle_radius = 2 * thin.needle_radius;
  const auto compliance = [](const ResolvedCube& cube, NeedleMotion motion) {
    return cube.edge / reference::resolved_stiffness(cube, motion, kShaft);
  };
  const double lateral = compliance(thin, NeedleMotion::lateral) - compliance(thick, NeedleMotion::lateral);
  const double kelvin = (1 + nu) * (3 - 4 * nu) / (4 * pi * e * (1 - nu)) * std::log(2);
  report_residual("lateral, off Kelvin's", std::abs(lateral / kelvin - 1), 0.05);
  const double axial = compliance(thin, NeedleMotion::axial) - compliance(thick, NeedleMotion::axial);
  const double shear = (1 + nu) / (pi * e) * std::log(2);
  report_residual("axial, off antiplane shear", std::abs(axial / shear - 1), 0.05);
}

TEST(ResolvedNeedle, RefiningChangesLittle) {
  for (const NeedleMotion motion : {NeedleMotion::lateral, NeedleMotion::axial}) {
    const double coarse = reference::resolved_stiffness({}, motion, kShaft);
    const double fine = reference::resolved_stiffness({}, motion, kFineShaft);
    EXPECT_LT(fine, coarse);  // a displacement method is too stiff
    report_residual("change by twice the sectors", coarse / fine - 1, 0.02);
  }
}

TEST(ResolvedNeedle, PunchMatchesBoussinesq) {
  // Extrapolated to 2 %, but from coarse meshes to 8 %, no better than the finer of them by itself. The cube is 80
  // times the punch and held at one side: another 2 % softer than a half-space.
  const ResolvedCube cube;
  const double punch = kSanitized ? reference::resolved_stiffness(cube, NeedleMotion::indentation, {8, 8, 6})
                                  : resolved_end_stiffness(NeedleMotion::indentation);
  const double nu = cube.material.poisson_ratio;
  const double half_space = 2 * cube.material.young_modulus * cube.needle_radius / (1 - nu * nu);
  report_residual("punch, off the half-space", std::abs(punch / half_space - 1), 0.05);
}

TEST(SubgridCompliance, RadiusEntersAsKelvinsLogarithm) {
  const double e = 7e3, nu = 0.4, length = 4e-3;
  const SubgridSite site = site_of(12e-3, e, nu);
  const auto thin = physics::shaft_compliance(site, 0.4e-3, length);
  const auto thick = physics::shaft_compliance(site, 0.8e-3, length);
  const double kelvin = (1 + nu) * (3 - 4 * nu) / (4 * pi * e * (1 - nu)) * std::log(2) / length;
  report_residual("lateral, off Kelvin's", std::abs((thin.lateral - thick.lateral) / kelvin - 1), 1e-12);
  const double shear = (1 + nu) / (pi * e) * std::log(2) / length;
  report_residual("axial, off antiplane shear", std::abs((thin.axial - thick.axial) / shear - 1), 1e-12);
}

TEST(SubgridCompliance, ScalesAsElasticityDoes) {
  // Twice the modulus, half the compliance; everything twice as large, half the compliance.
  const auto base = physics::shaft_compliance(site_of(10e-3, 10e3, 0.45), 0.6e-3, 5e-3);
  const auto stiff = physics::shaft_compliance(site_of(10e-3, 20e3, 0.45), 0.6e-3, 5e-3);
  const auto large = physics::shaft_compliance(site_of(20e-3, 10e3, 0.45), 1.2e-3, 10e-3);
  double worst = 0;
  const auto compare = [&](double half, double whole) { worst = std::max(worst, std::abs(2 * half / whole - 1)); };
  for (const auto& half : {stiff, large}) {
    compare(half.lateral, base.lateral);
    compare(half.axial, base.axial);
  }
  report_residual("shaft, off the half", worst, 1e-12);
  worst = 0;
  for (const auto& tip : {physics::surface_tip_compliance, physics::channel_tip_compliance}) {
    const double whole = tip(site_of(10e-3, 10e3, 0.45), 0.6e-3);
    compare(tip(site_of(10e-3, 20e3, 0.45), 0.6e-3), whole);
    compare(tip(site_of(20e-3, 10e3, 0.45), 1.2e-3), whole);
  }
  report_residual("tip, off the half", worst, 1e-12);
}

TEST(SubgridCompliance, StaysPositiveWhateverTheMesh) {
  double least = 1e300;  // m/N
  for (const double size : {1e-5, 1e-3, 1e-1}) {
    for (const double nu : {0.0, 0.3, 0.499}) {
      for (const double length : {1e-5, 1e-2, 1.0}) {
        for (const Eigen::Vector4d& weights :
             {Eigen::Vector4d(1, 0, 0, 0), Eigen::Vector4d(0.25, 0.25, 0.25, 0.25)}) {
          SubgridSite site = site_of(size, 10e3, nu);
          site.barycentric = weights;
          const auto shaft = physics::shaft_compliance(site, 0.6e-3, length);
          for (const double c : {shaft.lateral, shaft.axial, physics::surface_tip_compliance(site, 0.6e-3),
                                 physics::channel_tip_compliance(site, 0.6e-3)}) {
            EXPECT_TRUE(std::isfinite(c) && c > 0) << size << " " << nu << " " << length;
            least = std::min(least, c);
          }
        }
      }
    }
  }
  report_residual("below zero, least of all, m/N", -least, 0);
}

TEST(SubgridCompliance, NearFieldIsTheSameInEveryMesh) {
  // With its walls held a coarse cube has hardly any far field to get wrong. Lines where the mesh is softest (along
  // nodes), stiffest (through the middles of cells), and through a mesh without order. What is left, 7 %, is a tenth
  // of the logarithm: the constants know the weights of a point but not which way the diagonals run.
  const ResolvedCube cube{.support = Support::walls};
  for (const NeedleMotion motion : {NeedleMotion::lateral, NeedleMotion::axial}) {
    const double truth = reference::resolved_stiffness(cube, motion, kFineShaft);
    double worst = 0, without = 0;
    for (const int nodes : kMeshes) {
      for (const reference::Lattice& lattice :
           {reference::Lattice{.nodes_per_edge = nodes, .offset = {0, 0}},
            reference::Lattice{.nodes_per_edge = nodes, .offset = {0.5, 0.5}},
            reference::Lattice{nodes, {0.25, 0.25}}, reference::Lattice{.nodes_per_edge = nodes, .jitter = 0.25}}) {
        MeshedCube mesh(cube, lattice);
        const TiedNeedle needle = reference::tie_needle(mesh, 0.05 + 1e-7, 0.05 + 2e-7, 0.1, 40);
        const double error = reference::rigid_answer(mesh, needle, motion, Subgrid::on).stiffness / truth - 1;
        worst = std::max(worst, std::abs(error));
        without =
            std::max(without, reference::rigid_answer(mesh, needle, motion, Subgrid::off).stiffness / truth - 1);
      }
    }
    report_residual(motion == NeedleMotion::axial ? "axial, worst error" : "lateral, worst error", worst, 0.10);
    EXPECT_GT(without, 1) << "single points would be good enough";
  }
}

TEST(SubgridCompliance, RigidNeedleFeelsTheSameInEveryMesh) {
  for (const NeedleMotion motion : {NeedleMotion::lateral, NeedleMotion::axial}) {
    const auto [without, with] = over_meshes([&](MeshedCube& mesh, Subgrid subgrid) {
      return reference::rigid_answer(mesh, reference::tie_needle(mesh, kY, kZ, 0.1, 10), motion, subgrid).stiffness;
    });
    // Nothing holds this needle but the cube, whose far field is a few per cent too stiff where it is six cells wide.
    report_residual("mesh spread", spread(with), 0.045);
    EXPECT_GT(spread(without), 2 * spread(with));
    const double truth = reference::resolved_stiffness({}, motion, kFineShaft);
    for (const double k : with) report_residual("error against the resolved needle", std::abs(k / truth - 1), 0.055);
  }
}

TEST(SubgridCompliance, FlexibleNeedleFeelsTheSameInEveryMesh) {
  const auto [without, with] = over_meshes([](MeshedCube& mesh, Subgrid subgrid) {
    return reference::flexible_answer(mesh, reference::tie_needle(mesh, kY, kZ, 0.09, 9), 0.09, {}, subgrid)
        .stiffness;
  });
  report_residual("mesh spread", spread(with), 0.03);
  EXPECT_GT(spread(without), 3 * spread(with));
}

TEST(SubgridCompliance, DenseContactsNeitherStiffenNorDegenerate) {
  for (const int nodes : {kMeshes.front(), kMeshes.back()}) {
    MeshedCube mesh({}, reference::lattice_of_r1(nodes));
    std::vector<double> stiffness;
    for (const int count : {10, 20, 40, 80}) {
      const TiedNeedle needle = reference::tie_needle(mesh, kY, kZ, 0.1, count);
      const auto answer = reference::rigid_answer(mesh, needle, NeedleMotion::lateral, Subgrid::on);
      stiffness.push_back(answer.stiffness);
      report_residual("condition of W", answer.condition, 1e3);
      if (count == 80) {
        EXPECT_GT(reference::rigid_answer(mesh, needle, NeedleMotion::lateral, Subgrid::off).condition, 1e6);
      }
    }
    report_residual("spread over spacings of 10 to 1.25 mm", spread(stiffness), 0.03);
  }
}

TEST(SubgridCompliance, TipIndentsTheSameInEveryMesh) {
  for (const NeedleMotion motion : {NeedleMotion::indentation, NeedleMotion::tip}) {
    const Eigen::Vector3d tip(motion == NeedleMotion::tip ? 0.05 : 0, kY, kZ);
    const auto [without, with] = over_meshes(
        [&](MeshedCube& mesh, Subgrid subgrid) { return reference::tip_answer(mesh, tip, motion, subgrid); });
    report_residual("mesh spread of the depth", spread(with), 0.05);
    const double truth = resolved_end_stiffness(motion);
    for (const double depth : with) report_residual("depth, off the resolved tip", std::abs(depth * truth - 1), 0.10);
    EXPECT_LT(*std::max_element(without.begin(), without.end()) * truth, 0.5);  // single points: less than half
  }
}

}  // namespace
}  // namespace stylet::validation
