#include "engine/files/html.h"
#include "engine/lab/page/page_parts.h"
#include "engine/lab/store/export.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

namespace stylet::lab::page {

using files::html::escaped;

namespace {

void append_cell(std::string& html, const course::Exercise& exercise, const TraineeView& trainee, std::size_t e) {
  const course::ExerciseProgress& progress = trainee.exercises[e];
  const StandingMark mark = mark_of(progress.standing);
  const auto passed = std::ranges::count(trainee.passed[e], true);
  fmt::format_to(std::back_inserter(html), R"(<td class="{}" title="{}"><b>{}</b>{}</td>)", mark.name,
                 escaped(course::progress_words(exercise, progress)), mark.symbol,
                 trainee.counted[e].empty() ? std::string("&ndash;")
                                            : fmt::format("{} of {} passed", passed, trainee.counted[e].size()));
}

/// What of a trainee wants attention, in words.
std::string next_of(const course::Course& course, const TraineeView& trainee) {
  if (!trainee.due) return "nothing today";
  const course::Exercise& exercise = course.exercises[*trainee.due];
  const course::ExerciseProgress& progress = trainee.exercises[*trainee.due];
  return fmt::format("{}: {}{}", isolated(exercise.name), course::why_due(progress),
                     progress.after_pause ? ", after a pause" : "");
}

}  // namespace

std::string cohort_page(const course::Course& course, std::span<const TraineeView> trainees, const PageFacts& facts) {
  std::string html = page_begin(course.title);
  auto out = std::back_inserter(html);
  fmt::format_to(out,
                 R"(<header><p class="brand">Stylet lab</p><h1>{}</h1><p class="facts">{} trainees</p></header>)"
                 "\n<main><section><h2 id=\"where\">Who stands where</h2><p class=\"hint\">Attempts that count: "
                 "begun, graded, not "
                 "excluded; who broke off has failed. Pointing at a cell says more.</p><div class=\"scroll\" "
                 "tabindex=\"0\" role=\"region\" "
                 "aria-labelledby=\"where\"><table class=\"map\"><thead><tr><th scope=\"col\">Trainee</th>",
                 isolated(course.title), trainees.size());
  for (const course::Exercise& exercise : course.exercises) {
    fmt::format_to(out, R"(<th scope="col" title="{}">{}</th>)", escaped(course::gate_words(exercise)),
                   isolated(exercise.name));
  }
  html += "</tr></thead><tbody>\n";
  for (const TraineeView& trainee : trainees) {
    fmt::format_to(out, R"(<tr><th scope="row"><a href="{}.html">{}</a></th>)", escaped(trainee.person.pseudonym),
                   name_of(trainee.person));
    for (std::size_t e = 0; e < course.exercises.size(); ++e) append_cell(html, course.exercises[e], trainee, e);
    html += "</tr>\n";
  }
  html += "</tbody></table></div><ul class=\"legend\">";
  for (const course::Standing standing :
       {course::Standing::locked, course::Standing::practising, course::Standing::graded, course::Standing::competent,
        course::Standing::alarm}) {
    const StandingMark mark = mark_of(standing);
    fmt::format_to(out, "<li>{} {}</li>", mark.symbol, mark.word);
  }
  html +=
      "</ul></section>\n<section><h2 id=\"due\">What is due</h2><div class=\"scroll\" tabindex=\"0\" "
      "role=\"region\" aria-labelledby=\"due\"><table><thead><tr><th "
      "scope=\"col\">Trainee</th><th scope=\"col\">Next</th><th scope=\"col\">Attempts</th><th scope=\"col\">Last "
      "attempt</th><th scope=\"col\">Retention test from</th></tr></thead><tbody>\n";
  for (const TraineeView& trainee : trainees) {
    std::optional<std::int64_t> test;
    for (const course::ExerciseProgress& progress : trainee.exercises) {
      if (progress.retention_day && (!test || *progress.retention_day < *test)) test = progress.retention_day;
    }
    const store::AttemptRecord* last = trainee.attempts.empty() ? nullptr : &trainee.attempts.back();
    fmt::format_to(
        out,
        R"(<tr><th scope="row">{}</th><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>)"
        "\n",
        name_of(trainee.person), next_of(course, trainee), trainee.attempts.size(),
        last != nullptr ? store::local_text(last->started_ms, last->utc_offset_min).substr(0, 10) : "&ndash;",
        test ? date_of(*test) : "&ndash;");
  }
  html += "</tbody></table></div></section>\n<section><h2>The gates</h2><table><tbody>\n";
  for (const course::Exercise& exercise : course.exercises) {
    fmt::format_to(out,
                   R"(<tr><th scope="row">{}</th><td>{}</td></tr>)"
                   "\n",
                   isolated(exercise.name), escaped(course::gate_words(exercise)));
  }
  html += "</tbody></table></section></main>\n";
  return html + page_end(facts);
}

}  // namespace stylet::lab::page
