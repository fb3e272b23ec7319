// A session killed outright (SIGKILL) at any moment: its recording lies in its folder and replays up to the kill.
#include "engine/recording/unfinished_recording.h"
#include "tests/link/igtl_client.h"
#include "tests/readers/small_scenario.h"
#include "tests/stylet/running_command.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

#include <cstdlib>
#include <random>

namespace stylet {
namespace {

/// What a session says of its own time to a client of its link: no clock of this process, which the machine may hold
/// up.
class Witness {
public:
  explicit Witness(int port) { connected_ = client_.connect(port); }
  bool connected() const { return connected_; }
  /// Looks on until the session has gone on for so long since the first look, or has ended.
  void look_on(double seconds) {
    while (connected_ && last_utc_s_ - first_utc_s_ < seconds) {
      const tests::ClientMessage message = client_.receive();
      connected_ = !message.type.empty();
      if (message.type != "TRANSFORM") continue;
      if (first_utc_s_ == 0) first_utc_s_ = message.utc_s;
      last_utc_s_ = message.utc_s;
    }
  }
  /// Session time seen, at most what the session has done.
  double seen_s() const { return last_utc_s_ - first_utc_s_; }

private:
  tests::IgtlClient client_;
  bool connected_ = false;
  double first_utc_s_ = 0;
  double last_utc_s_ = 0;
};

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
      run(fmt::format("replay {} --out {} --from 0.3 --to 0.4 --speed 0.25", session.string(), to.string()));
  EXPECT_EQ(film.exit_code, 0) << film.output;
  // 0.1 s four times as slow at 30 a second; at 15 where the processor draws. Not from the very beginning: a busy
  // machine makes its first simulation step late.
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
  small.scenario["labels"]["spacing_mm"] = 4;
  const fs::path scenario = small.write();
  const support::TemporaryFolder folder;
  const char* wanted = std::getenv("STYLET_KILLS");
  const int kills = wanted != nullptr ? std::atoi(wanted) : support::kSanitized ? 1 : 4;
  std::mt19937 random(wanted != nullptr ? std::random_device()() : 20261122);
  std::uniform_real_distribution<double> moment_s(1.2, 3);
  for (int k = 0; k < kills; ++k) {
    const fs::path out = folder / std::to_string(k);
    RunningCommand session(
        fmt::format("train {} --view headless --link 0 --out {}", scenario.string(), out.string()));
    const std::string place = session.wait_for("clients connect to 127.0.0.1:");
    ASSERT_FALSE(place.empty()) << session.output();
    Witness witness(std::stoi(place));
    ASSERT_TRUE(witness.connected());
    witness.look_on(moment_s(random));
    ASSERT_TRUE(witness.connected()) << session.output();
    session.kill();
    witness.look_on(60);  // what it had sent

    const std::vector<fs::path> left = recording::cut_off_recordings(out);
    ASSERT_EQ(left.size(), 1u) << "kill " << k;
    const Outcome replayed = run("replay " + out.string());
    EXPECT_EQ(replayed.exit_code, 0) << replayed.output;
    EXPECT_NE(replayed.output.find("identical"), std::string::npos) << replayed.output;
    EXPECT_NE(replayed.output.find("cut short"), std::string::npos) << replayed.output;
    EXPECT_GE(session_seconds(replayed.output), witness.seen_s() - 1) << replayed.output;
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
