#include "engine/debrief/playback.h"

#include <gtest/gtest.h>

namespace stylet::debrief {
namespace {

TEST(Playback, RunsAtItsSpeedAndWaitsForStatesNotYetReplayed) {
  Playback playback(2, 10, 0.5);
  playback.advance(1, 100);
  EXPECT_DOUBLE_EQ(playback.time_s(), 2.5);
  playback.advance(4, 3);
  EXPECT_DOUBLE_EQ(playback.time_s(), 3);
  playback.advance(100, 100);
  EXPECT_DOUBLE_EQ(playback.time_s(), 10);
}

TEST(Playback, PausesAndGoesOn) {
  Playback playback(0, 10, 1);
  playback.apply(Pause{});
  playback.advance(1, 10);
  EXPECT_DOUBLE_EQ(playback.time_s(), 0);
  EXPECT_NE(playback.caption().find("paused"), std::string::npos);
  playback.apply(Pause{});
  playback.advance(1, 10);
  EXPECT_DOUBLE_EQ(playback.time_s(), 1);
}

TEST(Playback, SeeksWithinTheSpan) {
  Playback playback(1, 3, 1);
  playback.apply(Seek{1});
  playback.apply(Seek{0.1});
  EXPECT_DOUBLE_EQ(playback.time_s(), 2.1);
  for (int i = 0; i < 5; ++i) playback.apply(Seek{1});
  EXPECT_DOUBLE_EQ(playback.time_s(), 3);
  playback.apply(Seek{-1});
  EXPECT_DOUBLE_EQ(playback.time_s(), 2);
  playback.apply(SeekStart{});
  EXPECT_DOUBLE_EQ(playback.time_s(), 1);
  playback.apply(SeekEnd{});
  EXPECT_DOUBLE_EQ(playback.time_s(), 3);
}

TEST(Playback, SpeedDoublesAndHalvesWithinItsLimits) {
  Playback playback(0, 10, 1);
  playback.apply(ChangeSpeed{0.5});
  playback.apply(ChangeSpeed{0.5});
  EXPECT_DOUBLE_EQ(playback.speed(), 0.25);
  for (int i = 0; i < 20; ++i) playback.apply(ChangeSpeed{2});
  EXPECT_DOUBLE_EQ(playback.speed(), Playback::kFastest);
  for (int i = 0; i < 20; ++i) playback.apply(ChangeSpeed{0.5});
  EXPECT_DOUBLE_EQ(playback.speed(), Playback::kSlowest);
}

}  // namespace
}  // namespace stylet::debrief
