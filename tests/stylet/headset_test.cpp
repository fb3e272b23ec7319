// `stylet train --view headset` as a user runs it where there is none.
#include "tests/content/small_scenario.h"
#include "tests/stylet/command.h"
#include "tests/support/temporary_folder.h"

#include <cstdlib>

namespace stylet {
namespace {

class Headset : public ::testing::Test {
protected:
  Headset() {
    small_.scenario["labels"]["spacing_mm"] = 4;
    small_.write();
  }
  /// @param runtime  a manifest; @param plan  of the mock runtime, tests/support/openxr/environment.cpp
  Outcome train(const fs::path& runtime, const std::string& plan, const std::string& more) {
    setenv("XR_RUNTIME_JSON", runtime.c_str(), 1);
    setenv("STYLET_MOCK_OPENXR", fmt::format("{} errors={}", plan, refused().string()).c_str(), 1);
    // Where the test runs there may be a display, where it does not there is none.
    unsetenv("DISPLAY");
    unsetenv("WAYLAND_DISPLAY");
    return run(fmt::format("train {} --view headset --out {} {}", small_.path().string(), out().string(), more));
  }
  fs::path out() const { return folder_ / "out"; }
  fs::path refused() const { return folder_ / "refused"; }

  support::TemporaryFolder folder_;
  content::test::SmallScenario small_;
};

TEST_F(Headset, WithoutARuntimeTheSessionGoesOnWithOneLine) {
  const Outcome outcome = train("/nonexistent.json", "", "--device nonsense");
  EXPECT_NE(outcome.output.find("stylet: --view headset: no OpenXR runtime answers"), std::string::npos)
      << outcome.output;
  EXPECT_NE(outcome.output.find("going on headless\n"), std::string::npos) << outcome.output;
  // The loader says nothing, and the session went on as far as to its stylus.
  EXPECT_EQ(outcome.output.find("Error ["), std::string::npos) << outcome.output;
  EXPECT_NE(outcome.output.find("--device nonsense"), std::string::npos) << outcome.output;
}

TEST_F(Headset, WithoutAHeadsetItSaysSo) {
  const Outcome outcome = train(STYLET_MOCK_OPENXR_MANIFEST, "absent", "--device hand");
  EXPECT_NE(outcome.output.find("sees no headset"), std::string::npos) << outcome.output;
  EXPECT_NE(outcome.output.find("--device hand: needs a headset"), std::string::npos) << outcome.output;
  EXPECT_EQ(outcome.exit_code, 2);
}

}  // namespace
}  // namespace stylet
