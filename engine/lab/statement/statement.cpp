#include "engine/lab/statement/statement.h"

#include <boost/uuid/name_generator_sha1.hpp>
#include <boost/uuid/string_generator.hpp>
#include <boost/uuid/uuid.hpp>
#include <boost/uuid/uuid_io.hpp>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <ctime>

namespace stylet::lab::statement {

namespace {

using nlohmann::ordered_json;

constexpr std::string_view kVerbs = "http://adlnet.gov/expapi/verbs/";
constexpr const char* kSimulation = "http://adlnet.gov/expapi/activities/simulation";

std::string utc_text(std::int64_t ms) {
  return fmt::format("{:%Y-%m-%dT%H:%M:%S}.{:03}Z", fmt::gmtime(static_cast<std::time_t>(ms / 1000)), ms % 1000);
}

std::string iri(std::string_view base, std::string_view path, std::string_view name) {
  // Names of files, which may hold anything: only what an IRI takes as it is goes in as it is (RFC 3987).
  std::string text = fmt::format("{}{}", base, path);
  for (const char c : name) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
                       c == '.' || c == '_' || c == '~';
    text += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return text;
}

/// What every statement of an attempt has.
ordered_json common(const AttemptFacts& facts, const std::string& verb) {
  const std::string verb_iri = std::string(kVerbs) + verb;
  ordered_json json;
  json["id"] = name_based_id(facts.attempt, verb_iri);
  json["actor"] = {{"objectType", "Agent"}, {"account", {{"homePage", facts.home_page}, {"name", facts.pseudonym}}}};
  json["verb"] = {{"id", verb_iri}, {"display", {{"en", verb}}}};
  json["object"] = {{"objectType", "Activity"},
                    {"id", iri(facts.home_page, "scenario/", facts.scenario)},
                    {"definition", {{"type", kSimulation}, {"name", {{"en", facts.scenario_title}}}}}};
  return json;
}

/// After the result, as the standard lists them.
void add_context(ordered_json& json, const AttemptFacts& facts, std::int64_t at_ms) {
  ordered_json activities;
  if (!facts.course.empty()) activities["parent"] = {{{"id", iri(facts.home_page, "course/", facts.course)}}};
  activities["category"] = {{{"id", std::string(kVocabulary) + "profile/v1"},
                             {"definition", {{"type", "http://adlnet.gov/expapi/activities/profile"}}}}};
  ordered_json context;
  context["registration"] = facts.attempt;
  context["contextActivities"] = std::move(activities);
  context["revision"] = "sha256:" + facts.scenario_sha256;
  context["platform"] = "Stylet " + facts.build;
  context["language"] = "en";
  context["extensions"] = {{"https://w3id.org/xapi/simulation/extensions/simulation-mode", facts.mode}};
  json["context"] = std::move(context);
  json["timestamp"] = utc_text(at_ms);
}

Statement written(const ordered_json& json) {
  // What is no UTF-8 (a title of an old scenario) must not keep the attempt from being kept.
  return {.id = json["id"], .body = json.dump(-1, ' ', false, ordered_json::error_handler_t::replace)};
}

ordered_json extensions(const AttemptFacts& facts) {
  ordered_json all = ordered_json::object();
  for (const auto& [metric, value] : facts.metrics) {
    all[iri(kVocabulary, "metric/", metric)] = value && std::isfinite(*value) ? ordered_json(*value) : ordered_json();
  }
  all[std::string(kVocabulary) + "failed-critical"] = facts.failed_critical;
  if (!facts.recording_sha256.empty()) all[std::string(kVocabulary) + "recording-sha256"] = facts.recording_sha256;
  return all;
}

}  // namespace

Statement beginning(const AttemptFacts& facts) {
  ordered_json json = common(facts, "initialized");
  add_context(json, facts, facts.started_ms);
  return written(json);
}

std::vector<Statement> ending(const AttemptFacts& facts) {
  const auto told = [&](const std::string& verb, ordered_json result) {
    ordered_json json = common(facts, verb);
    if (!result.empty()) json["result"] = std::move(result);
    add_context(json, facts, facts.ended_ms);
    return written(json);
  };
  const std::string duration = duration_text(facts.ended_ms - facts.started_ms);
  if (facts.status != "ended") {
    ordered_json result;
    // When it was cut off nobody knows.
    if (facts.status == "aborted") result["duration"] = duration;
    return {told("terminated", std::move(result))};
  }
  ordered_json completed{{"completion", true}, {"duration", duration}, {"extensions", extensions(facts)}};
  std::vector<Statement> all{told("completed", completed)};
  if (facts.passed) {
    ordered_json result;
    if (facts.total && std::isfinite(*facts.total)) {
      const double raw = std::clamp(*facts.total, 0.0, 100.0);
      result["score"] = {{"scaled", raw / 100}, {"raw", raw}, {"min", 0}, {"max", 100}};
    }
    result["success"] = *facts.passed;
    result.update(completed);
    all.push_back(told(*facts.passed ? "passed" : "failed", std::move(result)));
  }
  return all;
}

std::string name_based_id(const std::string& space, const std::string& name) {
  const boost::uuids::uuid namespace_id = boost::uuids::string_generator()(space);
  return boost::uuids::to_string(boost::uuids::name_generator_sha1(namespace_id)(name));
}

std::string duration_text(std::int64_t ms) {
  return fmt::format("PT{:.2f}S", static_cast<double>(std::max<std::int64_t>(ms, 0)) / 1000);
}

}  // namespace stylet::lab::statement
