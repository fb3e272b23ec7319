#include "engine/app/kept_attempts.h"

#include "engine/app/saved_images.h"
#include "engine/debrief/collect.h"
#include "engine/files/error.h"
#include "engine/files/output_directory.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <string_view>
#include <system_error>

namespace stylet::app {
namespace {

constexpr std::string_view kPrefix = "attempt-";

/// Number of the next folder.
int next_number(const std::filesystem::path& folder) {
  int highest = 0;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(kPrefix)) continue;
    int number = 0;
    std::from_chars(name.data() + kPrefix.size(), name.data() + name.size(), number);
    highest = std::max(highest, number);
  }
  return highest + 1;
}

std::string verdict(const debrief::DebriefAttempt& attempt) {
  if (!attempt.score) return "measured";
  if (!attempt.score->done) return "nothing was sampled or treated";
  return fmt::format("{:.0f} of 100, {}", attempt.score->total, attempt.score->passed ? "passed" : "not passed");
}

}  // namespace

debrief::DebriefAttempt attempt_of(const std::string& folder, const session::SessionReport& report,
                                   const training::TrainingReport& training) {
  debrief::DebriefAttempt attempt{.folder = folder, .duration_s = report.run.duration_s};
  if (training.score) attempt.score = debrief::score_of(*training.score);
  return attempt;
}

std::string KeptAttempts::keep(recording::UnfinishedRecording& recording, const session::SessionReport& report,
                               const training::TrainingReport& training, const scanner::SavedImages& saved) {
  const std::string name = fmt::format("{}{}", kPrefix, next_number(folder_));
  files::OutputDirectory out(folder_ / name);
  out.named_in_place([&] {
    session::write_json(out.staged("session.json"), training::with_training(session::to_json(report), training));
  });
  write_images(saved, out);
  recording.finish(out, "session.json");
  attempts_.push_back(attempt_of(name, report, training));
  return fmt::format("attempt {}: {}; it is kept in {}", attempts_.size(), verdict(attempts_.back()),
                     out.destination().string());
}

std::filesystem::path KeptAttempts::put_aside(const session::SessionReport& report,
                                              const training::TrainingReport& training) {
  const std::string name = fmt::format("{}{}", kPrefix, next_number(folder_));
  const std::filesystem::path aside = folder_ / name;
  std::vector<std::string> files{"session.rec", "force.csv", "force.png"};
  files.insert(files.end(), kDrawnFiles.begin(), kDrawnFiles.end());
  for (const session::SavedImageFacts& image : report.saved_images) files.push_back(image.file);
  files.emplace_back("session.json");  // last: while it is there, so are they
  std::error_code error;
  std::filesystem::create_directories(aside, error);
  for (const std::string& file : files) {
    if (!error && std::filesystem::exists(folder_ / file, error)) {
      std::filesystem::rename(folder_ / file, aside / file, error);
    }
  }
  if (error) {
    throw files::ContentError(
        fmt::format("{}: the attempt before cannot be moved there: {}; what is left of it is in {}", aside.string(),
                    error.message(), folder_.string()));
  }
  attempts_.push_back(attempt_of(name, report, training));
  return aside;
}

std::vector<std::filesystem::path> KeptAttempts::without_page() const {
  std::vector<std::filesystem::path> folders;
  for (const debrief::DebriefAttempt& attempt : attempts_) {
    std::error_code error;
    if (!std::filesystem::exists(folder_ / attempt.folder / "debrief.html", error))
      folders.push_back(folder_ / attempt.folder);
  }
  return folders;
}

nlohmann::ordered_json to_json(const std::vector<debrief::DebriefAttempt>& attempts) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const debrief::DebriefAttempt& attempt : attempts) {
    nlohmann::ordered_json& entry = list.emplace_back();
    entry["folder"] = attempt.folder;
    entry["duration_s"] = attempt.duration_s;
    if (!attempt.score) continue;
    entry["total"] = attempt.score->total;
    entry["done"] = attempt.score->done;
    entry["passed"] = attempt.score->passed;
    entry["failed_critical"] = attempt.score->failed_critical;
  }
  return list;
}

nlohmann::ordered_json numbers_of(const session::SessionReport& report, const training::TrainingReport& training,
                                  const KeptAttempts& before) {
  nlohmann::ordered_json json = training::with_training(session::to_json(report), training);
  if (!before.empty()) json["attempts_before"] = to_json(before.list());
  return json;
}

}  // namespace stylet::app
