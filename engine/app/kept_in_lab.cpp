#include "engine/app/kept_in_lab.h"

#include "engine/app/build_name.h"
#include "engine/files/error.h"
#include "engine/files/json_reader.h"
#include "engine/lab/course/course_file.h"
#include "engine/lab/store/digest.h"
#include "engine/readers/scenario.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdint>
#include <exception>
#include <string_view>
#include <utility>
#include <vector>

namespace stylet::app {

namespace fs = std::filesystem;
namespace store = lab::store;

namespace {

constexpr std::size_t kLongestCourse = 4u << 20;       // bytes
constexpr std::string_view kBrokenOff = "broken_off";  // event

/// Of a scenario: what it gives points for.
std::string scoring_of(const content::Scene& scene) {
  nlohmann::ordered_json json;
  json["pass_mark"] = scene.pass_mark;
  json["criteria"] = nlohmann::ordered_json::array();
  for (const content::Criterion& criterion : scene.scoring) {
    json["criteria"].push_back({{"metric", criterion.metric},
                                {"weight", criterion.weight},
                                {"full", criterion.full},
                                {"zero", criterion.zero},
                                {"critical", criterion.critical}});
  }
  return json.dump();
}

std::vector<store::MetricResult> results_of(const training::TrainingReport& training) {
  std::vector<store::MetricResult> results;
  for (const training::Metric& metric : training.metrics) {
    store::MetricResult& result = results.emplace_back();
    result.metric = metric.key;
    result.value = metric.value;
    if (!training.score) continue;
    for (const training::ScoreLine& line : training.score->lines) {
      if (line.criterion.metric != metric.key) continue;
      result.points = result.points.value_or(0) + line.points;
      result.most = result.most.value_or(0) + line.most;
    }
  }
  return results;
}

store::LabSettings station_settings(const TraineeSettings& settings) {
  return {.folder = settings.lab.empty() ? store::default_lab_folder() : settings.lab, .build = build_name()};
}

void say_station(const store::Station& station, Observer& observer) {
  if (!station.away.empty()) {
    observer.note(Note::notice,
                  fmt::format("attempts stay on this computer until the lab's server is there: {}", station.away));
  } else if (station.server) {
    const std::string words = store::handed_over_words(station.handed_over, station.server->database().place());
    if (!words.empty()) observer.note(Note::info, words);
  }
}

}  // namespace

void mark_broken_off(session::LiveSession& live, training::TrainingSession& course) {
  const auto& now = course.watch().latest().now;
  live.add_event({.time_s = now.time_s, .step = now.haptic_step, .name = std::string(kBrokenOff)});
}

bool broken_off(const recording::Recording& recording) {
  return std::ranges::any_of(recording.events, [](const recording::EventRecord& event) {
    return event.name == kBrokenOff || event.name == training::flow_event::kReset;
  });
}

store::Subject course_with(const std::string& named, const fs::path& scenario) {
  const fs::path file = lab::course::find_course(named);
  const lab::course::Course course = lab::course::load_course(file);
  std::vector<std::string> names;
  for (const lab::course::Exercise& exercise : course.exercises) names.push_back(exercise.scenario.stem());
  std::error_code error;
  if (std::ranges::none_of(course.exercises, [&](const lab::course::Exercise& exercise) {
        return fs::equivalent(exercise.scenario, scenario, error);
      })) {
    throw files::ContentError(fmt::format("the course {} has no exercise of {}; it has {}", course.name,
                                          scenario.string(), fmt::join(names, ", ")));
  }
  const std::string spec = files::read_file(file, kLongestCourse);
  return {.sha256 = store::sha256(spec), .name = course.name, .title = course.title, .text = spec};
}

store::Subject subject_of(const content::Scene& scene) {
  return {.sha256 = store::sha256_of_file(scene.scenario),
          .name = scene.scenario.stem(),
          .title = scene.name,
          .text = scoring_of(scene)};
}

store::AttemptEnd attempt_numbers(const training::TrainingReport& training) {
  store::AttemptEnd end{.metrics = results_of(training)};
  if (const auto& score = training.score) {
    end.total = score->total;
    end.pass_mark = score->pass_mark;
    end.passed = score->passed;
    std::vector<std::string> failed;
    for (const training::ScoreLine& line : score->lines) {
      if (line.failed) failed.push_back(line.criterion.metric);
    }
    end.failed_critical = fmt::format("{}", fmt::join(failed, " "));
  }
  return end;
}

std::unique_ptr<TraineeRecords> open_records(const TraineeSettings& settings, const std::string& scenario,
                                             Observer& observer) {
  if (settings.name.empty()) return nullptr;
  std::optional<store::Subject> course;
  if (!settings.course.empty()) course = course_with(settings.course, readers::find_scenario(scenario));
  std::unique_ptr<TraineeRecords> records(
      new TraineeRecords{.station = store::open_station(station_settings(settings))});
  records->person = records->station.enrolled(settings.name);
  records->course = std::move(course);
  if (records->person.added) {
    observer.note(Note::notice, fmt::format("{} is new in {}, with the pseudonym {}", settings.name,
                                            records->lab.folder().string(), records->person.pseudonym));
  }
  say_station(records->station, observer);
  records->station.server.reset();  // nobody waits at it while the session lasts
  return records;
}

void hand_over_after(const TraineeSettings& settings, Observer& observer) {
  try {
    say_station(store::open_station(station_settings(settings)), observer);
  } catch (const files::ContentError& error) {
    observer.note(Note::notice, error.what());
  }
}

LabAttempt::LabAttempt(TraineeRecords& records, const content::Scene& scene, Facts facts)
    : records_(records),
      start_{.trainee = records.person.id,
             .scenario = subject_of(scene),
             .course = records.course,
             // Time that waits for the pictures is slower than a patient's.
             .mode = !facts.by_hand                  ? "guided"
                     : facts.loop_mode == "lockstep" ? "practice"
                                                     : "graded",
             .build = build_name(),
             .stylus = std::move(facts.stylus),
             .loop_mode = std::move(facts.loop_mode)} {}

void LabAttempt::begin() {
  // A commit waits for the disk: the pictures do not.
  attempt_ = std::async(std::launch::async, [this] { return records_.lab.begin(start_); });
}

std::string LabAttempt::end(const session::SessionReport& report, const training::TrainingReport& training,
                            bool to_its_end, const fs::path& recording) {
  if (!attempt_.valid()) return {};
  try {
    std::string attempt;
    try {
      attempt = attempt_.get();
    } catch (const files::ContentError&) {  // locked then, or no room: once more, now that there is a result
      attempt = records_.lab.begin(start_);
    }
    store::AttemptEnd end = attempt_numbers(training);
    end.status = to_its_end ? "ended" : "aborted";
    end.missed_deadlines = static_cast<std::int64_t>(report.run.haptic.missed_deadlines);
    end.state_hash = session::hash_text(report.state_hash);
    end.recording = recording;
    std::string problem;
    try {
      problem = records_.lab.end(attempt, end);
    } catch (const files::ContentError& error) {
      // No room for both, or another program wrote: what ended is no failure for that.
      problem = error.what();
      end.recording.clear();
      records_.lab.end(attempt, end);
    }
    if (problem.empty()) return {};
    return fmt::format("the attempt is in the lab's records without its recording: {}", problem);
  } catch (const std::exception& error) {
    return fmt::format("the attempt is not in the lab's records: {}", error.what());
  }
}

}  // namespace stylet::app
