#include "engine/app/take_recording.h"

#include "engine/app/kept_in_lab.h"
#include "engine/app/replay.h"
#include "engine/files/error.h"
#include "engine/files/json_reader.h"
#include "engine/recording/unfinished_recording.h"
#include "engine/session/session_report.h"
#include "engine/training/training_report.h"

#include <sys/stat.h>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <utility>

namespace stylet::app {

namespace fs = std::filesystem;
namespace store = lab::store;

namespace {

constexpr std::size_t kLongestNumbers = 64u << 20;  // bytes

/// As they are when they have been written and read: the same bits.
nlohmann::json numbers_json(const training::TrainingReport& training) {
  return nlohmann::json::parse(training::with_training(nlohmann::ordered_json::object(), training).dump());
}

/// @return whether there are numbers to compare with. @throws files::ContentError  they differ
bool compare(const fs::path& recording, const training::TrainingReport& training) {
  const fs::path file = recording.parent_path() / "session.json";
  std::error_code error;
  if (!fs::exists(file, error)) return false;
  const nlohmann::json said = nlohmann::json::parse(files::read_file(file, kLongestNumbers), nullptr, false);
  if (!said.is_object()) throw files::ContentError(file.string() + ": is no session.json; take it away, or mend it");
  const nlohmann::json measured = numbers_json(training);
  for (const char* part : {"metrics", "score"}) {
    const auto there = said.find(part);
    const auto here = measured.find(part);
    const bool both = there != said.end() && here != measured.end();
    if (both ? *there == *here : (there == said.end()) == (here == measured.end())) continue;
    throw files::ContentError(
        fmt::format("{}: its {} is not what the recording gives; it was changed, or made by "
                    "another version of the scenario or of Stylet; nothing is kept",
                    file.string(), part));
  }
  return true;
}

std::int64_t written_ms(const fs::path& file) {
  struct stat about {};
  if (::stat(file.c_str(), &about) != 0) return store::system_ms();
  return std::int64_t{about.st_mtim.tv_sec} * 1000 + about.st_mtim.tv_nsec / 1'000'000;
}

}  // namespace

TakenRecording take_recording(store::Lab& lab, const store::Person& person, const TakeSettings& settings,
                              Observer& observer) {
  const fs::path file = recording::find_recording(settings.recording);
  RecordedSession session = open_recording(file.string(), {}, observer);
  const session::RecordedSettings recorded = session::recorded_settings(session.recording);
  if (!session.recording.complete()) {
    throw files::ContentError(fmt::format("{}: is not whole ({}); only a whole one is taken in", file.string(),
                                          session.recording.condition()));
  }
  const bool demonstration = recorded.device.starts_with("recorded stylus");
  if (settings.graded && (demonstration || recorded.mode != "threaded")) {
    throw files::ContentError(fmt::format("{}: is {}, which is not graded; leave --graded out", file.string(),
                                          demonstration ? "a demonstration" : "a lockstep session"));
  }
  store::AttemptStart start{.trainee = person.id,
                            .scenario = subject_of(session.scene),
                            .mode = settings.graded ? "graded"
                                    : demonstration ? "guided"
                                                    : "practice",
                            .build = session.recording.header.build,
                            .stylus = recorded.device,
                            .loop_mode = recorded.mode};
  if (!settings.course.empty()) start.course = course_with(settings.course, session.scene.scenario);
  const double duration_s = session.duration_s();
  Replay replay(std::move(session), observer);
  replay.run();
  if (replay.result().divergence || replay.result().compared == 0) {
    throw files::ContentError(fmt::format(
        "{}: the replay {}; the same bits need the same binary, libraries and kind of CPU (recorded by "
        "{}); nothing is kept",
        file.string(), replay.result().divergence ? "differs" : "has nothing to compare with", start.build));
  }
  const training::TrainingReport training = replay.training();
  TakenRecording taken{.compared = compare(file, training)};
  store::AttemptEnd end = attempt_numbers(training);
  if (broken_off(replay.recording())) end.status = "aborted";
  end.state_hash = session::hash_text(replay.state_hash());
  end.recording = file;
  taken.total = end.total;
  taken.passed = end.passed;
  taken.broken_off = end.status == "aborted";
  const std::int64_t ended_ms = std::min(written_ms(file), store::system_ms());
  taken.attempt = lab.take_in(start, end, ended_ms - static_cast<std::int64_t>(duration_s * 1000), ended_ms);
  return taken;
}

}  // namespace stylet::app
