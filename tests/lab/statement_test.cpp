// Statements: by the standard's tables, and with the ids that they have for good.
#include "engine/lab/statement/statement.h"
#include "tests/lab/xapi_rules.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace stylet::lab::statement {
namespace {

using nlohmann::json;
using test::problems_of;
using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::Not;

AttemptFacts sample_facts() {
  return {.attempt = "01980a3e-6f2b-7c41-9d8e-1f2a3b4c5d6e",
          .pseudonym = "7Q4M2KX",
          .scenario = "liver_biopsy",
          .scenario_title = "Liver biopsy under ultrasound",
          .scenario_sha256 = std::string(64, 'a'),
          .course = "needle_basics",
          .home_page = "https://lab.example/stylet/",
          .mode = "graded",
          .build = "0.1.0 (commit 0123456)",
          .started_ms = 1'772'442'985'480,
          .ended_ms = 1'772'443'127'840,
          .status = "ended",
          .total = 83.0,
          .passed = true,
          .recording_sha256 = std::string(64, 'b'),
          .metrics = {{"targeting", 2.41}, {"ablation_coverage", std::nullopt}}};
}

std::vector<std::string> verbs_of(const std::vector<Statement>& statements) {
  std::vector<std::string> verbs;
  for (const Statement& each : statements) {
    const std::string verb = json::parse(each.body)["verb"]["id"];
    verbs.push_back(verb.substr(verb.rfind('/') + 1));
  }
  return verbs;
}

// RFC 9562's own vector, and those of another implementation.
TEST(Statement, IdsAreNameBased) {
  EXPECT_EQ(name_based_id("6ba7b810-9dad-11d1-80b4-00c04fd430c8", "www.example.com"),
            "2ed6657d-e927-568b-95e1-2665a8aea6a2");
  AttemptFacts facts = sample_facts();
  EXPECT_EQ(beginning(facts).id, "96242c07-c46e-576d-8999-abc461e359cd");
  EXPECT_EQ(ending(facts)[0].id, "f5c3f109-7e08-5795-a6c4-a6259697e911");
  EXPECT_EQ(ending(facts)[1].id, "5a1a2ef6-1e15-50ca-be61-f97715b662af");
  facts.passed = false;
  EXPECT_EQ(ending(facts)[1].id, "9aa2ebcf-a7f6-5370-8e10-9cb7a09d9939");
  facts.status = "crashed";
  EXPECT_EQ(ending(facts)[0].id, "255733e5-d0fc-5e14-a3db-007b8443c286");
}

TEST(Statement, TellsOfTheAttemptWhatTheStandardAllows) {
  AttemptFacts facts = sample_facts();
  EXPECT_THAT(problems_of(json::parse(beginning(facts).body)), IsEmpty());
  EXPECT_THAT(verbs_of(ending(facts)), ElementsAre("completed", "passed"));
  const json passed = json::parse(ending(facts)[1].body);
  EXPECT_THAT(problems_of(passed), IsEmpty());
  EXPECT_EQ(passed["result"]["score"]["scaled"], 0.83);
  EXPECT_EQ(passed["result"]["duration"], "PT142.36S");
  EXPECT_EQ(passed["timestamp"], "2026-03-02T09:18:47.840Z");
  EXPECT_EQ(passed["context"]["registration"], facts.attempt);
  const json& metrics = passed["result"]["extensions"];
  EXPECT_EQ(metrics["https://w3id.org/stylet/xapi/metric/targeting"], 2.41);
  EXPECT_TRUE(metrics["https://w3id.org/stylet/xapi/metric/ablation_coverage"].is_null());
  facts.passed = false;
  facts.failed_critical = {"tumour_content"};
  EXPECT_THAT(verbs_of(ending(facts)), ElementsAre("completed", "failed"));
  facts.passed.reset();
  EXPECT_THAT(verbs_of(ending(facts)), ElementsAre("completed")) << "nothing is scored";
  facts.status = "aborted";
  EXPECT_THAT(verbs_of(ending(facts)), ElementsAre("terminated"));
  EXPECT_FALSE(json::parse(ending(facts)[0].body)["result"].contains("success"));
  facts.status = "crashed";
  EXPECT_FALSE(json::parse(ending(facts)[0].body).contains("result")) << "when, nobody knows";
}

TEST(Statement, WhateverNamesAndNumbersAreItIsOneThatAStoreTakes) {
  for (const std::string& odd : {std::string("<script>\"&/ ?#"), std::string("\xff\xfe no UTF-8"),
                                 std::string("a\nb\x01"), std::string("\xe2\x80\xae"), std::string("Ä ö")}) {
    for (const double number : {0.0, -3.0, 1e300, 250.0, std::numeric_limits<double>::quiet_NaN(),
                                std::numeric_limits<double>::infinity()}) {
      AttemptFacts facts = sample_facts();
      facts.scenario = odd;
      facts.scenario_title = odd;
      facts.course = odd;
      facts.build = odd;
      facts.total = number;
      facts.metrics = {{odd, number}};
      facts.failed_critical = {odd};
      facts.ended_ms = facts.started_ms - 5;  // the clock was set back
      for (const bool passed : {true, false}) {
        facts.passed = passed;
        EXPECT_THAT(problems_of(json::parse(beginning(facts).body)), IsEmpty());
        for (const Statement& each : ending(facts)) EXPECT_THAT(problems_of(json::parse(each.body)), IsEmpty());
      }
    }
  }
}

/// The rules are what the tests lean on: each is broken once.
TEST(XapiRules, RefuseWhatTheStandardDoes) {
  const json sound = json::parse(ending(sample_facts())[1].body);
  ASSERT_THAT(problems_of(sound), IsEmpty());
  const std::pair<const char*, json> broken[]{
      {"/result/score/scaled", 1.01},
      {"/result/score/raw", 101},
      {"/result/score/min", 200},
      {"/result/score/scaled", nullptr},
      {"/result/score/percent", 12},
      {"/result/duration", "142 s"},
      {"/result/duration", "P4W1D"},
      {"/result/duration", "PT1.234S"},
      {"/result/duration", "PT"},
      {"/result/success", "true"},
      {"/result/extensions/no iri", 1},
      {"/result/extensions", nullptr},
      {"/id", "5a1a2ef6-1e15-50ca-be61"},
      {"/actor", nullptr},
      {"/actor/mbox", "mailto:ada@example.org"},
      {"/actor/account/name", ""},
      {"/actor/account/homePage", "lab.example"},
      {"/verb/id", "passed"},
      {"/verb/display", "passed"},
      {"/verb/display/englishlanguage", "passed"},
      {"/object/id", "scenario liver"},
      {"/object/definition/name", json::object()},
      {"/context/registration", "7"},
      {"/context/contextActivities/parent", {{"id", "https://lab.example/a"}}},
      {"/context/language", "e"},
      {"/context/statement", 1},
      {"/timestamp", "2026-03-02 09:18:47"},
      {"/timestamp", "2026-03-02T09:18:47-00:00"},
      {"/timestamp", "2026-13-02T09:18:47Z"},
      {"/version", "3.0.0"},
      {"/score", 1}};
  for (const auto& [at, value] : broken) {
    json statement = sound;
    statement[json::json_pointer(at)] = value;
    EXPECT_THAT(problems_of(statement), Not(IsEmpty())) << at << ' ' << value;
  }
  for (const char* needed : {"id", "actor", "verb", "object"}) {
    json statement = sound;
    statement.erase(needed);
    EXPECT_THAT(problems_of(statement), Not(IsEmpty())) << needed;
  }
}

}  // namespace
}  // namespace stylet::lab::statement
