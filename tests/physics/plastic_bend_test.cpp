// A needle that is bent beyond its strength: when it yields, what stays, and what that takes.
#include "physics/needle/plastic_bend.h"
#include "physics/needle/needle.h"
#include "tests/physics/needle_track_runs.h"
#include "tools/reference/dense_algebra.h"
#include "tools/reference/led_needle.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <vector>

namespace stylet::physics {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kYoung = 200e9, kYield = 1e9, kOuter = 1.27e-3, kInner = 0.838e-3;

/// The oracle: a tube of elastic, ideally plastic fibres under a curvature.
struct FibreTube {
  double outer = kOuter, inner = kInner, young = kYoung;
  double moment(double curvature) const {
    constexpr int kSlices = 4000;
    const double ro = outer / 2, ri = inner / 2;
    double sum = 0;
    for (int i = 0; i < kSlices; ++i) {
      const double y = ro * (-1 + (2 * i + 1.0) / kSlices);
      const double width = 2 * (std::sqrt(ro * ro - y * y) - std::sqrt(std::max(0.0, ri * ri - y * y)));
      sum += std::clamp(young * curvature * y, -kYield, kYield) * y * width * 2 * ro / kSlices;
    }
    return sum;
  }
  double stiffness() const { return moment(1e-3) / 1e-3; }
  double first_yield() const { return moment(kYield / (young * outer / 2)); }
  /// Curvature that carries a moment, by bisection.
  double curvature(double carried) const {
    double low = 0, high = 1e3;
    for (int i = 0; i < 60; ++i) (moment(0.5 * (low + high)) < carried ? low : high) = 0.5 * (low + high);
    return low;
  }
};

NeedleProperties steel(int beams = 8) {
  NeedleProperties needle;
  needle.beams = beams;
  needle.yield_strength = kYield;
  return needle;
}

/// A needle clamped at its hub, loaded at its tip: a Newton step a call.
struct Clamped {
  explicit Clamped(const NeedleProperties& properties)
      : needle(properties, {}),
        shape(straight_needle(properties, hub)),
        load(VectorXd::Zero(6 * needle.node_count())),
        motion(load) {}
  void step() {
    ASSERT_TRUE(needle.linearise(shape, hub, 1e-3));
    needle.solve(load, motion);
    move(shape, motion);
  }
  /// Brings the load to a value in steps, then lets it settle.
  void bring(double force, double moment, int steps) {
    const VectorXd from = load;
    VectorXd to = VectorXd::Zero(load.size());
    to[load.size() - 6] = force;   // x
    to[load.size() - 2] = moment;  // about y
    for (int i = 1; i <= steps; ++i) {
      const VectorXd before = load;
      load = from + (to - from) * i / steps;
      const int last = shape.node_count - 1;
      step();
      const VectorXd mean = 0.5 * (before + load);
      work += mean.segment<6>(6 * last).dot(motion.segment<6>(6 * last));
    }
    for (int i = 0; i < 500; ++i) {
      step();
      work += load.tail<6>().dot(motion.tail<6>());
    }
  }
  StylusPose hub;
  Needle needle;
  NeedleShape shape;
  VectorXd load, motion;
  double work = 0;
};

TEST(PlasticBend, AnEighteenGaugeNeedleYieldsWhereItsOutermostFibreDoes) {
  const BendingStrength strength = tube_strength(kOuter, kInner, kYoung, kYield);
  const FibreTube tube;
  std::printf("M_y %.4f N m (fibres %.4f), M_p %.4f (fibres %.4f)\n", strength.first, tube.first_yield(),
              strength.full, tube.moment(1e4));
  EXPECT_NEAR(strength.first, tube.first_yield(), 1e-4 * strength.first);
  EXPECT_NEAR(strength.full, tube.moment(1e4), 1e-4 * strength.full);
  EXPECT_NEAR(strength.first, 0.16, 0.01);
  for (const double part : {0.99, 1.01}) {
    Clamped c(steel());
    c.bring(0, part * strength.first, 20);
    EXPECT_EQ(c.needle.bend() > 0, part > 1) << part;
  }
}

// A pure moment bends every beam alike, and the rotation of the tip is the curvature times the length.
TEST(PlasticBend, FollowsTheFibresOfATubeUpAndSpringsBackByTheElasticCurvature) {
  const FibreTube tube;
  double worst = 0, worst_back = 0;
  for (const double part : {0.5, 0.9, 1.05, 1.15, 1.25, 1.35, 1.42}) {
    Clamped c(steel());
    const double m = part * tube.first_yield();
    c.bring(0, m, 100);
    const auto turned = [&] { return 2 * std::acos(std::min(1.0, std::abs(c.shape.orientation(8).w()))); };
    const double curvature = turned() / 0.15;
    // The moment that fibres bent so carry is what the needle carries.
    worst = std::max(worst, std::abs(tube.moment(curvature) - m));
    c.bring(0, 0, 100);
    const double stays = turned() / 0.15;
    worst_back = std::max(worst_back, std::abs(curvature - stays - m / tube.stiffness()));
    EXPECT_NEAR(c.needle.bend(), stays * 0.15, 1e-9);
    if (part < 1) {
      EXPECT_LT(stays, 1e-9);
    }
  }
  std::printf("moment off the fibres' by at most %.2f %% of M_y, springback by %.1e 1/m\n",
              100 * worst / tube.first_yield(), worst_back);
  EXPECT_LT(worst, 0.015 * tube.first_yield());  // what the hyperbola is off
  EXPECT_LT(worst_back, 2e-3);                   // of 10 1/m: shear and rounding of the slices
}

/// Deflection of the tip that stays after a tip force, from the curvature that stays along the needle.
template <typename Stays>
double stays_after(double force, double length, const Stays& stays) {
  constexpr int kParts = 400;
  double sum = 0;
  for (int i = 0; i < kParts; ++i) {
    const double arm = length * (i + 0.5) / kParts;  // from the tip
    sum += stays(force * arm) * arm * length / kParts;
  }
  return sum;
}

TEST(PlasticBend, ACantileverKeepsTheDeflectionOfItsResidualCurvatureTheBetterTheMoreBeams) {
  const FibreTube tube{.young = 10 * kYoung};  // so stiff that it takes nothing off the arm of the force
  const double first = tube.first_yield(), full = tube.moment(1e4);
  NeedleProperties needle = steel();
  needle.young_modulus = tube.young;
  needle.length = 0.04;
  const double force = 1.35 * first / needle.length;
  const double fibres = stays_after(
      force, needle.length, [&](double m) { return m > first ? tube.curvature(m) - m / tube.stiffness() : 0.0; });
  const double exact = stays_after(force, needle.length, [&](double m) {  // README eq. 37
    const double x = std::max(0.0, (m - first) / (full - first));
    return 0.16 * first / tube.stiffness() * x * x / (1 - x);
  });
  double last = 0;
  for (const int beams : {4, 8, 16, 32}) {
    needle.beams = beams;
    Clamped c(needle);
    c.bring(force, 0, 200);
    c.bring(0, 0, 100);
    const double error = std::abs(c.shape.positions(0, beams) / exact - 1);
    std::printf("%2d beams: %.4f mm stay of %.4f, %.1f %% off; %.4f by fibres\n", beams,
                1e3 * c.shape.positions(0, beams), 1e3 * exact, 100 * error, 1e3 * fibres);
    if (last > 0) {
      EXPECT_LT(error, 0.5 * last);
    }
    last = error;
  }
  EXPECT_LT(last, 0.05);
  EXPECT_NEAR(exact, fibres, 0.15 * fibres);
}

TEST(PlasticBend, WorkOfACycleIsWhatWentIntoTheSteelAndNeverNegative) {
  Clamped c(steel());
  const double m = tube_strength(kOuter, kInner, kYoung, kYield).first;
  double before = 0;
  for (const double part : {1.3, 0.0, -1.4, 0.0, 1.45, -0.5, 0.0}) {
    c.bring(0, part * m, 1500);
    EXPECT_GE(c.needle.bend_work(), before);
    EXPECT_GE(c.work - c.needle.energy(c.shape), -1e-9) << part;
    before = c.needle.bend_work();
  }
  std::printf("work of the load %.6f J, in the steel %.6f J\n", c.work, c.needle.bend_work());
  EXPECT_GT(c.work, 0);
  EXPECT_NEAR(c.work, c.needle.bend_work(), 0.01 * c.work);  // trapezoids of 1500 steps
}

TEST(PlasticBend, ReturnsBothEndsToTheirStrengthWhateverTheRotations) {
  const BendingStrength strength = tube_strength(kOuter, kInner, kYoung, kYield);
  std::srand(5);
  double worst = 0;
  int both = 0;
  for (int trial = 0; trial < 500; ++trial) {
    PlasticBend bend;
    const double length = 0.01, near = 4 * 0.0207 / length, far = near / 2;
    for (int load = 0; load < 3; ++load) {
      const std::array<Vector2d, 2> turned{0.1 * Vector2d::Random(), 0.1 * Vector2d::Random()};
      const double work = bend.work;
      flow(strength, turned, near, far, length, bend);
      EXPECT_GE(bend.work, work);
      both += bend.yields[0] && bend.yields[1];
      for (std::size_t end = 0; end < 2; ++end) {
        const Vector2d m = near * (turned[end] - bend.turn[end]) + far * (turned[1 - end] - bend.turn[1 - end]);
        const double p = bend.path[end] / (length / 2);
        double x = 0, high = 1;  // by bisection of p(x)
        for (int i = 0; i < 60; ++i) {
          const double mid = 0.5 * (x + high);
          (strength.curvature * mid * mid / (1 - mid) < p ? x : high) = mid;
        }
        const double most = strength.first + (strength.full - strength.first) * x;
        worst = std::max(worst, (bend.yields[end] ? std::abs(m.norm() - most) : m.norm() - most) / most);
      }
      if (!bend.yielding()) continue;
      // What a step is linearised with: between K and half of it, so that none overshoots.
      Eigen::Matrix4d whole = near * Eigen::Matrix4d::Identity();
      whole.topRightCorner<2, 2>().diagonal().setConstant(far);
      whole.bottomLeftCorner<2, 2>().diagonal().setConstant(far);
      const Eigen::Matrix4d k = yielding_stiffness(bend, near, far);
      EXPECT_LT((k - k.transpose()).norm(), 1e-12 * near);
      EXPECT_GT(reference::symmetric_eigenvalues(whole - k).minCoeff(), -1e-12 * near);
      EXPECT_GT(reference::symmetric_eigenvalues(k - 0.5 * whole).minCoeff(), -1e-12 * near);
    }
  }
  EXPECT_GT(both, 300);
  EXPECT_LT(worst, 1e-10);
}

TEST(PlasticBend, ANeedleBelowItsStrengthIsTheElasticOneToTheBit) {
  NeedleProperties elastic = steel();
  elastic.yield_strength = 0;
  Clamped a(elastic), b(steel());
  for (Clamped* c : {&a, &b}) c->bring(0.5, 0.05, 50);
  EXPECT_EQ((a.shape.nodes() - b.shape.nodes()).norm(), 0);
  EXPECT_EQ(b.needle.bend(), 0);
}

}  // namespace
}  // namespace stylet::physics

