// `stylet` with a HID device plugged in that is not there: mock_stylus runs the command under the real hidapi.
#include "engine/readers/motion.h"
#include "engine/recording/unfinished_recording.h"
#include "tests/readers/small_scenario.h"
#include "tests/stylet/command.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <pty.h>
#include <sys/wait.h>
#include <unistd.h>
#include <nlohmann/json.hpp>

#include <array>
#include <cmath>
#include <csignal>
#include <cstdlib>

namespace stylet {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;

class HidCommand : public testing::Test {
protected:
  void SetUp() override {
    if (support::kSanitized) GTEST_SKIP() << "the mock is preloaded, which a sanitizer's runtime does not allow";
    setenv("XDG_CONFIG_HOME", folder_.path().c_str(), 1);
  }
  void TearDown() override { unsetenv("XDG_CONFIG_HOME"); }

  /// A command of stylet with options of mock_stylus.
  static Outcome run_with(const std::string& mock, const std::string& arguments) {
    return run(fmt::format("{} '{}' {}", mock, STYLET_COMMAND, arguments), STYLET_MOCK_STYLUS);
  }
  fs::path calibration() const { return folder_.path() / "stylet" / "devices" / "1209-0001-0001.json"; }
  /// What the command itself said, on one line.
  static void expect_refused(const Outcome& outcome, std::initializer_list<const char*> words) {
    EXPECT_EQ(outcome.exit_code, 2) << outcome.output;
    const auto begin = outcome.output.find("stylet: ");
    ASSERT_NE(begin, std::string::npos) << outcome.output;
    const std::string line = outcome.output.substr(begin, outcome.output.find("\nmock_stylus:") - begin);
    EXPECT_EQ(std::ranges::count(line, '\n'), 0) << line;
    for (const char* word : words) EXPECT_THAT(line, HasSubstr(word));
  }
  void write_calibration(const std::string& text) const {
    fs::create_directories(calibration().parent_path());
    std::ofstream(calibration()) << text;
  }

  const support::TemporaryFolder folder_;
};

TEST_F(HidCommand, DevicesSayWhatAStylusCanDo) {
  const Outcome list = run_with("", "devices");
  ASSERT_EQ(list.exit_code, 0) << list.output;
  EXPECT_THAT(list.output, HasSubstr("/dev/hidraw0  1209:0001  Mocked stylus (Stylet)"));
  EXPECT_THAT(list.output, HasSubstr("stylus with force; profile \"Force stylus\""));
  EXPECT_EQ(list.output.find("not usable"), std::string::npos) << list.output;
}

TEST_F(HidCommand, WithoutPermissionTheUdevRuleIsPrinted) {
  constexpr const char* kRule =
      R"(KERNEL=="hidraw*", ATTRS{idVendor}=="1209", ATTRS{idProduct}=="0001", TAG+="uaccess")";
  const Outcome list = run_with("--refuse", "devices");
  ASSERT_EQ(list.exit_code, 0) << list.output;
  EXPECT_THAT(list.output, HasSubstr("not usable yet: no permission to open it"));
  EXPECT_THAT(list.output, HasSubstr("/etc/udev/rules.d/70-stylet.rules:\n    " + std::string(kRule) + "\n"));
  expect_refused(run_with("--refuse", "devices --calibrate"), {"/dev/hidraw0: no permission to open it", kRule});
}

TEST_F(HidCommand, DeviceOfTheVendorsOwnReportsIsRefusedWithTheReason) {
  const Outcome list = run_with("--vendor", "devices");
  ASSERT_EQ(list.exit_code, 0) << list.output;
  EXPECT_THAT(list.output, HasSubstr("not usable: it has only reports of the vendor's own kind"));
  expect_refused(run_with("--vendor", "devices --record x.json"),
                 {"--record: nothing that can lead a needle", "vendor's own kind"});
  expect_refused(run_with("", "devices --calibrate 1209:0002"), {"no such device is connected"});
  expect_refused(run_with("", "devices --calibrate 12"), {"12: is not VID:PID"});
}

TEST_F(HidCommand, CalibrationGuidesTheHandAndIsRead) {
  Outcome said;
  // A machine that keeps the command from its processor for half a second misses a place.
  for (int attempt = 0; attempt < 3 && said.exit_code != 0; ++attempt) {
    said = run_with("--corners", "devices --calibrate --hold 0.25 1209:0001");
  }
  ASSERT_EQ(said.exit_code, 0) << said.output;
  for (const char* words : {"its rest place", "near and left", "near and right", "far and right", "far and left"}) {
    EXPECT_THAT(said.output, HasSubstr(words));
  }
  const json written = json::parse(read_text(calibration()));
  EXPECT_EQ(written["format"], "stylet-calibration");
  EXPECT_EQ(written["serial_number"], "0001");
  // A place is known to half of the 3 mm that a hand may stray there.
  EXPECT_NEAR(written["scale"].get<double>(), 150.0 / 80, 150 / (80 - 1.5) - 150.0 / 80);
  EXPECT_NEAR(written["rest_mm"][1].get<double>(), 40, 0.1) << "up";
  // Standing turned by 30 degrees about its vertical, one way or the other.
  EXPECT_NEAR(std::abs(written["user_from_device"][2].get<double>()), std::sin(std::acos(-1) / 12), 0.005);
  EXPECT_NEAR(written["user_from_device"][0].get<double>(), std::cos(std::acos(-1) / 12), 0.005);
  EXPECT_EQ(run("validate '" + calibration().string() + "'").exit_code, 0);
  EXPECT_EQ(files_below(folder_.path()).size(), 1U) << "nothing half written is left";
  EXPECT_THAT(run_with("", "devices").output, HasSubstr("calibrated " + calibration().string()));
}

TEST_F(HidCommand, AnInvalidCalibrationIsReportedAndCanBeRepeated) {
  write_calibration(R"({"format": "stylet-calibration", "version": 1, "vendor_id": "1209", "product_id": "0001",
      "serial_number": "0001", "scale": 0})");
  const std::string file = calibration().string();
  expect_refused(run_with("", "devices --record x.json --seconds 0.1"),
                 {(file + ":/scale: is 0").c_str(), "run `stylet devices --calibrate`"});
  EXPECT_THAT(run_with("", "devices").output, HasSubstr("calibration not usable: " + file));
  write_calibration(R"({"format": "stylet-calibration", "version": 1, "vendor_id": "1209", "product_id": "0001",
      "serial_number": "0002"})");
  expect_refused(run_with("", "devices --record x.json --seconds 0.1"), {file.c_str(), "is of another device"});
  write_calibration("{");
  expect_refused(run_with("", "devices --record x.json --seconds 0.1"), {file.c_str()});
}

