#include "engine/lab/course/course_file.h"

#include "engine/content/metric_table.h"
#include "engine/procedures/kinds.h"

#include <fmt/format.h>

#include <algorithm>
#include <set>
#include <string_view>
#include <utility>

namespace stylet::lab::course {

namespace key = files::key;
using files::Key;

namespace {

constexpr double kClosestRates = 1.5;  // unacceptable over acceptable: closer ones no lab could tell apart
constexpr int kFewExperts = 8;

constexpr struct {
  Key acceptable = key::number("acceptable_failure_rate", "", {0.01, 0.5}, "of who is competent (p0)");
  Key unacceptable =
      key::number("unacceptable_failure_rate", "", {0.015, 0.9}, "of who is not (p1), at least 1.5 times the other");
  Key attempts = key::integer("attempts", {5, 200}, "graded ones that the error is for").otherwise(30);
  Key false_discovery =
      key::number("false_discovery", "", {0.001, 0.5},
                  "how probably who fails at the unacceptable rate passes the gate within them; the limit follows")
          .otherwise(0.05);
  Key days = key::integer("days", {1, 60}, "that the attempts lie on, at least").otherwise(2);
  Key source = key::text("source", "where the two rates come from");
} kGate;

constexpr struct {
  Key attempts = key::integer("attempts", {5, 200}, "that the error is for").otherwise(50);
  Key false_alarm =
      key::number("false_alarm", "", {0.001, 0.9},
                  "how probably who fails at the acceptable rate raises the alarm within them; the limit follows")
          .otherwise(0.2);
} kMonitoring;

constexpr struct {
  Key after_days = key::integer("after_days", {1, 3650}, "since the gate was passed");
  Key attempts = key::integer("attempts", {1, 20}, "of which the mean counts").otherwise(2);
  Key source = key::text("source", "why then").optional();
} kRetention;

constexpr struct {
  Key metric = key::text("metric", "one of the metrics below");
  Key at_most = key::number("at_most", "", {-1e9, 1e9}, "in the metric's unit").either();
  Key at_least = key::number("at_least", "", {-1e9, 1e9}, "in the metric's unit").either();
  Key method = key::choice("method",
                           files::one_of<"expert_mean", "trimmed_mean", "mean_2sd", "tolerance", "contrasting_groups",
                                         "angoff", "borderline_regression">,
                           "how it was found");
  Key people = key::integer("people", {1, 100000}, "it was found from; fewer than 8 warn");
  Key attempts = key::integer("attempts", {1, 1000000}, "of theirs").optional();
  Key date = key::text("date", "when, YYYY-MM-DD");
  Key source = key::text("source", "who they were, or where it was published");
} kBar;

constexpr struct {
  Key name = key::text("name", "unique in the course");
  Key scenario = key::file("scenario", "stylet-scenario file");
  Key after = key::texts("after", "names of earlier exercises whose gates must be passed first").optional();
  Key focus = key::text("focus", "metric that feedback begins with").optional();
  Key practice = key::integer("practice", {0, 100}, "attempts before the first that is graded").otherwise(2);
  Key gate = key::object("gate", files::table_of<kGate>,
                         "an LC-CUSUM of passed and failed attempts, whose limit is computed from these numbers");
  Key monitoring =
      key::object("monitoring", files::table_of<kMonitoring>, "after the gate: a CUSUM with the gate's rates")
          .optional();
  Key retention = key::objects("retention", files::table_of<kRetention>, "tests after a pause").optional();
  Key bars = key::objects("bars", files::table_of<kBar>,
                          "what a graded attempt must reach besides the scenario's own pass mark")
                 .optional();
} kExercise;

constexpr struct {
  Key attempts_a_day = key::integer("attempts_a_day", {1, 100}, "of an exercise, at most").optional();
  Key pause_days = key::integer("pause_days", {1, 3650}, "a longer pause is marked").otherwise(30);
  Key source = key::text("source", "why so").optional();
} kSpacing;

constexpr struct {
  Key name = key::text("name", "short, unique");
  Key title = key::text("title", "one line for people; absent: the name").optional();
  Key description = key::note("description", "for people");
  Key licence = key::kLicence;
  Key source = key::kSource;
  Key spacing = key::object("spacing", files::table_of<kSpacing>, "practice over time").optional();
  Key exercises = key::objects("exercises", files::table_of<kExercise>, "in the order of the course").count({1, 64});
} kCourse;

bool is_metric(const std::string& name) {
  return std::ranges::any_of(procedures::metric_table(),
                             [&](const content::MetricRow& row) { return row.name == name; });
}

std::string not_a_metric(const std::string& name) {
  std::set<std::string> names;
  for (const content::MetricRow& row : procedures::metric_table()) names.emplace(row.name);
  const std::string close = files::nearest(name, names);
  return fmt::format("{} is no metric; {}", name,
                     close.empty() ? "`stylet schema metrics` lists them" : fmt::format("did you mean {}?", close));
}

bool is_date(const std::string& text) {
  if (text.size() != 10) return false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (i == 4 || i == 7 ? text[i] != '-' : text[i] < '0' || text[i] > '9') return false;
  }
  const auto number = [&](std::size_t at) { return (text[at] - '0') * 10 + text[at + 1] - '0'; };
  return number(5) >= 1 && number(5) <= 12 && number(8) >= 1 && number(8) <= 31;
}

/// Reads a course: what is odd goes to the warnings.
class CourseReader {
public:
  CourseReader(files::JsonFile& file, std::vector<std::string>* warnings) : file_(file), warnings_(warnings) {}

