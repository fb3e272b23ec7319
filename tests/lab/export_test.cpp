// What other programs get: CSV by RFC 4180, JSON, no names.
#include "engine/lab/store/export.h"
#include "tests/lab/sample_attempts.h"
#include "tests/support/temporary_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace stylet::lab::store {
namespace {

using nlohmann::json;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;

/// Rows of fields, by RFC 4180.
std::vector<std::vector<std::string>> parsed(const std::string& csv) {
  std::vector<std::vector<std::string>> rows(1, {""});
  bool quoted = false;
  for (std::size_t i = 0; i < csv.size(); ++i) {
    std::string& field = rows.back().back();
    if (quoted) {
      if (csv[i] != '"') {
        field += csv[i];
      } else if (csv.compare(i, 2, "\"\"") == 0) {
        field += csv[i++];
      } else {
        quoted = false;
      }
    } else if (csv[i] == '"') {
      quoted = true;
    } else if (csv[i] == ',') {
      rows.back().emplace_back();
    } else if (csv.compare(i, 2, "\r\n") == 0) {
      rows.emplace_back(1);
      ++i;
    } else {
      field += csv[i];
    }
  }
  rows.pop_back();
  return rows;
}

TEST(Export, IsATableOfAttemptsByPseudonymAndTheSameAsJson) {
  const support::TemporaryFolder folder;
  Lab lab({.folder = folder / "lab", .build = "test"});
  const Person ada = lab.enrolled("Yourcenar");  // no digits of an id
  const Person bob = lab.enrolled("bob");
  lab.end(lab.begin(test::start_of(ada)), test::end_of(82.5, true, 2));
  AttemptEnd other = test::end_of(40, false, 0);
  other.metrics.push_back({.metric = "later", .value = 1.0 / 3});
  other.failed_critical = "tumour_content";
  const std::string second = lab.begin(test::start_of(ada));
  lab.end(second, other);
  lab.exclude(second, "trainer", "=HYPERLINK(\"x\"), said\r\nthe stylus");
  lab.begin(test::start_of(bob));

  const std::string csv = attempts_as_csv(lab);
  EXPECT_THAT(csv, Not(HasSubstr("Yourcenar")));
  const auto rows = parsed(csv);
  ASSERT_THAT(rows, SizeIs(4));
  for (const auto& row : rows) EXPECT_EQ(row.size(), rows[0].size());
  const auto field = [&](std::size_t row, const std::string& column) {
    const auto at = std::ranges::find(rows[0], column) - rows[0].begin();
    return rows[row].at(static_cast<std::size_t>(at));
  };
  EXPECT_EQ(field(1, "pseudonym"), ada.pseudonym);
  EXPECT_EQ(field(1, "total"), "82.5");
  EXPECT_EQ(field(1, "passed"), "1");
  EXPECT_EQ(field(1, "metric_01"), "83.5");
  EXPECT_EQ(field(1, "later"), "");
  EXPECT_EQ(field(2, "number"), "2");
  EXPECT_EQ(std::stod(field(2, "later")), 1.0 / 3) << "every digit";
  EXPECT_EQ(field(2, "failed_critical"), "tumour_content");
  EXPECT_EQ(field(2, "excluded"), "'=HYPERLINK(\"x\"), said\r\nthe stylus") << "no formula in a spreadsheet";
  EXPECT_EQ(field(3, "status"), "running");
  EXPECT_EQ(field(3, "ended"), "");
  EXPECT_THAT(parsed(attempts_as_csv(lab, {.trainee = ada.id})), SizeIs(3));

  const json all = json::parse(attempts_as_json(lab));
  EXPECT_EQ(all["format"], "stylet-lab-export");
  ASSERT_THAT(all["attempts"], SizeIs(3));
  EXPECT_EQ(all["attempts"][0]["metrics"]["metric_01"]["value"], 83.5);
  EXPECT_EQ(all["attempts"][1]["passed"], false);
  EXPECT_TRUE(all["attempts"][2]["passed"].is_null());
}

TEST(Export, OfOnePersonHasConsentAndNotesAndForResearchThoseAloneWhoAgreed) {
  const support::TemporaryFolder folder;
  Lab lab({.folder = folder / "lab", .build = "test"});
  const Person ada = lab.enrolled("ada");
  const Person bob = lab.enrolled("bob");
  const Person cleo = lab.enrolled("cleo");
  for (const Person& person : {ada, bob, cleo}) lab.end(lab.begin(test::start_of(person)), test::end_of(80, true, 1));
  lab.add_note(ada.id, "ines", "first line\nsecond line");
  lab.set_consent(ada.id, kResearch, true);
  lab.set_consent(cleo.id, kResearch, true);
  lab.set_consent(cleo.id, kResearch, false);
  const json of_ada = json::parse(attempts_as_json(lab, {.trainee = ada.id}));
  ASSERT_THAT(of_ada["notes"], SizeIs(1));
  EXPECT_EQ(of_ada["notes"][0]["author"], "ines");
  EXPECT_EQ(of_ada["notes"][0]["body"], "first line\nsecond line");
  ASSERT_THAT(of_ada["consent"], SizeIs(2));
  EXPECT_TRUE(of_ada["consent"][0]["given"].is_null()) << "never asked";
  EXPECT_EQ(of_ada["consent"][1]["purpose"], "research");
  EXPECT_EQ(of_ada["consent"][1]["given"], true);
  EXPECT_FALSE(json::parse(attempts_as_json(lab)).contains("notes")) << "a cohort's table names nobody";
  EXPECT_THAT(parsed(attempts_as_csv(lab)), SizeIs(4));
  const auto rows = parsed(attempts_as_csv(lab, {.for_research = true}));
  ASSERT_THAT(rows, SizeIs(2));
  EXPECT_EQ(rows[1][0], ada.pseudonym);
  lab.make_anonymous(ada);
  EXPECT_THAT(parsed(attempts_as_csv(lab, {.for_research = true})), SizeIs(2)) << "numbers of nobody";
}

TEST(Export, TimesAreUtcAndLocalOnesAreSo) {
  EXPECT_EQ(utc_text(1'772'442'985'480), "2026-03-02T09:16:25.480Z");
  EXPECT_EQ(local_text(1'772'442'985'480, 60), "2026-03-02 10:16");
}

}  // namespace
}  // namespace stylet::lab::store
