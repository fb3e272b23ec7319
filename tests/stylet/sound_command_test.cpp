// The sound of a session as a user has it: a device that is not there, or goes, costs one line and nothing else.
#include "tests/readers/small_scenario.h"
#include "tests/stylet/command.h"
#include "tests/support/temporary_folder.h"

#include <gmock/gmock.h>

#include <cstdlib>

namespace stylet {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class SoundCommand : public ::testing::Test {
protected:
  void SetUp() override {
    if (std::getenv("DISPLAY") == nullptr) GTEST_SKIP() << "no display";
    small_.scenario["labels"]["spacing_mm"] = 4;
    small_.write();
  }
  void TearDown() override {
    for (const char* variable : {"ALSOFT_DRIVERS", "ALSOFT_CONF"}) unsetenv(variable);
  }
  /// In a window, its sound where `drivers` say; of a file it is that one.
  Outcome train(const char* drivers, const fs::path& file, const std::string& more = "") {
    setenv("ALSOFT_DRIVERS", drivers, 1);
    setenv("ALSOFT_CONF", folder_.write("alsoft.conf", "[wave]\nfile = " + file.string() + "\n").c_str(), 1);
    return run(
        fmt::format("train {} --view window --lockstep --seconds 0.1 --device recorded --expert none --no-film "
                    "--out {} {}",
                    small_.path().string(), (folder_ / "out").string(), more));
  }

  const support::TemporaryFolder folder_;
  readers::test::SmallScenario small_;
};

TEST_F(SoundCommand, WithoutADeviceOneLineSaysSo) {
  const Outcome outcome = train("none-of-these", "");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_THAT(outcome.output, HasSubstr("stylet: no sound: there is no device for it; going on silent\n"));
  EXPECT_THAT(outcome.output, Not(HasSubstr("ALSA lib")));
  EXPECT_THAT(outcome.output, Not(HasSubstr("AL lib")));
}

TEST_F(SoundCommand, ADeviceThatGoesDoesNotEndTheSession) {
  const Outcome outcome = train("wave", "/dev/full");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_EQ(run("replay " + (folder_ / "out").string()).exit_code, 0);
}

TEST_F(SoundCommand, MutedItOpensNone) {
  const fs::path file = folder_ / "played.wav";
  EXPECT_EQ(train("wave", file, "--mute").exit_code, 0);
  EXPECT_FALSE(fs::exists(file));
  EXPECT_EQ(train("wave", file).exit_code, 0);
  EXPECT_TRUE(fs::exists(file));
}

}  // namespace
}  // namespace stylet
