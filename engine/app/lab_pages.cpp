#include "engine/app/lab_pages.h"

#include "engine/app/build_name.h"
#include "engine/app/course_standing.h"
#include "engine/files/output_directory.h"
#include "engine/lab/page/page.h"
#include "engine/lab/store/identity.h"

#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace stylet::app {

namespace fs = std::filesystem;

lab::page::TraineeView lab_view(lab::store::Lab& lab, const lab::course::Course& course, lab::store::Person person,
                                bool names, std::int64_t now_ms) {
  lab::page::TraineeView view;
  CourseStanding standing = standing_of(lab, person, course, local_day(now_ms));
  view.attempts = lab.attempts(person.id);
  view.metrics = lab.all_metrics(person.id);
  view.notes = lab.notes(person.id);
  view.person = std::move(person);
  if (!names) view.person.name.clear();
  view.exercises = std::move(standing.exercises);
  view.at_earlier_versions = std::move(standing.at_earlier_versions);
  view.counted = std::move(standing.counted);
  view.passed = std::move(standing.passed);
  view.due = standing.due;
  return view;
}

std::vector<lab::page::TraineeView> lab_views(lab::store::Lab& lab, const lab::course::Course& course, bool names,
                                              std::int64_t now_ms) {
  std::vector<lab::page::TraineeView> views;
  for (lab::store::PersonSummary& summary : lab.people()) {
    views.push_back(lab_view(lab, course, std::move(summary.person), names, now_ms));
  }
  return views;
}

std::filesystem::path write_lab_pages(lab::store::Lab& lab, const lab::course::Course& course, bool names,
                                      const fs::path& out) {
  const std::int64_t now = lab::store::system_ms();
  std::vector<lab::page::TraineeView> views = lab_views(lab, course, names, now);
  if (!names) {  // what is written freely names people, and so do those who wrote it
    for (lab::page::TraineeView& view : views) view.notes.clear();
  }
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
  for (const lab::page::TraineeView& view : views) {
    folder.write(view.person.pseudonym + ".html", lab::page::trainee_page(course, view, facts));
  }
  folder.write("index.html", lab::page::cohort_page(course, views, facts));
  folder.commit("index.html");
  lab.note("page", course.name);
  return folder.destination() / "index.html";
}

}  // namespace stylet::app
