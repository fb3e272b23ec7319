// The shipped demonstrations in a hand on a device like a 3D Systems Touch: never clipped, at the scale of their
// scenario.
#include "engine/readers/scenario.h"
#include "engine/session/live_session.h"
#include "engine/session/recorded_stylus.h"
#include "tests/session/held_stylus.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <limits>
#include <string>

namespace stylet::session {
namespace {

/// @param until  s: from then on the needle stays, and is felt less
void is_never_clipped(const std::string& name, double until = std::numeric_limits<double>::infinity()) {
  if (support::kSanitized) GTEST_SKIP() << "minutes long with a sanitizer";
  const content::Scene scene = readers::load_scene(readers::find_scenario(name));
  haptic::RecordedDevice hand = recorded_stylus(scene.motion);
  tests::HeldStylus device([&](double t) {
    const haptic::StylusSample sample = hand.read(t);
    return physics::StylusPose{sample.position, sample.orientation};
  });
  const support::TemporaryFolder folder;
  LiveSession session(scene, device,
                      {.duration_s = std::min(until, scene.motion.stylus.back().time_s),
                       .lockstep = true,
                       .recording = folder / "held.rec",
                       .build = "test"});
  const ForceOutput output = session.force_output(session.run_in_lockstep()).value();
  const double peak = session.force().summary().peak_force;
  std::printf("%s: scale %.2f, peak %.2f N, %.2f N expected\n", name.c_str(), output.scale, peak,
              scene.hand_force.peak);
  EXPECT_EQ(output.clipped_times, 0U);
  EXPECT_EQ(output.clipped_s, 0);
  EXPECT_LE(peak, scene.hand_force.peak);
  EXPECT_GT(peak, 0.7 * scene.hand_force.peak) << "no weaker than need be";
}

TEST(ForceScale, TheBiopsyInAHandIsNeverClipped) {
  is_never_clipped("liver_biopsy");
}

TEST(ForceScale, TheAblationInAHandIsNeverClipped) {
  is_never_clipped("rfa", 12);
}

TEST(ForceScale, TheAspirationInAHandIsNeverClipped) {
  is_never_clipped("cyst_aspiration", 12);
}

}  // namespace
}  // namespace stylet::session
