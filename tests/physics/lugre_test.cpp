// LuGre rows in the contact solver: one contact against the model's differential equation, the Stribeck curve,
// energy.
#include "physics/contact/lugre.h"
#include "physics/contact/bounded_solver.h"
#include "physics/messages/messages.h"
#include "tests/support/sanitized.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>
#include <random>
#include <vector>

namespace stylet::physics {
namespace {

constexpr double kLength = 0.01;      // m of shaft
constexpr double kFriction = 0.18;    // N
constexpr double kViscosity = 0.5;    // N s/m
constexpr double kCompliance = 2e-3;  // m/N, between the hand and the contact

/// A contact of its own, dragged by the hand at x through kCompliance. The needle's material is at `slid`.
class DraggedContact {
public:
  DraggedContact(const LugreConstants& constants, double dt) : constants_(constants), dt_(dt), solver_(kMaxRows) {}

  /// @return force on the hand: positive resists a motion along +x
  double move_to(double x) {
    const LugreRow row(constants_, kFriction, kViscosity, kLength, bristles_, dt_);
    const ContactRow law = bilateral_row(1, row.compliance);
    const Eigen::MatrixXd w = Eigen::MatrixXd::Constant(1, 1, kCompliance);
    const Eigen::VectorXd delta = Eigen::VectorXd::Constant(1, x - slid_ + row.offset);
    Eigen::VectorXd lambda = Eigen::VectorXd::Zero(1);
    EXPECT_TRUE(solver_.solve({&law, 1}, w, delta, lambda).solved);
    slid_ += row.advance(lambda[0], dt_, bristles_);
    return -lambda[0];
  }
  const Bristles& bristles() const { return bristles_; }

private:
  LugreConstants constants_;
  double dt_;
  BoundedSolver solver_;
  Bristles bristles_;
  double slid_ = 0;
};

double stribeck(const LugreConstants& c, double v) {
  return kFriction * (1 + (c.stiction - 1) * std::exp(-(v / c.stribeck_velocity) * (v / c.stribeck_velocity)));
}

/// The same by the equations of 1995: z by the mid-point rule in small steps, the velocity that balances the hand's
/// spring by bisection. Forces at every millisecond.
std::vector<double> integrated(const LugreConstants& c, const std::function<double(double)>& hand, int milliseconds) {
  constexpr int kSteps = 400;  // a millisecond
  constexpr double kStep = 1e-3 / kSteps;
  const double s0 = c.stiffness * kLength, s1 = c.damping * kLength;
  const auto z_rate = [&](double v, double z) { return v - s0 * std::abs(v) / stribeck(c, v) * z; };
  const auto friction = [&](double v, double z) { return s0 * z + s1 * z_rate(v, z) + kViscosity * v; };
  const auto velocity = [&](double z, double drive) {
    double low = -1, high = 1;
    for (int i = 0; i < 50; ++i) {
      const double v = 0.5 * (low + high);
      (friction(v, z) < drive ? low : high) = v;
    }
    return 0.5 * (low + high);
  };
  std::vector<double> forces;
  double z = 0, slid = 0;
  for (int ms = 1; ms <= milliseconds; ++ms) {
    for (int i = 0; i < kSteps; ++i) {
      const double t = 1e-3 * (ms - 1) + kStep * i;
      const double v = velocity(z, (hand(t) - slid) / kCompliance);
      const double half_z = z + 0.5 * kStep * z_rate(v, z);
      const double half_v = velocity(half_z, (hand(t + 0.5 * kStep) - slid - 0.5 * kStep * v) / kCompliance);
      z += kStep * z_rate(half_v, half_z);
      slid += kStep * half_v;
    }
    forces.push_back((hand(1e-3 * ms) - slid) / kCompliance);
  }
  return forces;
}

TEST(Lugre, OneContactConvergesToTheIntegratedEquations) {
  const LugreConstants constants;
  const auto hand = [](double t) {
    return 4e-3 * (1 - std::cos(2 * std::numbers::pi * 2 * t));
  };  // 50 mm/s, reverses
  constexpr int kMilliseconds = support::kSanitized ? 150 : 600;
  const std::vector<double> exact = integrated(constants, hand, kMilliseconds);
  const double peak = std::abs(*std::max_element(exact.begin(), exact.end()));
  double last = 0;
  for (const int per_ms : {1, 2, 4, 8}) {
    DraggedContact contact(constants, 1e-3 / per_ms);
    double worst = 0;
    for (int i = 1; i <= kMilliseconds * per_ms; ++i) {
      const double force = contact.move_to(hand(1e-3 / per_ms * i));
      if (i % per_ms == 0) {
        worst = std::max(worst, std::abs(force - exact[static_cast<std::size_t>(i / per_ms) - 1]));
      }
    }
    std::printf("%d kHz: off by %.2f %% of the peak of %.3f N\n", per_ms, 100 * worst / peak, peak);
    if (last > 0) {
      EXPECT_NEAR(last / worst, 2, 0.5) << "first order";
    }
    last = worst;
  }
  EXPECT_LT(last, 0.02 * peak);
}

TEST(Lugre, SteadySlidingIsTheStribeckCurve) {
  const LugreConstants constants;
  for (const double v : {1e-4, 1e-3, 2e-3, 5e-3, 0.05, -0.05}) {
    DraggedContact contact(constants, 1e-3);
    double force = 0;
    const int steps = static_cast<int>(0.02 / std::abs(v) / 1e-3) + 200;
    for (int i = 1; i <= steps; ++i) force = contact.move_to(1e-3 * v * i);
    EXPECT_NEAR(force, std::copysign(stribeck(constants, v), v) + kViscosity * v, 1e-9) << v << " m/s";
  }
}

TEST(Lugre, BeforeItSlidesItIsASpringThatSpringsBack) {
  const LugreConstants constants;
  DraggedContact contact(constants, 1e-3);
  const double x = 1e-5;
  double force = 0;
  for (int i = 0; i < 2000; ++i) force = contact.move_to(x * std::min(1.0, i / 1000.0));
  const double spring = x / (kCompliance + 1 / (constants.stiffness * kLength));
  EXPECT_NEAR(force, spring, 0.02 * spring);
  for (int i = 0; i < 2000; ++i) force = contact.move_to(x * std::max(0.0, 1 - i / 1000.0));
  EXPECT_NEAR(force, 0, 0.02 * spring);
}

// At any step time, damping and motion: what the hand gives is never less than what bristles and spring hold.
TEST(Lugre, NoMotionGivesEnergy) {
  std::mt19937 engine(3);
  std::uniform_real_distribution<double> u(0, 1);
  double least = 1;
  for (int trial = 0; trial < 300; ++trial) {
    const LugreConstants constants{.stiffness = std::pow(10, 3 + 4 * u(engine)),
                                   .damping = std::pow(10, 4 * u(engine)),
                                   .stiction = 1 + u(engine),
                                   .stribeck_velocity = std::pow(10, -4 + 3 * u(engine))};
    const double dt = std::pow(10, -4 + 2 * u(engine));
    DraggedContact contact(constants, dt);
    const double size = std::pow(10, -5 + 3 * u(engine)), rate = 0.3 * u(engine), other = 0.3 * u(engine);
    const double jitter = trial % 2 ? 0.1 : 0;
    double work = 0, x = 0;
    for (int i = 1; i <= 500; ++i) {
      const double next =
          i == 500 ? 0 : size * (std::sin(rate * i) + std::sin(other * i) + jitter * (u(engine) - 0.5));  // closed
      const double force = contact.move_to(next);
      work += force * (next - x);
      x = next;
      const double z = contact.bristles().deflection;
      const double held = 0.5 * constants.stiffness * kLength * z * z + 0.5 * kCompliance * force * force;
      least = std::min(least, (work - held) / std::max(work, 1e-9));
      ASSERT_GE(work, held * (1 - 1e-9) - 1e-15) << "trial " << trial << ", step " << i;
    }
    ASSERT_GT(work, 0);
  }
  std::printf("work less what is held, at least %.1e of it\n", least);
}

}  // namespace
}  // namespace stylet::physics
