// What a user meets before anything runs: a word misspelt, a value that cannot be, Tab, the manual, the menu of the
// desktop.
#include "tests/readers/small_scenario.h"
#include "tests/stylet/command.h"
#include "tests/support/temporary_folder.h"

#include <gmock/gmock.h>

#include <string>
#include <utility>
#include <vector>

namespace stylet {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

Outcome shell(const std::string& command) {
  const auto [exit_code, output] = support::run_in_shell(command);
  return {exit_code, output};
}

// The scenario named is not there: who complains about it has looked at the scenario first, which takes seconds of
// one that is.
TEST(CommandLine, AnImpossibleStylusIsRefusedBeforeTheScenarioIsRead) {
  for (const char* command : {"train gone.json --view headless ", "render gone.json --out frames "}) {
    for (const auto& [device, said] :
         std::vector<std::pair<std::string, std::string>>{{"mous", "did you mean \"mouse\"?"},
                                                          {"recorded:", "recorded:FILE"},
                                                          {"recorded:/nowhere/motion.json", "/nowhere/motion.json"},
                                                          {"hid:feed:f00d", "--device hid:feed:f00d"},
                                                          {"hid:nonsense", "is not VID:PID"},
                                                          {"mouse", "--device mouse: "},
                                                          {"link", "--device link: "},
                                                          {"hand", "--device hand: "}}) {
      const Outcome outcome = run(command + ("--device " + device));
      EXPECT_EQ(outcome.exit_code, 2) << outcome.output;
      EXPECT_EQ(outcome.lines(), 1) << outcome.output;
      EXPECT_THAT(outcome.output, HasSubstr(said)) << command;
      EXPECT_THAT(outcome.output, Not(HasSubstr("gone.json"))) << command;
    }
  }
}

TEST(CommandLine, AnInterruptedDatasetSaysWhatStays) {
  readers::test::SmallScenario small;
  small.probe["scan_lines"] = 48;
  small.probe["samples"] = 96;
  small.motion["tracks"]["stylus"] = {{0, 0.1, 0.03, 0.22, 0, 1, 0, 0}, {0.4, 0.1, 0.03, 0.17, 0, 1, 0, 0}};
  small.write();
  const fs::path set = small.folder / "set";
  const Outcome ended = shell(fmt::format(
      "ASAN_OPTIONS=detect_leaks=0 '{}' render '{}' --ultrasound --random 1000 --ultrasound-size 96x72 --out '{}' "
      "2>&1 & "
      "render=$!; until [ -e '{}/frame_000001.json' ]; do sleep 0.05; done; kill -INT $render; wait $render",
      STYLET_COMMAND, small.path().string(), set.string(), set.string()));
  EXPECT_EQ(ended.exit_code, 130) << ended.output;
  std::size_t whole = 0;
  for (const std::string& file : files_below(set)) whole += file.starts_with("frame_") ? 1 : 0;
  EXPECT_GE(whole, 2u);
  EXPECT_THAT(ended.output, HasSubstr(fmt::format("stylet: interrupted; {} of 1000 frames are whole and stay in {}; "
                                                  "give the same command again for the rest\n",
                                                  whole, set.string())));
}

}  // namespace
}  // namespace stylet
