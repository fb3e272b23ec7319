// Attempts before the one that a session ends with: what "Try again" leaves of each.
#pragma once

#include "engine/debrief/debrief_data.h"
#include "engine/recording/unfinished_recording.h"
#include "engine/scanner/saved_image.h"
#include "engine/session/session_report.h"
#include "engine/training/training_report.h"

#include <nlohmann/json.hpp>

#include <array>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

namespace stylet::app {

/// Files that are drawn after a session, which has its numbers already.
inline constexpr std::array kDrawnFiles{"session.mp4",  "session.png",  "view.png",    "ultrasound.png",
                                        "debrief.html", "debrief.json", "debrief.csv", "path.csv"};

/// Each in a folder of its own beside the results of the session, OUT/attempt-N, as soon as the trainee begins anew:
/// of one that was broken off session.rec and session.json, of one that was over all that was made of it. N counts on
/// from those that earlier sessions left there.
class KeptAttempts {
public:
  /// @param folder  OUT
  explicit KeptAttempts(std::filesystem::path folder) : folder_(std::move(folder)) {}

  /// Moves the recording and its numbers there, and the images that the trainee saved. @return what to tell the
  /// trainee, one line
  /// @throws files::ContentError
  std::string keep(recording::UnfinishedRecording& recording, const session::SessionReport& report,
                   const training::TrainingReport& training, const scanner::SavedImages& saved = {});

  /// Moves the results that lie in OUT there: the attempt they are of was over, and another begins.
  /// @return its folder. @throws files::ContentError
  std::filesystem::path put_aside(const session::SessionReport& report, const training::TrainingReport& training);

  bool empty() const { return attempts_.empty(); }
  /// As the debrief lists them.
  const std::vector<debrief::DebriefAttempt>& list() const { return attempts_; }
  /// Folders of those that have no debrief yet.
  std::vector<std::filesystem::path> without_page() const;

private:
  std::filesystem::path folder_;
  std::vector<debrief::DebriefAttempt> attempts_;
};

/// An attempt as the debrief lists it. @param folder  empty: the session's own
debrief::DebriefAttempt attempt_of(const std::string& folder, const session::SessionReport& report,
                                   const training::TrainingReport& training);

/// For session.json.
nlohmann::ordered_json to_json(const std::vector<debrief::DebriefAttempt>& attempts);

/// What session.json of an attempt holds. @param before  it, in the same session
nlohmann::ordered_json numbers_of(const session::SessionReport& report, const training::TrainingReport& training,
                                  const KeptAttempts& before);

}  // namespace stylet::app
