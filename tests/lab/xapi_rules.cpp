#include "tests/lab/xapi_rules.h"

#include <functional>
#include <map>
#include <regex>

namespace stylet::lab::test {

namespace {

using nlohmann::json;
using Problems = std::vector<std::string>;
using Check = std::function<void(const json&, const std::string&, Problems&)>;

struct Property {
  Check check{};
  bool required = false;
};
using Table = std::map<std::string, Property>;

void object(const json& value, const std::string& at, const Table& table, Problems& problems) {
  if (!value.is_object()) {
    problems.push_back(at + ": no object");
    return;
  }
  for (const auto& [key, inner] : value.items()) {
    const auto row = table.find(key);
    if (row == table.end()) {
      problems.push_back(at + "." + key + ": the standard has no such property");
    } else {
      row->second.check(inner, at + "." + key, problems);
    }
  }
  for (const auto& [key, property] : table) {
    if (property.required && !value.contains(key)) problems.push_back(at + "." + key + ": is missing");
  }
}

void matches(const json& value, const std::string& at, const std::regex& pattern, const char* what,
             Problems& problems) {
  if (!value.is_string() || !std::regex_match(value.get<std::string>(), pattern)) problems.push_back(at + what);
}

void iri(const json& value, const std::string& at, Problems& problems) {
  static const std::regex kIri(R"([A-Za-z][A-Za-z0-9+.-]*:[^\s<>"{}|\\^`]+)");
  matches(value, at, kIri, ": no IRI", problems);
}

void uuid(const json& value, const std::string& at, Problems& problems) {
  static const std::regex kUuid(
      "[0-9a-fA-F]{8}-[0-9a-fA-F]{4}-[1-8][0-9a-fA-F]{3}-[89abAB][0-9a-fA-F]{3}-[0-9a-fA-F]{12}");
  matches(value, at, kUuid, ": no UUID of RFC 9562", problems);
}

void timestamp(const json& value, const std::string& at, Problems& problems) {
  // RFC 3339; an offset of -00:00 says that nobody knows where it was.
  static const std::regex kTime(
      R"(\d{4}-(0[1-9]|1[0-2])-(0[1-9]|[12]\d|3[01])T([01]\d|2[0-3]):[0-5]\d:[0-5]\d(\.\d+)?(Z|\+([01]\d|2[0-3]):[0-5]\d|-(?!00:00)([01]\d|2[0-3]):[0-5]\d))");
  matches(value, at, kTime, ": no time of RFC 3339", problems);
}

void duration(const json& value, const std::string& at, Problems& problems) {
  static const std::regex kDuration(
      R"(P(\d+W|(?=[\dT])(\d+Y)?(\d+M)?(\d+D)?(T(?=\d)(\d+H)?(\d+M)?(\d+(\.\d{1,2})?S)?)?))");
  matches(value, at, kDuration, ": no duration of ISO 8601 to a hundredth of a second", problems);
}

void text(const json& value, const std::string& at, Problems& problems) {
  if (!value.is_string() || value.get<std::string>().empty()) problems.push_back(at + ": no text");
}

void truth(const json& value, const std::string& at, Problems& problems) {
  if (!value.is_boolean()) problems.push_back(at + ": neither true nor false");
}

void number(const json& value, const std::string& at, Problems& problems) {
  if (!value.is_number()) problems.push_back(at + ": no number");
}

void language(const json& value, const std::string& at, Problems& problems) {
  static const std::regex kTag("[A-Za-z]{2,8}(-[A-Za-z0-9]{1,8})*");
  matches(value, at, kTag, ": no language tag of RFC 5646", problems);
}

void language_map(const json& value, const std::string& at, Problems& problems) {
  if (!value.is_object() || value.empty()) {
    problems.push_back(at + ": no texts by language");
    return;
  }
  for (const auto& [key, inner] : value.items()) {
    language(key, at + "." + key, problems);
    if (!inner.is_string()) problems.push_back(at + "." + key + ": no text");
  }
}

void extensions(const json& value, const std::string& at, Problems& problems) {
  if (!value.is_object()) {
    problems.push_back(at + ": no object");
    return;
  }
  for (const auto& [key, inner] : value.items())
    iri(key, at + "." + key, problems);  // values are anything, also null
}

void account(const json& value, const std::string& at, Problems& problems) {
  object(value, at, {{"homePage", {iri, true}}, {"name", {text, true}}}, problems);
}

void agent(const json& value, const std::string& at, Problems& problems) {
  static const std::regex kMail("mailto:[^\\s@]+@[^\\s@]+");
  static const std::regex kSha1("[0-9a-fA-F]{40}");
  object(value, at,
         {{"objectType", {[](const json& type, const std::string& where, Problems& all) {
             if (type != "Agent") all.push_back(where + ": only agents are sent");
           }}},
          {"name", {text}},
          {"mbox", {[](const json& box, const std::string& where, Problems& all) {
             matches(box, where, kMail, ": no mailto", all);
           }}},
          {"mbox_sha1sum", {[](const json& sum, const std::string& where, Problems& all) {
             matches(sum, where, kSha1, ": no SHA-1", all);
           }}},
          {"openid", {iri}},
          {"account", {account}}},
         problems);
  int identifiers = 0;
  for (const char* key : {"mbox", "mbox_sha1sum", "openid", "account"}) identifiers += value.contains(key) ? 1 : 0;
  if (identifiers != 1) problems.push_back(at + ": an agent has exactly one identifier");
}

void verb(const json& value, const std::string& at, Problems& problems) {
  object(value, at, {{"id", {iri, true}}, {"display", {language_map}}}, problems);
}

void definition(const json& value, const std::string& at, Problems& problems) {
  object(value, at,
         {{"name", {language_map}},
          {"description", {language_map}},
          {"type", {iri}},
          {"moreInfo", {iri}},
          {"extensions", {extensions}}},
         problems);
}

void activity(const json& value, const std::string& at, Problems& problems) {
  object(value, at,
         {{"objectType", {[](const json& type, const std::string& where, Problems& all) {
             if (type != "Activity") all.push_back(where + ": only activities are sent");
           }}},
          {"id", {iri, true}},
          {"definition", {definition}}},
         problems);
}

void score(const json& value, const std::string& at, Problems& problems) {
  object(value, at, {{"scaled", {number}}, {"raw", {number}}, {"min", {number}}, {"max", {number}}}, problems);
  const auto of = [&](const char* key) { return value.is_object() && value.contains(key) && value[key].is_number(); };
  if (of("scaled") && (value["scaled"] > 1.0 || value["scaled"] < -1.0)) {
    problems.push_back(at + ".scaled: not within -1 to 1");
  }
  if (of("min") && of("max") && value["min"] >= value["max"]) problems.push_back(at + ".min: not below max");
  if (of("raw") && of("min") && value["raw"] < value["min"]) problems.push_back(at + ".raw: below min");
  if (of("raw") && of("max") && value["raw"] > value["max"]) problems.push_back(at + ".raw: above max");
}

void result(const json& value, const std::string& at, Problems& problems) {
  object(value, at,
         {{"score", {score}},
          {"success", {truth}},
          {"completion", {truth}},
          {"response", {text}},
          {"duration", {duration}},
          {"extensions", {extensions}}},
         problems);
}

void activities(const json& value, const std::string& at, Problems& problems) {
  const Check list = [](const json& inner, const std::string& where, Problems& all) {
    if (!inner.is_array()) {  // one alone: 1.0 allowed it, 2.0 does not
      all.push_back(where + ": no list");
      return;
    }
    for (const json& each : inner) activity(each, where, all);
  };
  object(value, at, {{"parent", {list}}, {"grouping", {list}}, {"category", {list}}, {"other", {list}}}, problems);
}

void context(const json& value, const std::string& at, Problems& problems) {
  object(value, at,
         {{"registration", {uuid}},
          {"instructor", {agent}},
          {"contextActivities", {activities}},
          {"revision", {text}},
          {"platform", {text}},
          {"language", {language}},
          {"extensions", {extensions}}},
         problems);
}

}  // namespace

std::vector<std::string> problems_of(const json& statement) {
  Problems problems;
  object(statement, "statement",
         {{"id", {uuid, true}},  // optional there; without it nothing is sent exactly once
          {"actor", {agent, true}},
          {"verb", {verb, true}},
          {"object", {activity, true}},
          {"result", {result}},
          {"context", {context}},
          {"timestamp", {timestamp}},
          {"version", {[](const json& version, const std::string& where, Problems& all) {
             static const std::regex kVersion(R"([12]\.0\.\d+)");
             matches(version, where, kVersion, ": no version", all);
           }}}},
         problems);
  return problems;
}

}  // namespace stylet::lab::test