/// What haptic/README.md says of the bytes of report 1, by itself.
double le32(const std::vector<std::uint8_t>& bytes, std::size_t at) {
  const std::uint32_t raw =
      bytes[at] | bytes[at + 1] << 8U | bytes[at + 2] << 16U | static_cast<std::uint32_t>(bytes[at + 3]) << 24U;
  return static_cast<std::int32_t>(raw);
}

TEST_F(HidCommand, RecordingHoldsTheReportsAndWhatTheySay) {
  const fs::path file = folder_ / "hand.json";
  const Outcome said = run_with("--corners", fmt::format("devices --record '{}' --seconds 1.5", file.string()));
  ASSERT_EQ(said.exit_code, 0) << said.output;
  readers::RawReports raw;
  const content::Motion motion = readers::read_motion(file, &raw);
  EXPECT_EQ(raw.device, "Mocked stylus (1209:0001)");
  EXPECT_EQ(raw.frame, readers::MotionFrame::kHand);
  EXPECT_EQ(raw.report_descriptor.size(), 235U);
  ASSERT_GT(raw.reports.size(), 500U);
  ASSERT_EQ(motion.stylus.size(), raw.reports.size());
  const auto position = [&](std::size_t k) {  // right, up, near
    const std::vector<std::uint8_t>& bytes = raw.reports[k].bytes;
    return Eigen::Vector3d(1e-7 * le32(bytes, 1), -1e-7 * le32(bytes, 9), 1e-7 * le32(bytes, 5));
  };
  double farthest = 0;
  for (std::size_t k = 0; k < raw.reports.size(); ++k) {
    const content::MotionSample& sample = motion.stylus[k];
    ASSERT_LT((sample.pose.position - (position(k) - position(0))).norm(), 3e-9) << k;
    // The hand turns about the axis to the right only.
    const double angle = 1e-6 * (le32(raw.reports[k].bytes, 13) - le32(raw.reports[0].bytes, 13));
    const Eigen::Quaterniond turned(Eigen::AngleAxisd(angle, Eigen::Vector3d::UnitX()));
    ASSERT_LT(sample.pose.orientation.angularDistance(turned), 1e-7) << k;
    // Of the device's clock, 100 us a tick, against that of the host.
    ASSERT_NEAR(sample.time_s, raw.reports[k].time_s, 0.2) << k;
    farthest = std::max(farthest, sample.pose.position.norm());
  }
  EXPECT_GT(farthest, 0.01) << "the hand moves";
}

