// A session whose graphics device is lost under it (tests/support/vulkan/losing_device.cpp): the loops go on, what
// was recorded is whole, and one line says what happened.
#include "tests/link/igtl_client.h"
#include "tests/readers/small_scenario.h"
#include "tests/stylet/running_command.h"
#include "tests/support/temporary_folder.h"

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include <chrono>
#include <cstdlib>

namespace stylet {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

constexpr double kLong = 240;     // s, in real time: until it is interrupted, however long devices take to be made
constexpr double kSession = 0.4;  // s in lockstep: 24 pictures, however slowly they are drawn
constexpr const char* kInLockstep = "--lockstep --seconds 0.4 --device recorded";
constexpr const char* kGoesOn = "; the session goes on with another\n";
constexpr const char* kRefused = "stylet: the graphics device was lost (vkQueueSubmit2: VK_ERROR_DEVICE_LOST)";

int count(const std::string& text, const std::string& part) {
  int found = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++found;
  return found;
}

class DeviceLoss : public ::testing::Test {
protected:
  DeviceLoss() {
    small_.scenario["labels"]["spacing_mm"] = 4;
    small_.scenario["camera"]["eye"] = {0.1, -0.4, 0.4};
    small_.motion["tracks"]["stylus"] = json::parse("[[0, 0.1, 0, 0.2, 0, 1, 0, 0], [3, 0.1, 0, 0.17, 0, 1, 0, 0]]");
    small_.motion["tracks"]["stylus"].push_back({kLong, 0.1, 0, 0.17, 0, 1, 0, 0});
    small_.write();
  }
  void TearDown() override {
    for (const char* variable : {"LD_PRELOAD", "STYLET_LOSE_DEVICE", "XR_RUNTIME_JSON", "STYLET_MOCK_OPENXR"})
      unsetenv(variable);
  }

  /// The arguments of a session whose devices are lost as planned.
  std::string losing(const char* plan, const std::string& arguments, const char* film = "--no-film") {
    setenv("STYLET_LOSE_DEVICE", plan, 1);
    setenv("LD_PRELOAD", STYLET_LOSING_DEVICE, 1);
    return fmt::format("train {} --expert none {} --out {} {}", small_.path().string(), film, out().string(),
                       arguments);
  }
  Outcome train(const char* plan, const std::string& arguments, const char* film = "--no-film") {
    return run(losing(plan, arguments, film));
  }
  fs::path out() const { return folder_ / "out"; }

  /// It lasted as long as it was to, and every step of it replays.
  void expect_whole(double seconds = kSession) {
    const json session = json::parse(read_text(out() / "session.json"));
    EXPECT_TRUE(session["replay"]["identical"]);
    EXPECT_NEAR(session["duration_s"].get<double>(), seconds, 0.1);
    unsetenv("LD_PRELOAD");
    const Outcome replayed = run("replay " + (out() / "session.rec").string());
    EXPECT_EQ(replayed.exit_code, 0) << replayed.output;
    EXPECT_THAT(replayed.output, HasSubstr("identical: "));
  }
  std::string state_hash() const { return json::parse(read_text(out() / "session.json"))["state_hash"]; }
  void expect_pictures(bool there) {
    for (const char* name : {"debrief.html", "session.png", "view.png"}) EXPECT_EQ(fs::exists(out() / name), there);
    EXPECT_GT(fs::file_size(out() / "force.csv"), 500u);
  }

