#include "engine/lab/store/export.h"

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <ctime>
#include <set>

namespace stylet::lab::store {

namespace {

/// A field of RFC 4180. What a spreadsheet would take for a formula is led by an apostrophe.
std::string field(std::string text) {
  if (!text.empty() && std::string_view("=+-@\t\r").find(text.front()) != std::string_view::npos) text.insert(0, "'");
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + '"';
}

std::string field(const std::optional<double>& value) {
  return value ? fmt::format("{}", *value) : std::string();
}

std::string field(const std::optional<bool>& value) {
  return value ? (*value ? "1" : "0") : "";
}

template <typename T>
nlohmann::ordered_json or_null(const std::optional<T>& value) {
  return value ? nlohmann::ordered_json(*value) : nlohmann::ordered_json();
}

std::vector<AttemptRecord> attempts_of(Lab& lab, const ExportScope& scope) {
  std::vector<AttemptRecord> attempts = lab.attempts(scope.trainee);
  if (!scope.for_research) return attempts;
  std::set<std::string> agreed;
  for (const PersonSummary& each : lab.people()) {
    if (each.anonymous || lab.consents_to(each.person.id, kResearch)) agreed.insert(each.person.pseudonym);
  }
  std::erase_if(attempts, [&](const AttemptRecord& attempt) { return !agreed.contains(attempt.pseudonym); });
  return attempts;
}

}  // namespace

std::string utc_text(std::int64_t ms) {
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z", fmt::gmtime(static_cast<std::time_t>(ms / 1000)), ms % 1000);
}

std::string local_text(std::int64_t ms, int utc_offset_min) {
  return fmt::format("{:%Y-%m-%d %H:%M}",
                     fmt::gmtime(static_cast<std::time_t>(ms / 1000 + std::int64_t{utc_offset_min} * 60)));
}

std::string attempts_as_csv(Lab& lab, const ExportScope& scope) {
  const auto metrics = lab.all_metrics(scope.trainee);
  std::set<std::string> names;
  for (const auto& [attempt, results] : metrics) {
    for (const MetricResult& result : results) names.insert(result.metric);
  }
  std::string csv =
      "pseudonym,scenario,number,attempt,course,mode,started,utc_offset_min,ended,status,total,pass_mark,passed,"
      "failed_critical,excluded,scenario_sha256,build,stylus,recording_sha256";
  for (const std::string& name : names) csv += "," + field(name);
  csv += "\r\n";
  for (const AttemptRecord& a : attempts_of(lab, scope)) {
    csv += fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}", field(a.pseudonym),
                       field(a.scenario), a.number, a.id, field(a.course), a.mode, utc_text(a.started_ms),
                       a.utc_offset_min, a.ended_ms ? utc_text(*a.ended_ms) : "", a.status, field(a.total),
                       field(a.pass_mark), field(a.passed), field(a.failed_critical), field(a.excluded),
                       a.scenario_sha256, field(a.build), field(a.stylus), a.recording_sha256);
    const auto found = metrics.find(a.id);
    for (const std::string& name : names) {
      csv += ',';
      if (found == metrics.end()) continue;
      const auto result = std::ranges::find(found->second, name, &MetricResult::metric);
      if (result != found->second.end()) csv += field(result->value);
    }
    csv += "\r\n";
  }
  return csv;
}

std::string attempts_as_json(Lab& lab, const ExportScope& scope) {
  const auto metrics = lab.all_metrics(scope.trainee);
  nlohmann::ordered_json json;
  json["format"] = "stylet-lab-export";
  json["version"] = 1;
  if (!scope.trainee.empty()) {  // everything about one, as the person may ask for
    json["consent"] = nlohmann::ordered_json::array();
    for (const Consent& consent : lab.consents(scope.trainee)) {
      json["consent"].push_back({{"purpose", consent.purpose},
                                 {"given", or_null(consent.given)},
                                 {"at", consent.given ? utc_text(consent.at_ms) : ""}});
    }
    json["notes"] = nlohmann::ordered_json::array();
    for (const Note& note : lab.notes(scope.trainee)) {
      json["notes"].push_back({{"author", note.author}, {"at", utc_text(note.at_ms)}, {"body", note.body}});
    }
  }
  json["attempts"] = nlohmann::ordered_json::array();
  for (const AttemptRecord& a : attempts_of(lab, scope)) {
    nlohmann::ordered_json& entry = json["attempts"].emplace_back();
    entry["pseudonym"] = a.pseudonym;
    entry["scenario"] = a.scenario;
    entry["number"] = a.number;
    entry["attempt"] = a.id;
    entry["course"] = a.course;
    entry["mode"] = a.mode;
    entry["started"] = utc_text(a.started_ms);
    entry["utc_offset_min"] = a.utc_offset_min;
    entry["ended"] = a.ended_ms ? nlohmann::ordered_json(utc_text(*a.ended_ms)) : nlohmann::ordered_json();
    entry["status"] = a.status;
    entry["total"] = or_null(a.total);
    entry["pass_mark"] = or_null(a.pass_mark);
    entry["passed"] = or_null(a.passed);
    entry["failed_critical"] = a.failed_critical;
    entry["excluded"] = a.excluded;
    entry["scenario_sha256"] = a.scenario_sha256;
    entry["build"] = a.build;
    entry["stylus"] = a.stylus;
    entry["recording_sha256"] = a.recording_sha256;
    nlohmann::ordered_json& values = entry["metrics"] = nlohmann::ordered_json::object();
    const auto found = metrics.find(a.id);
    if (found == metrics.end()) continue;
    for (const MetricResult& result : found->second) {
      nlohmann::ordered_json& metric = values[result.metric];
      metric["value"] = or_null(result.value);
      if (result.points) metric["points"] = *result.points;
      if (result.most) metric["most"] = *result.most;
    }
  }
  return json.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

}  // namespace stylet::lab::store
