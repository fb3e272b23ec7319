#include "engine/content/metric_table.h"
#include "engine/figures/svg_plot.h"
#include "engine/files/html.h"
#include "engine/lab/page/page_parts.h"
#include "engine/lab/statistics/learning_curve.h"
#include "engine/lab/statistics/proportion.h"
#include "engine/lab/store/export.h"
#include "engine/procedures/kinds.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <string_view>
#include <utility>

namespace stylet::lab::page {

using figures::SvgLine;
using figures::SvgPlot;
using files::html::escaped;
using statistics::CurveShape;

namespace {

const content::MetricRow* find_metric(const std::string& name) {
  const auto table = procedures::metric_table();
  const auto found = std::ranges::find_if(table, [&](const content::MetricRow& row) { return row.name == name; });
  return found != table.end() ? &*found : nullptr;
}

/// What is fitted: of times, paths and counts + 1 the logarithm, whose scatter does not shrink with the value.
struct FitScale {
  bool logarithmic = false;
  double offset = 0;
  double to(double value) const { return logarithmic ? std::log(value + offset) : value; }
  double from(double fitted) const { return logarithmic ? std::exp(fitted) - offset : fitted; }
};

FitScale scale_of(const content::MetricRow& metric, const std::vector<double>& values) {
  const double offset = metric.unit.empty() ? 1 : 0;
  const bool positive = std::ranges::all_of(values, [&](double value) { return value + offset > 0; });
  const bool of_logarithms = metric.unit.empty() || metric.unit == "s" || metric.unit == "mm";
  return {.logarithmic = of_logarithms && positive, .offset = offset};
}

/// From the attempt `from` on, over `to`.
SvgLine level(const char* name, std::string label, double y, double from, double to) {
  return {.name = name, .label = std::move(label), .x = {from, to}, .y = {y, y}, .dashed = true};
}

std::string point_title(const store::AttemptRecord& attempt, bool passed) {
  return fmt::format("attempt {}, {}: {}{}{}", attempt.number,
                     store::local_text(attempt.started_ms, attempt.utc_offset_min), result_of(attempt),
                     attempt.total ? fmt::format(", {:.0f} points", *attempt.total) : "",
                     attempt.succeeded() && !passed ? ", a bar of the course is missed" : "");
}

/// The sums of the gate, or of the alarms after it: pieces of the chart, with their limit.
std::string gate_plot(const course::Exercise& exercise, const TraineeView& trainee, std::size_t e, bool after_gate) {
  const course::ExerciseProgress& progress = trainee.exercises[e];
  const std::vector<store::AttemptRecord>& counted = trainee.counted[e];
  const std::size_t practice = counted.size() - progress.chart.size();
  SvgPlot plot{.id = fmt::format("{}_{}", after_gate ? "alarm" : "gate", e),
               .title = after_gate ? "Failures after the gate (CUSUM)" : "On the way to the gate (LC-CUSUM)",
               .x_label = "graded attempt",
               .y_label = "sum"};
  SvgLine sums{.name = after_gate ? "alarm" : "sum", .label = "sum"};
  for (std::size_t i = 0; i < progress.chart.size(); ++i) {
    const course::ChartStep& step = progress.chart[i];
    if (step.after_gate != after_gate) {
      sums.x.push_back(static_cast<double>(i + 1));
      sums.y.push_back(std::nan(""));
      continue;
    }
    const store::AttemptRecord& attempt = counted[practice + i];
    sums.x.push_back(static_cast<double>(i + 1));
    sums.y.push_back(step.sum);
    plot.points.push_back({.x = sums.x.back(),
                           .y = step.sum,
                           .name = trainee.passed[e][practice + i] ? "pass" : "fail",
                           .title = point_title(attempt, trainee.passed[e][practice + i])});
  }
  const double end =
      std::max<double>(static_cast<double>(progress.chart.size()), after_gate ? 1 : exercise.gate.horizon);
  const double limit = after_gate ? exercise.monitoring->limit : exercise.gate.limit;
  plot.lines = {std::move(sums),
                level(after_gate ? "alarm" : "limit", fmt::format("limit {:.2f}", limit), limit, 0, end)};
  return figures::svg_plot(plot);
}

/// Values of the metric in focus by attempt, with the fitted curve or the reason why there is none.
std::string focus_plot(const course::Exercise& exercise, const TraineeView& trainee, std::size_t e) {
  const content::MetricRow* metric = find_metric(exercise.focus);
  if (metric == nullptr) return {};
  SvgPlot plot{.id = fmt::format("focus_{}", e),
               .title = std::string(metric->title),
               .x_label = "attempt",
               .y_label = std::string(metric->unit.empty() ? "count" : metric->unit)};
  std::vector<double> values;
  std::vector<double> numbers;
  for (std::size_t i = 0; i < trainee.counted[e].size(); ++i) {
    const store::AttemptRecord& attempt = trainee.counted[e][i];
    const bool passed = trainee.passed[e][i];
    const auto measured = trainee.metrics.find(attempt.id);
    if (attempt.status != "ended" || measured == trainee.metrics.end()) continue;
    const auto result = std::ranges::find(measured->second, exercise.focus, &store::MetricResult::metric);
    if (result == measured->second.end() || !result->value) continue;
    values.push_back(*result->value);
    numbers.push_back(static_cast<double>(values.size()));
    plot.points.push_back(
        {.x = numbers.back(),
         .y = values.back(),
         .name = passed ? "pass" : "fail",
         .title = fmt::format("{}, {:.3g} {}", point_title(attempt, passed), values.back(), metric->unit)});
  }
  const std::string definition = fmt::format("<p class=\"hint\">{} <small>({})</small></p>",
                                             escaped(metric->definition), escaped(metric->source));
  if (values.empty()) return {};
  const FitScale scale = scale_of(*metric, values);
  std::vector<double> fitted_values;
  for (const double value : values) fitted_values.push_back(scale.to(value));
  const auto [least, most] = std::ranges::minmax(fitted_values);
  const double low = scale.logarithmic ? least - (most - least) : std::min(0.0, least);
  const statistics::LearningCurve curve =
      statistics::learning_curve(fitted_values, {.low = low, .high = most + (most - least)});
  std::string words;
  if (curve.exponential) {
    const double errors = curve.exponential->standard_errors_of_95();
    SvgLine fitted{.name = "curve", .label = "fitted"};
    SvgLine above{.name = "band", .label = "what is known of it (95 %)", .dashed = true};
    SvgLine below{.name = "band", .label = "", .dashed = true};
    for (double n = 1; n <= numbers.back(); n += 0.25) {
      const statistics::CurvePoint at = statistics::value_at(CurveShape::exponential, *curve.exponential, n);
      for (SvgLine* line : {&fitted, &above, &below}) line->x.push_back(n);
      fitted.y.push_back(scale.from(at.value));
      above.y.push_back(scale.from(at.value + errors * at.standard_error));
      below.y.push_back(scale.from(at.value - errors * at.standard_error));
    }
    plot.lines = {std::move(fitted), std::move(above), std::move(below)};
    const double plateau = curve.exponential->parameters[0];
    const double known = errors * curve.exponential->standard_error(0);
    words = fmt::format(
        "Levels off at {:.3g} {} (95 %: {:.3g} to {:.3g}) as far as {} attempts tell{}; a description, no promise.",
        scale.from(plateau), metric->unit, scale.from(plateau - known), scale.from(plateau + known), values.size(),
        scale.logarithmic ? ", fitted to logarithms" : "");
  } else {
    plot.lines = {
        {.name = "median", .label = "running median of 5", .x = numbers, .y = statistics::running_median(values)}};
    words = fmt::format("No fitted curve: {}.", curve.refused);
  }
  return fmt::format("<div>{}<p class=\"hint\">{}</p>{}</div>", figures::svg_plot(plot), escaped(words), definition);
}

void append_exercise(std::string& html, const course::Exercise& exercise, const TraineeView& trainee, std::size_t e) {
  const course::ExerciseProgress& progress = trainee.exercises[e];
  const StandingMark mark = mark_of(progress.standing);
  auto out = std::back_inserter(html);
  fmt::format_to(out, R"(<section><h2>{}</h2><p class="standing {}">{} {}</p>)", isolated(exercise.name), mark.name,
                 mark.symbol, escaped(course::progress_words(exercise, progress)));
  const std::vector<store::AttemptRecord>& counted = trainee.counted[e];
  if (!counted.empty()) {
    const auto passed = std::ranges::count(trainee.passed[e], true);
    const statistics::Interval rate = statistics::wilson(static_cast<int>(passed), static_cast<int>(counted.size()));
    fmt::format_to(
        out,
        R"(<p class="hint" title="Wilson's score interval of all attempts that count, the course's bars among what passes">Passed {} of {}: the pass )"
        R"(rate lies between {:.0f} and {:.0f} % with 95 % confidence.{}{}</p>)",
        passed, counted.size(), rate.low * 100, rate.high * 100,
        progress.retention_day ? fmt::format(" Retention test from {}.", date_of(*progress.retention_day)) : "",
        progress.after_pause ? " After a pause: the first attempts may be worse." : "");
  }
  if (trainee.at_earlier_versions[e] > 0) {
    fmt::format_to(
        out,
        R"(<p class="hint">{} attempts at an earlier version of the scenario or with another device are on no chart.</p>)",
        trainee.at_earlier_versions[e]);
  }
  if (!progress.chart.empty()) {
    html += "<div class=\"plots\"><div>" + gate_plot(exercise, trainee, e, false);
    fmt::format_to(out, R"(<p class="hint">{}</p></div>)",
                   escaped("A " + course::gate_words(exercise) + ". Filled: passed; hollow: failed or broken off."));
    if (exercise.monitoring &&
        std::ranges::any_of(progress.chart, [](const course::ChartStep& step) { return step.after_gate; })) {
      html += "<div>" + gate_plot(exercise, trainee, e, true) + "</div>";
    }
    html += focus_plot(exercise, trainee, e) + "</div>";
  }
  html += "</section>\n";
}

void append_attempts(std::string& html, const TraineeView& trainee) {
  html +=
      "<section><h2 id=\"every\">Every attempt</h2><div class=\"scroll\" tabindex=\"0\" role=\"region\" "
      "aria-labelledby=\"every\"><table><thead><tr><th scope=\"col\">Scenario</th><th "
      "scope=\"col\">No</th><th scope=\"col\">When</th><th scope=\"col\">Mode</th><th scope=\"col\">Points</th><th "
      "scope=\"col\">Result</th><th scope=\"col\">Id</th></tr></thead><tbody>\n";
  for (auto attempt = trainee.attempts.rbegin(); attempt != trainee.attempts.rend(); ++attempt) {
    fmt::format_to(
        std::back_inserter(html),
        R"(<tr{}><th scope="row">{}</th><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>)"
        "\n",
        attempt->counts() ? "" : " class=\"excluded\"", isolated(attempt->scenario), attempt->number,
        store::local_text(attempt->started_ms, attempt->utc_offset_min), attempt->mode,
        attempt->total ? fmt::format("{:.0f}", *attempt->total) : "&ndash;", isolated(result_of(*attempt)),
        attempt->id.substr(24));
  }
  html += "</tbody></table></div></section>\n";
}

void append_comparison(std::string& html, const TraineeView& trainee) {
  if (trainee.attempts.size() < 2) return;
  auto out = std::back_inserter(html);
  html += "<section><h2>Two attempts side by side</h2><form class=\"do\" method=\"get\" action=\"compare\">";
  for (const char* name : {"a", "b"}) {
    fmt::format_to(out, R"(<label>{} <select name="{}">)", *name == 'a' ? "One" : "The other", name);
    const std::size_t chosen = trainee.attempts.size() - (*name == 'a' ? 2 : 1);
    for (std::size_t i = 0; i < trainee.attempts.size(); ++i) {
      const store::AttemptRecord& attempt = trainee.attempts[i];
      fmt::format_to(out, R"(<option value="{}"{}>{} {}, {}</option>)", escaped(attempt.id),
                     i == chosen ? " selected" : "", escaped(attempt.scenario), attempt.number,
                     store::local_text(attempt.started_ms, attempt.utc_offset_min));
    }
    html += "</select></label>";
  }
  html += "<button>Compare</button></form></section>\n";
}

/// The same with the line breaks that somebody wrote, for what is laid out with them.
std::string isolated_lines(std::string_view text) {
  std::string html = "<bdi>";
  for (std::size_t from = 0; from <= text.size();) {
    const std::size_t end = std::min(text.find('\n', from), text.size());
    std::string_view line = text.substr(from, end - from);
    if (line.ends_with('\r')) line.remove_suffix(1);
    html += (from > 0 ? "\n" : "") + escaped(line);
    from = end + 1;
  }
  return html + "</bdi>";
}

/// A browser counts units of UTF-16, each of which has three bytes of UTF-8 at most.
constexpr std::size_t kMostNoteUnits = store::kLongestNote / 3;

void append_consents(std::string& html, const TraineeView& trainee) {
  if (trainee.consents.empty() && !trainee.kept_until_ms) return;
  auto out = std::back_inserter(html);
  html += "<section><h2>Consent and retention</h2><table><tbody>\n";
  for (const store::Consent& consent : trainee.consents) {
    const bool to_store = consent.purpose == store::kRecordStore;
    fmt::format_to(
        out,
        R"(<tr><th scope="row" title="{}">{}</th><td>{}</td></tr>)"
        "\n",
        to_store ? "Statements by pseudonym go to the lab's learning record store"
                 : "Numbers by pseudonym may be used in research, and outlast the person's records without them",
        to_store ? "Record store" : "Research",
        consent.given ? fmt::format("{} {}", *consent.given ? "agreed" : "refused",
                                    store::utc_text(consent.at_ms).substr(0, 10))
                      : std::string("never asked, which is no consent"));
  }
  if (trainee.kept_until_ms) {
    fmt::format_to(out,
                   R"(<tr><th scope="row" title="The lab's retention time after the last attempt">Kept until</th>)"
                   R"(<td>{}</td></tr>)"
                   "\n",
                   store::utc_text(*trainee.kept_until_ms).substr(0, 10));
  }
  html += "</tbody></table></section>\n";
}

void append_notes(std::string& html, const TraineeView& trainee, const PageFacts& facts) {
  if (trainee.notes.empty() && !facts.actions) return;
  auto out = std::back_inserter(html);
  html += "<section><h2>Notes</h2>";
  for (const store::Note& note : trainee.notes) {
    fmt::format_to(out, R"(<p class="note">{}<br><small>{}, {}</small></p>)", isolated_lines(note.body),
                   isolated(note.author), store::utc_text(note.at_ms).substr(0, 10));
  }
  if (facts.actions) {
    fmt::format_to(
        out,
        R"(<form class="do" method="post" action="note"><input type="hidden" name="token" value="{}"><input )"
        R"(type="hidden" name="trainee" value="{}"><label>A note <textarea name="body" rows="3" )"
        R"(maxlength="{}" required></textarea></label><button>Keep it</button></form>)",
        escaped(facts.actions->token), escaped(trainee.person.pseudonym), kMostNoteUnits);
  }
  html += "</section>\n";
}

}  // namespace

std::string trainee_page(const course::Course& course, const TraineeView& trainee, const PageFacts& facts) {
  std::string html = page_begin(trainee.person.name.empty() ? trainee.person.pseudonym : trainee.person.name);
  auto out = std::back_inserter(html);
  fmt::format_to(
      out,
      R"(<header><p class="brand"><a href="index.html">Stylet lab</a></p><h1>{}</h1><p class="facts">{} &middot; )"
      R"({} attempts</p></header>)"
      "\n<main>",
      name_of(trainee.person), isolated(course.title), trainee.attempts.size());
  if (trainee.due) {
    const course::Exercise& next = course.exercises[*trainee.due];
    fmt::format_to(out,
                   R"(<p class="next">Next: <b>{}</b>, {}</p>)"
                   "\n",
                   isolated(next.name), escaped(course::progress_words(next, trainee.exercises[*trainee.due])));
  }
  for (std::size_t e = 0; e < course.exercises.size(); ++e) append_exercise(html, course.exercises[e], trainee, e);
  append_attempts(html, trainee);
  if (facts.actions) append_comparison(html, trainee);
  append_notes(html, trainee, facts);
  append_consents(html, trainee);
  html += "</main>\n";
  return html + page_end(facts);
}

}  // namespace stylet::lab::page