  void warn(const files::JsonObject& object, const std::string& what) {
    if (warnings_ != nullptr) warnings_->push_back(file_.line(object.pointer(), what));
  }

  void read_gate(files::JsonObject object, Exercise& exercise) {
    const std::size_t problems = file_.problems().size();
    exercise.rates.acceptable = object.number(kGate.acceptable);
    exercise.rates.unacceptable = object.number(kGate.unacceptable);
    const int attempts = object.integer(kGate.attempts);
    const double false_discovery = object.number(kGate.false_discovery);
    exercise.days = object.integer(kGate.days);
    if (object.text(kGate.source).empty()) object.problem(kGate.source, "says nothing; name a source");
    if (file_.problems().size() == problems &&
        exercise.rates.unacceptable < kClosestRates * exercise.rates.acceptable * (1 - 1e-9)) {
      object.problem(kGate.unacceptable,
                     fmt::format("is {}, less than {} times the acceptable {}; nobody could tell "
                                 "them apart, set them further apart",
                                 exercise.rates.unacceptable, kClosestRates, exercise.rates.acceptable));
    }
    object.finish();
    if (file_.problems().size() != problems) return;
    exercise.gate = statistics::learning_gate(exercise.rates, attempts, false_discovery);
    if (exercise.gate.shortest_run > attempts) {
      object.problem(kGate.attempts, fmt::format("are too few: no limit keeps the error, the first pass of the gate "
                                                 "would come after {}; allow more attempts or more error",
                                                 exercise.gate.shortest_run));
    } else if (exercise.gate.true_discovery < 0.5) {
      warn(object, fmt::format("stops more of the competent than it passes: within {} attempts {:.0f} % pass; allow "
                               "more attempts or more error",
                               attempts, exercise.gate.true_discovery * 100));
    }
  }

  Bar read_bar(files::JsonObject& object) {
    Bar bar;
    bar.metric = object.text(kBar.metric);
    if (!bar.metric.empty() && !is_metric(bar.metric)) object.problem(kBar.metric, not_a_metric(bar.metric));
    const double at_most = object.number(kBar.at_most);
    const double at_least = object.number(kBar.at_least);
    if (object.has(kBar.at_most)) bar.at_most = at_most;
    if (object.has(kBar.at_least)) bar.at_least = at_least;
    if (bar.at_most.has_value() == bar.at_least.has_value()) {
      object.problem("", "has exactly one of at_most and at_least");
    }
    bar.method = object.choice(kBar.method);
    bar.people = object.integer(kBar.people);
    object.integer(kBar.attempts, 1);
    if (!is_date(object.text(kBar.date))) object.problem(kBar.date, "is no date; write YYYY-MM-DD");
    object.text(kBar.source);
    object.finish();
    if (bar.people < kFewExperts) {
      warn(object, fmt::format("a bar from {} people is vague; {} and more are wanted", bar.people, kFewExperts));
    }
    return bar;
  }

