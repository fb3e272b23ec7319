// `stylet course`: what a trainee is due in a course, and the session for it.
#include "engine/app/build_name.h"
#include "engine/app/course_standing.h"
#include "engine/files/json_scan.h"
#include "engine/lab/course/course_file.h"
#include "engine/lab/store/lab.h"
#include "engine/lab/store/station.h"
#include "tools/stylet/commands.h"
#include "tools/stylet/terminal.h"
#include "tools/stylet/train.h"

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <cstddef>
#include <cstdint>
#include <ctime>
#include <memory>
#include <string>

namespace stylet::tools {

namespace {

struct CourseRequest {
  std::string action;
  TrainOptions options{};
};

std::string date_of(std::int64_t day) {
  return fmt::format("{:%Y-%m-%d}", fmt::gmtime(static_cast<std::time_t>(day * 86'400)));
}

/// Why nothing is due, and when something will be.
void say_nothing_is_due(const lab::course::Course& course, const app::CourseStanding& standing) {
  for (std::size_t e = 0; e < course.exercises.size(); ++e) {
    const lab::course::ExerciseProgress& progress = standing.exercises[e];
    if (progress.enough_today) {
      say(stdout, "  {}: enough for today, {} attempts; come again tomorrow\n",
          files::one_line(course.exercises[e].name), course.spacing.attempts_a_day);
    } else if (progress.retention_day) {
      say(stdout, "  {}: retention test from {}\n", files::one_line(course.exercises[e].name),
          date_of(*progress.retention_day));
    }
  }
}

int run(const CourseRequest& request) {
  TrainOptions options = request.options;
  app::TraineeSettings& trainee = options.session.trainee;
  const lab::course::Course course = lab::course::load_course(lab::course::find_course(trainee.course));
  app::CourseStanding standing;
  {
    // Closed again before the session, which has it open by itself.
    lab::store::Station station = lab::store::open_station(
        {.folder = trainee.lab.empty() ? lab::store::default_lab_folder() : trainee.lab, .build = app::build_name()});
    const lab::store::Person person = station.enrolled(trainee.name);
    if (!station.away.empty()) {
      say(stderr, "stylet: what is due is told by the attempts on this computer alone: {}\n", station.away);
    }
    lab::store::Lab& lab = station.lab();
    if (person.added) {
      say(stdout, "{} is new in {}, with the pseudonym {}\n", files::one_line(trainee.name), lab.folder().string(),
          person.pseudonym);
    }
    trainee.name = person.pseudonym;
    standing = app::standing_of(lab, station.in_lab(person), course, app::local_day(lab::store::system_ms()));
  }
  if (!standing.due) {
    say(stdout, "Nothing of {} is due today.\n", files::one_line(course.title));
    say_nothing_is_due(course, standing);
    return kExitNo;
  }
  const lab::course::Exercise& next = course.exercises[*standing.due];
  const lab::course::ExerciseProgress& progress = standing.exercises[*standing.due];
  say(stdout, "{}, because: {} ({}){}\n", files::one_line(next.name), lab::course::why_due(progress),
      lab::course::progress_words(next, progress),
      progress.after_pause ? "; after a pause: the first attempts may be worse" : "");
  if (request.action == "next") return kExitYes;
  options.session.scenario = next.scenario.string();
  return run_training(options);
}

}  // namespace

void add_course(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("course", "The next exercise of a course that a trainee is due");
  auto request = std::make_shared<CourseRequest>();
  app::TraineeSettings& trainee = request->options.session.trainee;
  command->add_option("ACTION", request->action, "run: opens it; next: says alone what it is, and why")
      ->check(CLI::IsMember({"run", "next"}))
      ->required();
  command->add_option("COURSE", trainee.course, "A name in content/courses, or a file")->required();
  command->add_option("--trainee", trainee.name, "Name or pseudonym, as of `stylet train`")
      ->check([](const std::string& name) { return name.empty() ? std::string("names nobody") : std::string(); })
      ->required();
  command->add_option("--lab", trainee.lab, kLabHelp);
  add_session_options(*command, request->options);
  command->footer(
      "What is due, by the attempts that count: an exercise whose failures have mounted up after its gate, else a\n"
      "retention test whose day has come, else the first that is open, its gate not passed and not enough for "
      "today.\n"
      "The other options are those of `stylet train`.\n\n"
      "  stylet course run needle_basics --trainee ada     the session\n"
      "  stylet course next needle_basics --trainee ada    only what it would be\n\n"
      "Exit code 0: done; 1: nothing is due today, or the replay differs; 2: bad input.");
  command->callback([request, &exit_code] { exit_code = run(*request); });
}

}  // namespace stylet::tools