TEST_F(HidCommand, TrainIsLedByTheStylusAndByItsRecording) {
  readers::test::SmallScenario small;
  small.scenario["labels"]["spacing_mm"] = 4;
  const std::string train = fmt::format("train {} --view headless --expert none --no-film", small.write().string());
  expect_refused(run_with("", fmt::format("{} --lockstep --device hid --out {}", train, (folder_ / "none").string())),
                 {"--lockstep: a HID device moves in real time"});
  const fs::path hand = folder_ / "hand.json";
  const Outcome trained = run_with("", fmt::format("{} --device hid:1209:0001 --seconds 1 --record '{}' --out '{}'",
                                                   train, hand.string(), (folder_ / "live").string()));
  ASSERT_EQ(trained.exit_code, 0) << trained.output;
  EXPECT_THAT(trained.output, HasSubstr("Mocked stylus (1209:0001): "));
  EXPECT_THAT(trained.output, HasSubstr("enabled 1 times, disabled 1"));
  EXPECT_THAT(trained.output, HasSubstr("force now 0.000 N"));
  const json session = json::parse(read_text(folder_ / "live" / "session.json"));
  EXPECT_EQ(session["stylus"], "Mocked stylus (1209:0001)");
  EXPECT_TRUE(session["replay"]["identical"]);
  readers::RawReports raw;
  EXPECT_GT(readers::read_motion(hand, &raw).stylus.size(), 300U);
  EXPECT_EQ(raw.frame, readers::MotionFrame::kPatient);
  EXPECT_GT(raw.reports.size(), 300U);

  const fs::path recorded = folder_ / "recorded.json";
  ASSERT_EQ(run_with("", fmt::format("devices --record '{}' --seconds 0.5", recorded.string())).exit_code, 0);
  const Outcome again = run(fmt::format("{} --lockstep --device recorded:'{}' --out '{}'", train, recorded.string(),
                                        (folder_ / "again").string()));
  ASSERT_EQ(again.exit_code, 0) << again.output;
  EXPECT_EQ(json::parse(read_text(folder_ / "again" / "session.json"))["stylus"],
            "recorded stylus (" + recorded.string() + ")");
}

/// Until whoever writes into it has ended. @return what they wrote
std::string read_to_end(int pipe) {
  std::string all;
  std::array<char, 4096> piece;
  for (ssize_t size = 0; (size = read(pipe, piece.data(), piece.size())) > 0;) {
    all.append(piece.data(), static_cast<std::size_t>(size));
  }
  close(pipe);
  return all;
}

// As a window that is closed does it: the shell dies of it, the kernel tells the command, and no line it still says
// can be written.
TEST_F(HidCommand, AClosedTerminalEndsTheSessionWithoutForceAndKeepsIt) {
  readers::test::SmallScenario small;
  small.scenario["labels"]["spacing_mm"] = 4;
  const fs::path out = folder_ / "out";
  const std::string shell = fmt::format(
      "'{}' '{}' train '{}' --view headless --expert none --no-film --device hid --seconds 60 --out '{}' >&3; exit",
      STYLET_MOCK_STYLUS, STYLET_COMMAND, small.write().string(), out.string());
  std::array<int, 2> pipe_ends{};
  ASSERT_EQ(pipe(pipe_ends.data()), 0);
  int terminal = -1;
  const pid_t process = forkpty(&terminal, nullptr, nullptr, nullptr);
  ASSERT_GE(process, 0);
  if (process == 0) {
    dup2(pipe_ends[1], 3);
    std::signal(SIGHUP, SIG_DFL);  // under nohup it is ignored, and stays so
    execl("/bin/sh", "sh", "-c", shell.c_str(), nullptr);
    _exit(127);
  }
  close(pipe_ends[1]);
  std::string said;
  std::array<char, 4096> piece;
  while (said.find("Session in real time") == std::string::npos) {
    const ssize_t size = read(terminal, piece.data(), piece.size());
    if (size <= 0) break;
    said.append(piece.data(), static_cast<std::size_t>(size));
  }
  close(terminal);
  const std::string device = read_to_end(pipe_ends[0]);
  int status = -1;
  ASSERT_EQ(waitpid(process, &status, 0), process);
  EXPECT_THAT(device, HasSubstr("enabled 1 times, disabled 1")) << said;
  EXPECT_THAT(device, HasSubstr("force now 0.000 N"));
  ASSERT_TRUE(fs::exists(out / "session.json")) << device;
  const json session = json::parse(read_text(out / "session.json"));
  EXPECT_EQ(session["stylus"], "Mocked stylus (1209:0001)");
  EXPECT_TRUE(fs::exists(out / "session.rec"));
  EXPECT_TRUE(fs::exists(out / "debrief.html"));
  EXPECT_TRUE(recording::cut_off_recordings(out).empty());
}