  const support::TemporaryFolder folder_;
  readers::test::SmallScenario small_;
};

class DeviceLossInAWindow : public DeviceLoss {
protected:
  void SetUp() override {
    if (std::getenv("DISPLAY") == nullptr) GTEST_SKIP() << "no display";
  }
};

TEST_F(DeviceLossInAWindow, TheSessionGoesOnInAnother) {
  const Outcome outcome = train("8 never", fmt::format("--view window {}", kInLockstep));
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_EQ(count(outcome.output, std::string(kRefused) + kGoesOn), 1) << outcome.output;
  EXPECT_EQ(count(outcome.output, "stylet: "), 1) << outcome.output;
  expect_pictures(true);
  expect_whole();
  const std::string seen = state_hash();
  train("1", fmt::format("--view headless {}", kInLockstep));
  EXPECT_EQ(state_hash(), seen) << "in lockstep it does not matter who looks on";
}

TEST_F(DeviceLossInAWindow, LostAgainAndAgainItGoesOnHeadless) {
  const Outcome outcome = train("8 3", fmt::format("--view window {}", kInLockstep));
  EXPECT_EQ(outcome.exit_code, 2) << outcome.output;
  EXPECT_EQ(count(outcome.output, std::string(kRefused) + kGoesOn), 2) << outcome.output;
  EXPECT_EQ(count(outcome.output, std::string(kRefused) + " 3 times; going on headless\n"), 1) << outcome.output;
  // Neither can the debrief be drawn: what was measured is kept.
  EXPECT_EQ(count(outcome.output, std::string(kRefused) + "; drawing again with another\n"), 1) << outcome.output;
  EXPECT_THAT(outcome.output, HasSubstr("the patient was not drawn\n"));
  expect_pictures(false);
  expect_whole();
}

TEST_F(DeviceLossInAWindow, ASessionWithoutInputEnds) {
  const Outcome outcome = train("8 absent", "--view window");
  EXPECT_EQ(outcome.exit_code, 2) << outcome.output;
  EXPECT_EQ(count(outcome.output, "Mouse and keyboard lead the needle (H: the keys); --device recorded: "), 1)
      << outcome.output;
  EXPECT_EQ(count(outcome.output, std::string(kRefused) + ", and there is no other (vkCreateDevice on "), 1)
      << outcome.output;
  EXPECT_THAT(outcome.output, HasSubstr("; nobody could lead the session any more: the end\n"));
  expect_pictures(false);
  const double lasted = json::parse(read_text(out() / "session.json"))["duration_s"];
  EXPECT_GT(lasted, 0.1);
  expect_whole(lasted);
}

TEST_F(DeviceLossInAWindow, AHungDeviceIsNotWaitedFor) {
  const Outcome outcome = train("hang:3 absent", fmt::format("--view window {}", kInLockstep));
  EXPECT_EQ(outcome.exit_code, 2) << outcome.output;
  EXPECT_THAT(outcome.output, HasSubstr(" hangs: a submission took longer than two minutes), and there is no other"));
  EXPECT_THAT(outcome.output, HasSubstr("; going on headless\n"));
  expect_pictures(false);
  expect_whole();
}

TEST_F(DeviceLoss, TheDebriefIsDrawnWithAnother) {
  const Outcome outcome = train("5 never", "--view headless --lockstep --seconds 0.4 --device recorded", "");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_EQ(count(outcome.output, std::string(kRefused) + "; drawing again with another\n"), 1) << outcome.output;
  expect_pictures(true);
  expect_whole();
}

TEST_F(DeviceLoss, AHeadlessSessionGoesOnSendingImages) {
  RunningCommand session(losing("3 3 absent", "--view headless --link 0"));
  const std::string port = session.wait_for("clients connect to 127.0.0.1:");
  ASSERT_FALSE(port.empty()) << session.output();
  tests::IgtlClient client;
  ASSERT_TRUE(client.connect(std::stoi(port)));
  // The second device was lost too: images were made with it.
  EXPECT_FALSE(session.wait_for("; going on without images").empty()) << session.output();
  EXPECT_EQ(count(session.output(), std::string(kRefused) + kGoesOn), 1) << session.output();
  const std::chrono::duration<double> lost = std::chrono::system_clock::now().time_since_epoch();
  tests::ClientMessage needle;
  do {
    needle = client.receive("NeedleToReference");
    ASSERT_EQ(needle.type, "TRANSFORM") << "of after the loss";
  } while (needle.utc_s < lost.count() + 0.1);
  client.close();
  session.interrupt();
  EXPECT_EQ(session.end(), 2) << session.output();
  EXPECT_EQ(session.output().find("Vulkan validation"), std::string::npos) << session.output();
  expect_pictures(false);
  expect_whole(json::parse(read_text(out() / "session.json"))["duration_s"]);
}

TEST_F(DeviceLoss, InAHeadsetTheSessionGoesOnThere) {
  setenv("XR_RUNTIME_JSON", STYLET_MOCK_OPENXR_MANIFEST, 1);
  const fs::path refused = folder_ / "refused";
  setenv("STYLET_MOCK_OPENXR", fmt::format("steady=11 size=96x80 errors={}", refused.string()).c_str(), 1);
  const Outcome outcome = train("5 3 absent", fmt::format("--view headset {}", kInLockstep));
  EXPECT_EQ(outcome.exit_code, 2) << outcome.output;
  EXPECT_EQ(count(outcome.output, std::string(kRefused) + kGoesOn), 1) << outcome.output;
  EXPECT_THAT(outcome.output, HasSubstr("; going on headless\n"));
  EXPECT_EQ(read_text(refused), "");
  expect_pictures(false);
  expect_whole();
}

}  // namespace
}  // namespace stylet
