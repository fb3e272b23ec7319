#include "engine/files/isolated_process.h"

#include <gtest/gtest.h>

#include <string>

namespace stylet::files {
namespace {

constexpr IsolationLimits kSmall{.output_bytes = 100, .cpu_seconds = 1, .wall_seconds = 5};

IsolatedResult run(const std::string& program, const std::string& input) {
  return run_isolated(program, std::as_bytes(std::span(input.data(), input.size())), kSmall);
}

std::string text(const IsolatedResult& result) {
  return {reinterpret_cast<const char*>(result.output.data()), result.output.size()};
}

TEST(IsolatedProcess, GetsItsInputAndHandsBackItsOutput) {
  const IsolatedResult result = run("/bin/cat", "a needle");
  EXPECT_EQ(result.status, 0);
  EXPECT_EQ(text(result), "a needle");
  EXPECT_EQ(run("/bin/sh", "exit 7").status, 7);
  EXPECT_EQ(run("/no/such/program", "").status, 127);
}

TEST(IsolatedProcess, IsEndedWhereItCrashesNeverEndsOrWritesOn) {
  EXPECT_EQ(run("/bin/sh", "kill -SEGV $$").status, -1);
  EXPECT_EQ(run("/bin/sh", "while :; do :; done").status, -1);
  EXPECT_EQ(run("/bin/cat", std::string(1000, 'x')).status, -1);
}

TEST(IsolatedProcess, InheritsNoOpenFileAndNoEnvironment) {
  EXPECT_EQ(text(run("/bin/sh", "echo /proc/self/fd/[3-9]")), "/proc/self/fd/[3-9]\n") << "none matches";
  EXPECT_EQ(text(run("/bin/sh", "echo $HOME$DISPLAY")), "\n");
}

}  // namespace
}  // namespace stylet::files
