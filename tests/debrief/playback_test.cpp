#include "engine/debrief/playback.h"

#include <gtest/gtest.h>

namespace stylet::debrief {
namespace {

constexpr int kRight = 262, kLeft = 263, kHome = 268, kEnd = 269;

TEST(Playback, RunsAtItsSpeedAndWaitsForWhatIsNotKnownYet) {
  Playback playback(2, 10, 0.5);
  playback.advance(1, 100);
  EXPECT_DOUBLE_EQ(playback.time_s(), 2.5);
  playback.advance(4, 3);
  EXPECT_DOUBLE_EQ(playback.time_s(), 3);
  playback.advance(100, 100);
  EXPECT_DOUBLE_EQ(playback.time_s(), 10);
}

TEST(Playback, SpacePausesOnceAKeyIsHeld) {
  Playback playback(0, 10, 1);
  playback.press({.key = ' '});
  playback.press({.key = ' ', .repeated = true});
  playback.advance(1, 10);
  EXPECT_DOUBLE_EQ(playback.time_s(), 0);
  EXPECT_NE(playback.caption().find("paused"), std::string::npos);
  playback.press({.key = ' '});
  playback.advance(1, 10);
  EXPECT_DOUBLE_EQ(playback.time_s(), 1);
}

TEST(Playback, ArrowsSeekWithinTheSpan) {
  Playback playback(1, 3, 1);
  playback.press({.key = kRight});
  playback.press({.key = kRight, .shift = true});
  EXPECT_DOUBLE_EQ(playback.time_s(), 2.1);
  for (int i = 0; i < 5; ++i) playback.press({.key = kRight, .repeated = true});
  EXPECT_DOUBLE_EQ(playback.time_s(), 3);
  playback.press({.key = kLeft});
  EXPECT_DOUBLE_EQ(playback.time_s(), 2);
  playback.press({.key = kHome});
  EXPECT_DOUBLE_EQ(playback.time_s(), 1);
  playback.press({.key = kEnd});
  EXPECT_DOUBLE_EQ(playback.time_s(), 3);
}

TEST(Playback, SpeedDoublesAndHalvesWithinItsLimits) {
  Playback playback(0, 10, 1);
  playback.press({.key = '-'});
  playback.press({.key = '-'});
  EXPECT_DOUBLE_EQ(playback.speed(), 0.25);
  for (int i = 0; i < 20; ++i) playback.press({.key = '='});
  EXPECT_DOUBLE_EQ(playback.speed(), Playback::kFastest);
  for (int i = 0; i < 20; ++i) playback.press({.key = '-'});
  EXPECT_DOUBLE_EQ(playback.speed(), Playback::kSlowest);
}

}  // namespace
}  // namespace stylet::debrief
