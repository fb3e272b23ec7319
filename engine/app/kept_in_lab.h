// What a session leaves in the records of the lab: an attempt from when its procedure begins, its numbers at the end.
#pragma once

#include "engine/app/observer.h"
#include "engine/app/run_session.h"
#include "engine/content/scene.h"
#include "engine/lab/store/lab.h"
#include "engine/lab/store/station.h"
#include "engine/recording/recording.h"
#include "engine/session/live_session.h"
#include "engine/session/session_report.h"
#include "engine/training/training_report.h"
#include "engine/training/training_session.h"

#include <filesystem>
#include <future>
#include <memory>
#include <optional>
#include <string>

namespace stylet::app {

// What of a scenario and of its numbers the records have.
lab::store::Subject subject_of(const content::Scene& scene);
lab::store::AttemptEnd attempt_numbers(const training::TrainingReport& training);
/// The course, in which the scenario is. @throws files::ContentError
lab::store::Subject course_with(const std::string& named, const std::filesystem::path& scenario);

/// Puts on record that the session ends before its end. While `live` still records, before course.end().
void mark_broken_off(session::LiveSession& live, training::TrainingSession& course);
/// Whether a recording says so, or that the trainee began anew.
bool broken_off(const recording::Recording& recording);

/// The records, open for one trainee: this computer's own files, whether or not the lab has a server.
struct TraineeRecords {
  lab::store::Station station;
  lab::store::Lab& lab = *station.own;
  lab::store::Person person{};
  std::optional<lab::store::Subject> course{};
};

/// Everything that can be refused is refused before a patient is loaded. A new name is enrolled, and said.
/// @param scenario  as a user names it; one of the course's
/// @return null: no trainee is named
/// @throws files::ContentError
std::unique_ptr<TraineeRecords> open_records(const TraineeSettings& settings, const std::string& scenario,
                                             Observer& observer);

/// Gives the lab's server, where there is one, what the session left; a server that is away is said in one line.
void hand_over_after(const TraineeSettings& settings, Observer& observer);

/// Main thread; the beginning is written by another, which it waits for at the end.
class LabAttempt {
public:
  struct Facts {
    std::string stylus{};
    bool by_hand = false;  ///< somebody leads the needle; else it is a demonstration, which counts for nothing
    std::string loop_mode{};
  };
  /// Keeps a reference to the records.
  LabAttempt(TraineeRecords& records, const content::Scene& scene, Facts facts);

  /// The briefing is left.
  void begin();
  /// Waits until the beginning is written or has failed, which end() does by itself.
  void wait() const { attempt_.wait(); }
  /// Never throws: what follows a session goes on.
  /// @param to_its_end  else it was broken off
  /// @return why it is not kept, a sentence; empty: it is, or it never began
  std::string end(const session::SessionReport& report, const training::TrainingReport& training, bool to_its_end,
                  const std::filesystem::path& recording);

private:
  TraineeRecords& records_;
  lab::store::AttemptStart start_;
  std::future<std::string> attempt_;  // its id; not valid: it has not begun
};

}  // namespace stylet::app