  Exercise read_exercise(files::JsonObject& object, const std::set<std::string>& earlier) {
    Exercise exercise;
    exercise.name = object.text(kExercise.name);
    exercise.scenario = object.file(kExercise.scenario);
    exercise.after = object.texts(kExercise.after);
    exercise.focus = object.text(kExercise.focus, "");
    exercise.practice = object.integer(kExercise.practice);
    if (earlier.contains(exercise.name)) object.problem(kExercise.name, "is taken; choose another");
    for (const std::string& name : exercise.after) {
      if (!earlier.contains(name)) {
        object.problem(kExercise.after, fmt::format("{} is no exercise before this one", name));
      }
    }
    if (!exercise.focus.empty() && !is_metric(exercise.focus)) {
      object.problem(kExercise.focus, not_a_metric(exercise.focus));
    }
    const std::size_t problems = file_.problems().size();
    if (auto gate = object.object(kExercise.gate)) read_gate(*gate, exercise);
    const bool rates_known = file_.problems().size() == problems;
    if (auto monitoring = object.object(kExercise.monitoring)) {
      Monitoring& read = exercise.monitoring.emplace();
      read.attempts = monitoring->integer(kMonitoring.attempts);
      read.false_alarm = monitoring->number(kMonitoring.false_alarm);
      monitoring->finish();
      if (rates_known && file_.problems().size() == problems) {
        read.limit = statistics::monitoring_limit(exercise.rates, read.attempts, read.false_alarm);
      }
    }
    for (files::JsonObject& test : object.objects(kExercise.retention)) {
      exercise.retention.push_back(
          {.after_days = test.integer(kRetention.after_days), .attempts = test.integer(kRetention.attempts)});
      test.text(kRetention.source, "");
      test.finish();
    }
    if (!std::ranges::is_sorted(exercise.retention, {}, &RetentionTest::after_days)) {
      object.problem(kExercise.retention, "are not in the order of their days; sort them");
    }
    for (files::JsonObject& bar : object.objects(kExercise.bars)) exercise.bars.push_back(read_bar(bar));
    object.finish();
    return exercise;
  }

private:
  files::JsonFile& file_;
  std::vector<std::string>* warnings_;
};

}  // namespace

const files::FileFormat& course_format() {
  static const files::FileFormat format{
      .name = "course",
      .title = "Exercises in order, each with a gate that its trainees pass by data, and what follows it",
      .table = files::table_of<kCourse>,
      .id = "stylet-course"};
  return format;
}

Course read_course(files::JsonFile& file, std::vector<std::string>* warnings) {
  files::JsonObject root = file.root(course_format());
  CourseReader reader(file, warnings);
  Course course;
  course.file = file.path();
  course.name = root.text(kCourse.name);
  course.title = root.text(kCourse.title, course.name);
  if (auto spacing = root.object(kCourse.spacing)) {
    course.spacing.attempts_a_day = spacing->integer(kSpacing.attempts_a_day, 0);
    course.spacing.pause_days = spacing->integer(kSpacing.pause_days);
    spacing->text(kSpacing.source, "");
    spacing->finish();
  }
  std::set<std::string> earlier;
  for (files::JsonObject& exercise : root.objects(kCourse.exercises)) {
    course.exercises.push_back(reader.read_exercise(exercise, earlier));
    earlier.insert(course.exercises.back().name);
  }
  root.finish();
  return course;
}

Course load_course(const std::filesystem::path& path) {
  files::JsonFile file(path);
  Course course = read_course(file);
  file.throw_problems();
  return course;
}

}  // namespace stylet::lab::course