// A limit of the shell (ulimit -f) raises SIGXFSZ: what was written until then stays, and can be debriefed.
TEST_F(HidCommand, AFileAtItsLimitEndsTheSessionWithoutForceAndKeepsTheRecording) {
  readers::test::SmallScenario small;
  small.scenario["labels"]["spacing_mm"] = 4;
  const fs::path out = folder_ / "out";
  const auto [exit_code, output] = support::run_in_shell(fmt::format(
      "bash -c \"ulimit -f 200; exec '{}' '{}' train '{}' --view headless --expert none --no-film --device hid "
      "--seconds 60 --out '{}'\" 2>&1",
      STYLET_MOCK_STYLUS, STYLET_COMMAND, small.write().string(), out.string()));
  EXPECT_EQ(exit_code, 2) << output;
  EXPECT_THAT(output, HasSubstr("could not be written whole; check the space on the disk and `ulimit -f`"));
  EXPECT_THAT(output, HasSubstr("enabled 1 times, disabled 1"));
  EXPECT_THAT(output, HasSubstr("force now 0.000 N"));
  ASSERT_EQ(recording::cut_off_recordings(out).size(), 1U) << output;
  const Outcome replayed = run("replay " + out.string());
  EXPECT_EQ(replayed.exit_code, 0) << replayed.output;
  EXPECT_THAT(replayed.output, HasSubstr("identical"));
}

TEST_F(HidCommand, AStickWhoseEffectsHaveNoEndIsUsedByNameOnly) {
  const Outcome safe = run_with("--stick", "devices");
  EXPECT_THAT(safe.output, HasSubstr("drops the force 18 ms after the host falls silent")) << safe.output;
  const Outcome list = run_with("--endless", "devices");
  EXPECT_THAT(list.output, HasSubstr("its force would stay on if the computer stopped: used only by name"));
  readers::test::SmallScenario small;
  small.scenario["labels"]["spacing_mm"] = 4;
  const std::string train =
      fmt::format("train {} --view headless --expert none --no-film --seconds 0.3 --out '{}' --device ",
                  small.write().string(), (folder_ / "out").string());
  expect_refused(run_with("--endless", train + "hid"),
                 {"--device hid: nothing that can lead a needle", "would stay on", "1209:0001 by name"});
  const Outcome named = run_with("--endless", train + "hid:1209:0001");
  EXPECT_EQ(named.exit_code, 0) << named.output;
  EXPECT_THAT(named.output,
              HasSubstr("stylet: warning: Mocked stylus (1209:0001): its force may stay on if this computer stops"));
  EXPECT_THAT(named.output, HasSubstr("motors off; force now 0.000"));
  const Outcome unasked = run_with("--stick", train + "hid");
  EXPECT_EQ(unasked.exit_code, 0) << unasked.output;
  EXPECT_THAT(unasked.output, HasSubstr("motors off; force now 0.000"));
  EXPECT_EQ(unasked.output.find("warning"), std::string::npos) << unasked.output;
}

TEST_F(HidCommand, InAWindowAStylusLeadsTheNeedleUnasked) {
  if (std::getenv("DISPLAY") == nullptr) GTEST_SKIP() << "no display";
  readers::test::SmallScenario small;
  small.scenario["labels"]["spacing_mm"] = 4;
  const Outcome trained =
      run_with("", fmt::format("train {} --view window --expert none --no-film --seconds 0.3 --out {}",
                               small.write().string(), (folder_ / "out").string()));
  EXPECT_EQ(trained.exit_code, 0) << trained.output;
  EXPECT_THAT(trained.output, HasSubstr("Mocked stylus (1209:0001) leads the needle; --device mouse: "));
  EXPECT_EQ(json::parse(read_text(folder_ / "out" / "session.json"))["stylus"], "Mocked stylus (1209:0001)");
}

}  // namespace
}  // namespace stylet
