#include "engine/app/lab_pages.h"

#include "engine/app/build_name.h"
#include "engine/app/course_standing.h"
#include "engine/files/output_directory.h"
#include "engine/lab/page/page.h"
#include "engine/lab/store/identity.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <set>
#include <span>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace stylet::app {

namespace fs = std::filesystem;

namespace {

lab::page::TraineeView view_of(CourseStanding standing, lab::store::Person person, bool names,
                               std::vector<lab::store::AttemptRecord> attempts) {
  lab::page::TraineeView view;
  view.person = std::move(person);
  if (!names) view.person.name.clear();
  view.attempts = std::move(attempts);
  view.exercises = std::move(standing.exercises);
  view.at_earlier_versions = std::move(standing.at_earlier_versions);
  view.counted = std::move(standing.counted);
  view.passed = std::move(standing.passed);
  view.due = standing.due;
  return view;
}

/// What has a bar in the course: metrics by attempt.
std::map<std::string, std::vector<lab::store::MetricResult>> metrics_with_bar(lab::store::Lab& lab,
                                                                              const lab::course::Course& course,
                                                                              std::span<const std::string> versions) {
  std::map<std::string, std::vector<lab::store::MetricResult>> metrics;
  for (std::size_t e = 0; e < course.exercises.size(); ++e) {
    std::set<std::string> names;
    for (const lab::course::Bar& bar : course.exercises[e].bars) names.insert(bar.metric);
    // Of a scenario that two exercises use an attempt's metrics come twice.
    for (auto& [attempt, measured] : lab.metrics_at(versions[e], names)) {
      std::ranges::move(measured, std::back_inserter(metrics[attempt]));
    }
  }
  return metrics;
}

}  // namespace

lab::page::TraineeView lab_view(lab::store::Lab& lab, const lab::course::Course& course, lab::store::Person person,
                                bool names, std::int64_t now_ms) {
  const std::string id = person.id;
  auto attempts = lab.attempts(id);
  auto metrics = lab.all_metrics(id);
  CourseStanding standing = standing_of(course, scenario_versions(course), attempts, metrics, local_day(now_ms));
  lab::page::TraineeView view = view_of(std::move(standing), std::move(person), names, std::move(attempts));
  view.metrics = std::move(metrics);
  view.notes = lab.notes(id);
  view.consents = lab.consents(id);
  if (const auto days = lab.retention_days(); days && !view.attempts.empty()) {
    constexpr std::int64_t kMsOfDay = 86'400'000;
    view.kept_until_ms = view.attempts.back().started_ms + *days * kMsOfDay;
  }
  return view;
}

std::vector<lab::page::TraineeView> cohort_views(lab::store::Lab& lab, const lab::course::Course& course, bool names,
                                                 std::int64_t now_ms) {
  // A few queries of all, not some of each: a cohort's attempts are ten thousand, their metrics thirty times as many.
  std::map<std::string, std::vector<lab::store::AttemptRecord>> attempts;
  for (lab::store::AttemptRecord& attempt : lab.attempts()) {
    attempts[attempt.pseudonym].push_back(std::move(attempt));
  }
  const std::vector<std::string> versions = scenario_versions(course);
  const auto metrics = metrics_with_bar(lab, course, versions);
  std::vector<lab::page::TraineeView> views;
  for (lab::store::Person& person : lab.everybody()) {
    auto& own = attempts[person.pseudonym];
    CourseStanding standing = standing_of(course, versions, own, metrics, local_day(now_ms));
    views.push_back(view_of(std::move(standing), std::move(person), names, std::move(own)));
  }
  return views;
}

std::filesystem::path write_lab_pages(lab::store::Lab& lab, const lab::course::Course& course, bool names,
                                      const fs::path& out) {
  const std::int64_t now = lab::store::system_ms();
  const std::vector<lab::page::TraineeView> views = cohort_views(lab, course, names, now);
  const lab::page::PageFacts facts{.build = build_name(), .made_ms = now};
  files::OutputDirectory folder(out);
  std::vector<std::string> earlier{"index.html"};
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(out, error)) {
    if (entry.path().extension() == ".html" && lab::store::is_pseudonym(entry.path().stem().string())) {
      earlier.push_back(entry.path().filename());
    }
  }
  folder.supersede(std::move(earlier));
  for (const lab::page::TraineeView& one : views) {
    lab::page::TraineeView view = lab_view(lab, course, one.person, names, now);
    if (!names) view.notes.clear();  // what is written freely names people, and so do those who wrote it
    folder.write(one.person.pseudonym + ".html", lab::page::trainee_page(course, view, facts));
  }
  folder.write("index.html", lab::page::cohort_page(course, views, facts));
  folder.commit("index.html");
  lab.note("page", course.name);
  return folder.destination() / "index.html";
}

}  // namespace stylet::app
