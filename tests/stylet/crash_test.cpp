// A session killed outright (SIGKILL) at any moment: its recording lies in its folder and replays up to the kill.
#include "engine/recording/unfinished_recording.h"
#include "tests/readers/small_scenario.h"
#include "tests/stylet/command.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <random>
#include <thread>

namespace stylet {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

/// `stylet train` without a shell around it, so that the signal reaches the session itself.
class Session {
public:
  Session(const fs::path& scenario, const fs::path& out) {
    const std::vector<std::string> words{STYLET_COMMAND, "train", scenario.string(), "--view",
                                         "headless",     "--out", out.string()};
    process_ = ::fork();
    if (process_ != 0) return;
    const int null = ::open("/dev/null", O_RDWR);
    for (const int descriptor : {0, 1, 2}) ::dup2(null, descriptor);
    std::vector<char*> arguments;
    for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    ::execv(arguments.front(), arguments.data());
    std::_Exit(127);
  }
  ~Session() { kill(); }
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  void kill() {
    if (process_ <= 0) return;
    ::kill(process_, SIGKILL);
    ::waitpid(process_, nullptr, 0);
    process_ = 0;
  }

private:
  pid_t process_ = 0;
};

/// Bytes of recordings in the folder.
std::uintmax_t recorded_bytes(const fs::path& folder) {
  std::uintmax_t bytes = 0;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (entry.path().extension() == ".rec") bytes += entry.file_size(error);
  }
  return bytes;
}

double session_seconds(const std::string& output) {
  const std::size_t end = output.find(" s of session)");
  const std::size_t begin = output.rfind('(', end);
  return end == std::string::npos ? -1 : std::atof(output.c_str() + begin + 1);
}

/// What was recorded until the kill has its debrief, and a film in slow motion of a part of it.
void expect_debrief_and_film(const fs::path& session, const fs::path& to) {
  const Outcome debrief = run(fmt::format("debrief {} --expert none --out {}", session.string(), to.string()));
  EXPECT_EQ(debrief.exit_code, 0) << debrief.output;
  EXPECT_NE(read_text(to / "debrief.html").find("was cut off"), std::string::npos);
  const auto told = nlohmann::json::parse(read_text(to / "debrief.json"));
  EXPECT_TRUE(told["cut_off"]);
  EXPECT_GT(told["path"]["time_s"].size(), 1u);
  EXPECT_FALSE(told["metrics"].empty());
  if (support::kSanitized) return;
  const Outcome film =
      run(fmt::format("replay {} --out {} --from 0.05 --to 0.15 --speed 0.25", session.string(), to.string()));
  EXPECT_EQ(film.exit_code, 0) << film.output;
  // 0.1 s four times as slow at 30 a second; at 15 where the processor draws.
  EXPECT_TRUE(film.output.find("session.mp4 (13 frames)") != std::string::npos ||
              film.output.find("session.mp4 (7 frames)") != std::string::npos)
      << film.output;
  EXPECT_GT(fs::file_size(to / "session.mp4"), 500u);
  const Outcome beyond = run(fmt::format("replay {} --out {} --from 500", session.string(), to.string()));
  EXPECT_EQ(beyond.exit_code, 2) << beyond.output;
  EXPECT_NE(beyond.output.find("the span must lie within the session"), std::string::npos) << beyond.output;
}

TEST(Crash, AKilledSessionReplaysUpToItsLastSecond) {
  readers::test::SmallScenario small;
  small.motion["tracks"]["stylus"] = nlohmann::json::parse(
      "[[0, 0.1, 0, 0.21, 0, 1, 0, 0], [2, 0.1, 0, 0.16, 0, 1, 0, 0], [60, 0.1, 0, 0.16, 0, 1, 0, 0]]");
  const fs::path scenario = small.write();
  const support::TemporaryFolder folder;
  const char* wanted = std::getenv("STYLET_KILLS");
  const int kills = wanted != nullptr ? std::atoi(wanted) : support::kSanitized ? 1 : 4;
  std::mt19937 random(wanted != nullptr ? std::random_device()() : 20261122);
  std::uniform_int_distribution<int> moment_ms(300, 1500);
  constexpr std::uintmax_t kHeader = 2048;  // and some steps
  for (int k = 0; k < kills; ++k) {
    const fs::path out = folder / std::to_string(k);
    Session session(scenario, out);
    const Clock::time_point launched = Clock::now();
    while (recorded_bytes(out) < kHeader && seconds_since(launched) < 120)
      std::this_thread::sleep_for(milliseconds(1));
    const Clock::time_point seen = Clock::now();
    std::this_thread::sleep_for(milliseconds(moment_ms(random)));
    session.kill();
    const double recorded_s = seconds_since(seen);

    const std::vector<fs::path> left = recording::cut_off_recordings(out);
    ASSERT_EQ(left.size(), 1u) << "kill " << k;
    const Outcome replayed = run("replay " + out.string());
    EXPECT_EQ(replayed.exit_code, 0) << replayed.output;
    EXPECT_NE(replayed.output.find("identical"), std::string::npos) << replayed.output;
    EXPECT_NE(replayed.output.find("cut short"), std::string::npos) << replayed.output;
    EXPECT_GE(session_seconds(replayed.output), recorded_s - 1) << replayed.output;
    if (k > 0) continue;
    expect_debrief_and_film(out, folder / "shown");
    // A record torn in the middle, as a power cut leaves it; and the name that the user expects.
    fs::resize_file(left.front(), fs::file_size(left.front()) - 13);
    const Outcome torn = run("replay " + left.front().string());
    EXPECT_EQ(torn.exit_code, 0) << torn.output;
    const Outcome expected = run("replay " + (out / "session.rec").string());
    EXPECT_EQ(expected.exit_code, 2);
    EXPECT_NE(expected.output.find(left.front().string()), std::string::npos) << expected.output;
  }
}

}  // namespace
}  // namespace stylet
