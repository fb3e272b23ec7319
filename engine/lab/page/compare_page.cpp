#include "engine/content/metric_table.h"
#include "engine/files/html.h"
#include "engine/lab/page/page_parts.h"
#include "engine/lab/store/export.h"
#include "engine/procedures/kinds.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <string>

namespace stylet::lab::page {

using files::html::escaped;

namespace {

std::map<std::string, std::optional<double>> values_of(const TraineeView& trainee,
                                                       const store::AttemptRecord& attempt) {
  std::map<std::string, std::optional<double>> values;
  const auto found = trainee.metrics.find(attempt.id);
  if (found == trainee.metrics.end()) return values;
  for (const store::MetricResult& metric : found->second) values[metric.metric] = metric.value;
  return values;
}

std::string value_text(const std::optional<double>& value) {
  return value ? fmt::format("{:.4g}", *value) : "&ndash;";
}

std::string head_of(const store::AttemptRecord& attempt) {
  return fmt::format("<th scope=\"col\">{} {}<br><small>{}, {}{}</small></th>", isolated(attempt.scenario),
                     attempt.number, store::local_text(attempt.started_ms, attempt.utc_offset_min),
                     isolated(result_of(attempt)),
                     attempt.total ? fmt::format(", {:.0f} points", *attempt.total) : "");
}

}  // namespace

std::string compare_page(const TraineeView& trainee, std::size_t a, std::size_t b, const PageFacts& facts) {
  const store::AttemptRecord& left = trainee.attempts[a];
  const store::AttemptRecord& right = trainee.attempts[b];
  std::string html = page_begin("Two attempts of " + trainee.person.pseudonym);
  auto out = std::back_inserter(html);
  fmt::format_to(
      out,
      R"(<header><p class="brand"><a href="index.html">Stylet lab</a></p><h1>Two attempts of <a href="{}.html">{}</a></h1></header>)"
      "\n<main><section><h2 id=\"both\">Side by side</h2>{}<div class=\"scroll\" tabindex=\"0\" role=\"region\" "
      "aria-labelledby=\"both\"><table><thead><tr><th scope=\"col\">Metric</th><th scope=\"col\">Unit</th>{}{}<th "
      "scope=\"col\">Difference</th></tr></thead><tbody>\n",
      escaped(trainee.person.pseudonym), name_of(trainee.person),
      left.scenario_sha256 == right.scenario_sha256
          ? ""
          : "<p class=\"hint\">They are of different scenarios, or of different versions of one.</p>",
      head_of(left), head_of(right));
  const auto of_left = values_of(trainee, left);
  const auto of_right = values_of(trainee, right);
  std::set<std::string> names;
  for (const auto& [name, value] : of_left) names.insert(name);
  for (const auto& [name, value] : of_right) names.insert(name);
  const auto table = procedures::metric_table();
  for (const std::string& name : names) {
    const auto row = std::ranges::find_if(table, [&](const content::MetricRow& each) { return each.name == name; });
    const auto at_left = of_left.find(name);
    const auto at_right = of_right.find(name);
    const std::optional<double> l = at_left != of_left.end() ? at_left->second : std::nullopt;
    const std::optional<double> r = at_right != of_right.end() ? at_right->second : std::nullopt;
    fmt::format_to(out,
                   R"(<tr><th scope="row" title="{}">{}</th><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>)"
                   "\n",
                   row != table.end() ? escaped(fmt::format("{} ({})", row->definition, row->source)) : std::string(),
                   row != table.end() ? escaped(row->title) : escaped(name),
                   row != table.end() ? escaped(row->unit) : std::string(), value_text(l), value_text(r),
                   l && r ? fmt::format("{:+.4g}", *r - *l) : "&ndash;");
  }
  html += "</tbody></table></div></section></main>\n";
  return html + page_end(facts);
}

}  // namespace stylet::lab::page
