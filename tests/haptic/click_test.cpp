// A click by itself: bounded, without impulse, and little energy to whatever holds the instrument.
#include "haptic/click.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

namespace stylet::haptic {
namespace {

constexpr double kMillisecond = 1e-3;

TEST(Click, IsBoundedGoesBackFirstAndHasNoImpulse) {
  for (const double most : {0.0, -1.0, 0.4, 1.5, 100.0}) {
    const double amplitude = std::clamp(most, 0.0, 1.5);
    Click click;
    EXPECT_EQ(click.step(kMillisecond), 0) << "nothing was fired";
    click.begin(most);
    double impulse = 0, least = 0, greatest = 0, last = 0, change = 0, least_at = 0, greatest_at = 0;
    for (int k = 0; k < 30; ++k) {
      const double force = click.step(kMillisecond);
      if (force < least) least_at = k;
      if (force > greatest) greatest_at = k;
      least = std::min(least, force);
      greatest = std::max(greatest, force);
      change = std::max(change, std::abs(force - last));
      impulse += force * kMillisecond;
      last = force;
      if (k >= 15) {
        ASSERT_EQ(force, 0) << "it is over after 15 ms";
      }
    }
    EXPECT_GE(least, -amplitude);
    EXPECT_LE(greatest, amplitude);
    EXPECT_LE(least, -0.9 * amplitude);
    EXPECT_GE(greatest, 0.9 * amplitude);
    EXPECT_LE(least_at, greatest_at) << "the recoil, then the stop";
    EXPECT_NEAR(impulse, 0, 1e-12);
    EXPECT_LE(change, 0.8 * amplitude) << "a stylus that changes its force by 1 N a ms follows";
    EXPECT_FALSE(click.under_way());
  }
}

TEST(Click, OfStepsThatAreNotTheirLengthStaysBounded) {
  for (const double dt : {0.0, 1e-4, 3e-3, 0.011, 0.5, -1.0, std::numeric_limits<double>::quiet_NaN()}) {
    Click click;
    click.begin(Click::kForce);
    for (int k = 0; k < 40; ++k) EXPECT_LE(std::abs(click.step(dt)), Click::kForce) << dt;
  }
}

TEST(Click, StoppedItDoesNotGoOn) {
  Click click;
  click.begin(1);
  for (int k = 0; k < 4; ++k) EXPECT_LT(click.step(kMillisecond), 0);
  click.stop();
  EXPECT_EQ(click.step(kMillisecond), 0);
  EXPECT_EQ(click.step(kMillisecond), 0);
}

// Mass, damping and stiffness of what holds the stylus, in steps of a twentieth of a millisecond.
TEST(Click, GivesLessThanAMillijouleToWhateverHoldsTheStylus) {
  double most = 0;
  for (const double mass : {0.045, 0.1, 0.5}) {
    for (const double damping : {0.0, 0.5, 2.0, 8.0, 24.0, 100.0, 1000.0}) {
      for (const double stiffness : {0.0, 100.0, 500.0, 2000.0}) {
        Click click;
        click.begin(Click::kForce);
        double x = 0, v = 0, work = 0;
        for (int k = 0; k < 20; ++k) {
          const double force = click.step(kMillisecond);
          for (int s = 0; s < 20; ++s) {
            constexpr double kFine = kMillisecond / 20;
            v = (v + (force - stiffness * x) / mass * kFine) / (1 + damping / mass * kFine);
            x += v * kFine;
            work += force * v * kFine;
            most = std::max(most, work);
          }
        }
        if (damping == 0 && stiffness == 0) {
          EXPECT_NEAR(0.5 * mass * v * v, 0, 1e-8) << "a free mass ends at rest";
          EXPECT_LT(x, 0);
          EXPECT_GT(x, -1e-3);
        }
      }
    }
  }
  std::printf("at most %.2f mJ\n", 1e3 * most);
  EXPECT_LT(most, 1e-3);
}

}  // namespace
}  // namespace stylet::haptic