namespace stylet::bench {
namespace {

// Its tip in the cube, its hub dragged aside and back, then out: what was bent is bent in the air, too.
TEST(PlasticBend, ANeedleDraggedAsideComesOutBent) {
  for (const double yield : {0.0, 1e9}) {
    reference::ReferenceInsertion insertion = r1();
    insertion.needle.yield_strength = yield;
    reference::LedNeedle led(insertion, {.coupling = physics::Coupling::stylet, .tissues = tissue(liver())});
    double held = 0, hand = 0;
    led.lead({.along = 0.09}, 0.8);
    led.lead({.along = 0.09, .aside = 0.06}, 0.8, [&](const physics::NeedleState& s) {
      held = std::max(held, s.wrench.moment.norm());
      hand = std::max(hand, s.wrench.force.norm());
    });
    led.lead({.along = 0.09}, 0.8);
    led.lead({.along = -0.02}, 0.8);
    led.lead({.along = -0.02}, 0.1);
    const physics::NeedleState& s = led.needle();
    EXPECT_EQ(s.tip, physics::TipState::outside);
    const double off = (s.positions.col(s.node_count - 1) - s.positions.col(0)).tail<2>().norm();
    std::printf(
        "yield strength %.1e: at most %.3f N m and %.2f N; out: bent by %.1f deg, tip %.2f mm off, %.4f J, flags "
        "%u\n",
        yield, held, hand, s.damage.bend * 180 / std::numbers::pi, 1e3 * off, s.damage.bend_work, led.flags());
    EXPECT_LT(s.wrench.force.norm(), 1e-6);
    EXPECT_GE(s.hand_work, 0);
    if (yield == 0) {
      EXPECT_EQ(s.damage.bend, 0);
      EXPECT_LT(off, 1e-6);
      EXPECT_GT(held, 0.28);
    } else {
      EXPECT_GT(s.damage.bend, 0.05);
      EXPECT_GT(off, 2e-3);
      EXPECT_GE(s.hand_work, s.damage.bend_work);
      EXPECT_LT(held, 0.243);  // M_p
    }
  }
}

}  // namespace
}  // namespace stylet::bench
