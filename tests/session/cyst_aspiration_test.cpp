// The shipped scenario with its recorded hand: the needle comes into the cyst, and the syringe empties it.
#include "engine/procedures/aspiration/aspiration.h"
#include "engine/readers/scenario.h"
#include "engine/session/recorded_stylus.h"
#include "engine/session/replay.h"
#include "engine/training/replayed_procedure.h"
#include "engine/training/training_session.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <string>
#include <vector>

namespace stylet::training {
namespace {

using procedures::aspiration::Aspiration;

TEST(CystAspiration, TheRecordedHandPuncturesTheWallOnceAndDrawsFluidAndTheReplayShowsIt) {
  if (support::kSanitized) GTEST_SKIP() << "minutes long with a sanitizer; AspirationFlow is not";
  const content::Scene scene = readers::load_scene(readers::find_scenario("cyst_aspiration"));
  ASSERT_EQ(scene.cavities.size(), 1U);
  const double full = scene.cavities[0].volume;
  const support::TemporaryFolder folder;
  haptic::RecordedDevice device = session::recorded_stylus(scene.motion);
  TrainingSession training(scene, {.automatic = true});
  session::LiveSession live(scene, device,
                            {.duration_s = 17,  // 6 s of drawing, the last of them in a breathing patient
                             .lockstep = true,
                             .recording = folder / "cyst",
                             .build = "test",
                             .listeners = {&training.watch()}});
  struct Moment {
    double time_s, share, held;
  };
  std::vector<Moment> moments;
  live.run_in_lockstep([&](double share) {
    share < 1 ? (void)training.poll(live) : training.end(live);
    state::FrameState frame;
    training.show(frame);
    ASSERT_TRUE(frame.syringe);
    moments.push_back({live.time_s(), frame.cavity_shares.at(0), frame.syringe->held});
  });
  const auto& aspiration = dynamic_cast<const Aspiration&>(*training.procedure());
  const procedures::aspiration::Outcome& outcome = aspiration.outcome();
  std::printf("%.1f of %.1f ml drawn, %.1f ml of blood, %ld punctures of the wall\n", 1e6 * outcome.drawn, 1e6 * full,
              1e6 * outcome.wrong, outcome.entries);
  EXPECT_GT(outcome.drawn, 5e-6);
  EXPECT_EQ(outcome.entries, 1);
  EXPECT_EQ(outcome.wrong, 0);
  EXPECT_NEAR(outcome.left_share, 1 - outcome.drawn / full, 1e-9);
  // What is drawn is missing in the cyst at every moment, and nothing flows back.
  for (std::size_t i = 0; i < moments.size(); ++i) {
    EXPECT_NEAR(moments[i].held, (1 - moments[i].share) * full, 1e-4 * full) << moments[i].time_s;
    if (i > 0) {
      EXPECT_LE(moments[i].share, moments[i - 1].share) << moments[i].time_s;
    }
  }

  const recording::Recording recording = recording::read_recording(folder / "cyst");
  const session::RecordedSettings settings = session::recorded_settings(recording);
  session::StepHash hash;
  ReplayedProcedure replayed(scene, recording.events);
  session::CoupledLoops loops(scene, settings.coupling, settings.start, {&hash, &replayed}, settings.base);
  ASSERT_TRUE(session::replay(recording, loops, hash).identical());
  state::FrameState frame;
  replayed.show_at(moments.back().time_s, frame);
  ASSERT_TRUE(frame.syringe);
  EXPECT_NEAR(frame.syringe->held, moments.back().held, 1e-3 * full);
  replayed.show_at(9, frame);
  EXPECT_EQ(frame.cavity_shares.at(0), 1);
}

}  // namespace
}  // namespace stylet::training
