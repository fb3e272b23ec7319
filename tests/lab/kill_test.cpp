// A process that writes attempts is killed outright again and again: what it said was kept is there, and whole.
#include "engine/lab/store/lab.h"
#include "tests/lab/sample_attempts.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <set>
#include <string>
#include <vector>

namespace stylet::lab::store {
namespace {

namespace fs = std::filesystem;

/// Takes attempts until it is killed. Tells of each what it knows: B and the id when it has begun, E when it is kept.
[[noreturn]] void take_attempts(const fs::path& folder, const fs::path& recording, int tell) {
  Lab lab({.folder = folder, .build = "test"});
  const Person ada = lab.enrolled("ada");
  while (true) {
    const std::string attempt = lab.begin(test::start_of(ada));
    const auto say = [&](char what) {
      const std::string line = what + attempt;
      if (::write(tell, line.data(), line.size()) != static_cast<ssize_t>(line.size())) ::_exit(1);
    };
    say('B');
    AttemptEnd end = test::end_of(80, true);
    end.recording = recording;
    lab.end(attempt, end);
    say('E');
  }
}

TEST(Kill, NoEndedAttemptIsLostAndNoneIsHalf) {
  const support::TemporaryFolder folder;
  const fs::path lab_folder = folder / "lab";
  const fs::path recording = folder.write("session.rec", std::string(100'000, 'r'));
  const char* wanted = std::getenv("STYLET_KILLS");
  const int kills = wanted != nullptr ? std::atoi(wanted) : 200;
  std::mt19937 random(2027);
  std::set<std::string> begun;
  std::set<std::string> ended;
  int in_the_middle = 0;
  for (int k = 0; k < kills; ++k) {
    int pipe[2];
    ASSERT_EQ(::pipe(pipe), 0);
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      ::close(pipe[0]);
      take_attempts(lab_folder, recording, pipe[1]);
    }
    ::close(pipe[1]);
    // At any moment after it has said so much: opening, beginning, keeping.
    const auto messages = static_cast<int>(random() % 6);
    const auto wait_us = static_cast<useconds_t>(random() % 30'000);
    const auto hear = [&] {
      std::string line(37, '\0');
      if (::read(pipe[0], line.data(), line.size()) != 37) return false;
      (line[0] == 'B' ? begun : ended).insert(line.substr(1));
      return true;
    };
    for (int m = 0; m < messages; ++m) ASSERT_TRUE(hear());
    ::usleep(wait_us);
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    while (hear()) {
    }
    ::close(pipe[0]);

    Lab lab({.folder = lab_folder, .build = "test"});
    std::set<std::string> kept;
    const auto metrics = lab.all_metrics();
    std::size_t with_metrics = 0;
    for (const AttemptRecord& attempt : lab.attempts()) {
      kept.insert(attempt.id);
      if (attempt.status == "ended") {
        ++with_metrics;
        ASSERT_EQ(metrics.at(attempt.id).size(), 31u) << "kill " << k;
        ASSERT_EQ(attempt.total, 80);
        ASSERT_EQ(fs::file_size(lab.recording_of(attempt.id)), 100'000u);
      } else {
        ASSERT_EQ(attempt.status, "crashed") << "kill " << k;
        ASSERT_FALSE(metrics.contains(attempt.id)) << "a half one";
        ASSERT_FALSE(ended.contains(attempt.id)) << "kill " << k << ": it was kept";
      }
    }
    ASSERT_EQ(metrics.size(), with_metrics);
    for (const std::string& attempt : begun) ASSERT_TRUE(kept.contains(attempt)) << "kill " << k << ": it had begun";
    for (const std::string& attempt : ended) ASSERT_TRUE(kept.contains(attempt));
    in_the_middle += lab.database().run("SELECT 1 FROM attempt WHERE status = 'crashed'").empty() ? 0 : 1;
    ASSERT_TRUE(!fs::exists(lab_folder / "running") || fs::is_empty(lab_folder / "running")) << "kill " << k;
  }
  EXPECT_GT(in_the_middle, 0) << "no kill met an attempt under way";
  if (kills >= 100) {
    EXPECT_GT(ended.size(), 50u);
  }
}

}  // namespace
}  // namespace stylet::lab::store
