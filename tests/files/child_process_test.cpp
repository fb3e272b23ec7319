#include "engine/files/child_process.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <string>
#include <system_error>

namespace stylet::files {
namespace {

// What a shell says on its standard output, as soon as it has said something.
std::string said(const std::string& script) {
  std::array<int, 2> ends{};
  EXPECT_EQ(pipe(ends.data()), 0);
  ChildProcess child({.command = {"sh", "-c", script}, .output = ends[1]});
  close(ends[1]);
  std::array<char, 200> text{};
  const ssize_t count = read(ends[0], text.data(), text.size());
  close(ends[0]);
  EXPECT_EQ(child.wait(), 0);
  return {text.data(), count > 0 ? static_cast<std::size_t>(count) : 0};
}

TEST(ChildProcess, GivesItsExitStatusOrTheSignalThatEndedIt) {
  EXPECT_EQ(ChildProcess({.command = {"sh", "-c", "exit 7"}}).wait(), 7);
  EXPECT_EQ(ChildProcess({.command = {"/bin/sh", "-c", "kill -TERM $$"}}).wait(), 128 + 15);
}

TEST(ChildProcess, FailureToStartGivesTheReason) {
  try {
    ChildProcess child({.command = {"no-such-program"}});
    FAIL() << "it was started";
  } catch (const std::system_error& error) {
    EXPECT_EQ(error.code(), std::errc::no_such_file_or_directory);
    EXPECT_NE(std::string(error.what()).find("no-such-program"), std::string::npos) << error.what();
  }
}

TEST(ChildProcess, HasItsStreamsAndNoOtherFile) {
  constexpr int kOurs = 50;
  ASSERT_EQ(dup2(STDIN_FILENO, kOurs), kOurs);
  EXPECT_EQ(said("test -e /proc/self/fd/50 && echo open || echo closed"), "closed\n");
  close(kOurs);
  EXPECT_EQ(said("read line; echo \"$line.\""), ".\n") << "nothing to read";
}

TEST(ChildProcess, IsEndedWithTheObject) {
  std::array<int, 2> ends{};
  ASSERT_EQ(pipe(ends.data()), 0);
  {
    ChildProcess child({.command = {"sleep", "1000"}, .output = ends[1]});
    close(ends[1]);
    EXPECT_FALSE(child.ended());
  }
  char byte = 0;
  EXPECT_EQ(read(ends[0], &byte, 1), 0) << "nobody holds the other end any more";
  close(ends[0]);
}

}  // namespace
}  // namespace stylet::files
