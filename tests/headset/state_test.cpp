// A session's life: states, taking the headset off, and what happens when it goes.
#include "tests/headset/rig.h"

namespace stylet::tests {
namespace {

using headset::HeadsetPhase;

const std::vector<XrSessionState> kUp{XR_SESSION_STATE_IDLE, XR_SESSION_STATE_READY, XR_SESSION_STATE_SYNCHRONIZED,
                                      XR_SESSION_STATE_VISIBLE, XR_SESSION_STATE_FOCUSED};
const std::vector<XrSessionState> kDown{XR_SESSION_STATE_VISIBLE, XR_SESSION_STATE_SYNCHRONIZED,
                                        XR_SESSION_STATE_STOPPING, XR_SESSION_STATE_IDLE};

std::vector<XrSessionState> joined(std::vector<XrSessionState> a, const std::vector<XrSessionState>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

TEST(HeadsetSession, GoesThroughItsStatesAndDrawsWhileItIsSeen) {
  Rig rig;
  EXPECT_EQ(rig.headset().phase(), HeadsetPhase::waiting);
  std::vector<bool> drawn;
  for (int i = 0; i < 5; ++i) {
    const auto frame = rig.turn();
    ASSERT_TRUE(frame.has_value());
    EXPECT_EQ(rig.headset().phase(), HeadsetPhase::running);
    drawn.push_back(frame->draw);
  }
  EXPECT_EQ(mock::report().states, kUp);
  EXPECT_EQ(drawn, (std::vector{false, false, true, true, true}));

  rig.headset().request_exit();
  int turns = 0;
  while (rig.headset().phase() != HeadsetPhase::ended && ++turns < 20) rig.turn();
  EXPECT_EQ(mock::report().states, joined(joined(kUp, kDown), {XR_SESSION_STATE_EXITING}));
  EXPECT_FALSE(rig.turn().has_value());
  rig.expect_clean();
}

TEST(HeadsetSession, TakenOffShowsNothingAndComesBack) {
  Rig rig;
  rig.turn_until_focused();
  mock::take_off();
  for (int i = 0; i < 4; ++i) rig.turn();
  EXPECT_FALSE(rig.turn()->draw);
  mock::put_on();
  for (int i = 0; i < 4; ++i) rig.turn();
  EXPECT_TRUE(rig.turn()->draw);
  rig.expect_clean();
}

TEST(HeadsetSession, StoppedByTheRuntimeWaitsAndStartsAgain) {
  Rig rig;
  rig.turn_until_focused();
  mock::stop(false);
  int turns = 0;
  while (rig.headset().phase() != HeadsetPhase::waiting && ++turns < 20) rig.turn();
  ASSERT_EQ(rig.headset().phase(), HeadsetPhase::waiting);
  EXPECT_FALSE(rig.turn().has_value());
  mock::put_on();
  EXPECT_TRUE(rig.turn_until_focused().draw);
  rig.expect_clean();
}

struct Loss {
  const char* name;
  void (*happens)(bool announced);
  bool announced;
};

class HeadsetLoss : public testing::TestWithParam<Loss> {};

TEST_P(HeadsetLoss, EndsTheSessionWithOneLineAndTheDeviceGoesOn) {
  Rig rig;
  rig.turn_until_focused();
  GetParam().happens(GetParam().announced);
  EXPECT_FALSE(rig.turn().has_value());
  EXPECT_EQ(rig.headset().phase(), HeadsetPhase::lost);
  const std::string reason = rig.headset().reason();
  EXPECT_FALSE(reason.empty());
  EXPECT_EQ(reason.find('\n'), std::string::npos);
  // Whatever is called now does nothing.
  const std::uint64_t frames = mock::report().frames;
  const std::size_t refused = mock::report().errors.size();
  EXPECT_LE(refused, 1U);
  rig.turn();
  rig.headset().end_frame(nullptr);
  rig.headset().request_exit();
  EXPECT_EQ(mock::report().frames, frames);
  EXPECT_EQ(mock::report().errors.size(), refused);
  EXPECT_EQ(rig.headset().reason(), reason);

  {
    gpu::Image image(rig.device(), {.width = 4, .height = 4, .usage = gpu::kStorageUsage});
    gpu::run_now(rig.device(), [&](gpu::Commands& commands) { commands.clear(image, {1, 0, 0, 1}); });
    EXPECT_EQ(gpu::read_back<std::uint8_t>(rig.device(), image).front(), 255);
  }
  rig.expect_clean(refused);
}

TEST_P(HeadsetLoss, InTheMiddleOfAFrameEndsTheSessionToo) {
  Rig rig;
  rig.turn_until_focused();
  rig.headset().poll();
  const auto frame = rig.headset().begin_frame();
  ASSERT_TRUE(frame.has_value());
  GetParam().happens(GetParam().announced);
  rig.headset().end_frame(nullptr);
  EXPECT_EQ(rig.headset().poll(), HeadsetPhase::lost);
  EXPECT_FALSE(rig.headset().reason().empty());
  rig.expect_clean(GetParam().announced ? 0 : 1);
}

INSTANTIATE_TEST_SUITE_P(All, HeadsetLoss,
                         testing::Values(Loss{"SessionAnnounced", mock::lose_session, true},
                                         Loss{"SessionSudden", mock::lose_session, false},
                                         Loss{"InstanceAnnounced", mock::lose_instance, true},
                                         Loss{"InstanceSudden", mock::lose_instance, false}),
                         [](const auto& one) { return one.param.name; });

}  // namespace
}  // namespace stylet::tests
