// The records of a lab: lives of attempts, people and their pseudonyms, erasure, backup, migration.
#include "engine/lab/store/lab.h"
#include "engine/files/error.h"
#include "engine/lab/store/digest.h"
#include "engine/lab/store/identity.h"
#include "engine/lab/store/schema.h"
#include "engine/lab/store/sqlite.h"
#include "tests/lab/refusal.h"
#include "tests/lab/sample_attempts.h"
#include "tests/support/postgres_database.h"
#include "tests/support/temporary_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace stylet::lab::store {
namespace {

namespace fs = std::filesystem;
using test::end_of;
using test::start_of;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

std::string read(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Files of a folder with a text in them.
std::vector<std::string> holding(const fs::path& folder, const std::string& text) {
  std::vector<std::string> found;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file() && read(entry.path()).find(text) != std::string::npos) {
      found.push_back(fs::relative(entry.path(), folder));
    }
  }
  return found;
}

class Records : public testing::Test {
protected:
  Records() { open(); }
  void open() {
    lab_.reset();
    lab_.emplace(LabSettings{.folder = folder_.path() / "lab",
                             .build = "test",
                             .clock = [this] { return now_ms_ += 1000; },
                             .database = database_ ? database_->address() : ""});
  }
  std::string take(const Person& person, double total, bool passed, const std::string& scenario = "liver_biopsy") {
    const std::string attempt = lab_->begin(start_of(person, scenario));
    lab_->end(attempt, end_of(total, passed));
    return attempt;
  }

  support::TemporaryFolder folder_;
  std::optional<support::PostgresTestDatabase> database_;
  std::int64_t now_ms_ = 1'772'442'985'480;  // 2026-03-02
  std::optional<Lab> lab_;
};

/// On both databases.
class AnyRecords : public Records, public testing::WithParamInterface<const char*> {
protected:
  void SetUp() override {
    if (GetParam() == std::string("SQLite")) return;
    const auto server = support::test_postgres();
    if (!server) GTEST_SKIP() << "STYLET_TEST_POSTGRES is not set";
    database_.emplace(*server);
    open();
  }
};
INSTANTIATE_TEST_SUITE_P(On, AnyRecords, testing::Values("SQLite", "PostgreSQL"),
                         [](const auto& database) { return std::string(database.param); });

TEST_P(AnyRecords, AnAttemptMadeElsewhereIsTakenInAsAWholeOnce) {
  const Person ada = lab_->enrolled("ada");
  const fs::path recording = folder_.write("elsewhere.rec", "what was done");
  AttemptEnd end = end_of(82, true);
  end.recording = recording;
  const AttemptStart start = start_of(ada);
  constexpr std::int64_t kStarted = 1'790'000'000'000;
  const std::string id = lab_->take_in(start, end, kStarted, kStarted + 60'000);
  const auto attempts = lab_->attempts();
  ASSERT_THAT(attempts, SizeIs(1));
  EXPECT_EQ(attempts[0].id, id);
  EXPECT_EQ(attempts[0].started_ms, kStarted);
  EXPECT_EQ(attempts[0].ended_ms, kStarted + 60'000);
  EXPECT_EQ(attempts[0].mode, "graded");
  EXPECT_TRUE(attempts[0].counts() && attempts[0].succeeded());
  EXPECT_EQ(attempts[0].recording_sha256, sha256("what was done"));
  EXPECT_EQ(read(lab_->recording_of(id)), "what was done");
  EXPECT_THAT(lab_->metrics(id), SizeIs(31));
  EXPECT_THAT(refusal([&] { lab_->take_in(start, end, kStarted, kStarted); }),
              HasSubstr("already, as the attempt " + id));
  EXPECT_THAT(lab_->attempts(), SizeIs(1));
  EXPECT_EQ(lab_->erase(ada).recordings, 1);
  EXPECT_FALSE(fs::exists(lab_->recording_of(id)));
}

constexpr std::int64_t kTestDayMs = 86'400'000;

TEST_P(AnyRecords, WhoHasNotTrainedForTheTimeThatRecordsAreKeptIsOverdue) {
  const Person ada = lab_->enrolled("ada");
  lab_->enrolled("bob");
  take(ada, 80, true);
  EXPECT_THAT(lab_->overdue(), IsEmpty()) << "no time is set";
  for (const char* no_time : {"", "0", "-5", "ten", "10 days"}) {
    lab_->set(kRetentionDays, no_time);
    now_ms_ += 4000 * kTestDayMs;
    EXPECT_THAT(lab_->overdue(), IsEmpty()) << no_time;
    now_ms_ -= 4000 * kTestDayMs;
  }
  lab_->set(kRetentionDays, "730");
  now_ms_ += 500 * kTestDayMs;
  take(ada, 80, true);
  EXPECT_THAT(lab_->overdue(), IsEmpty());
  now_ms_ += 231 * kTestDayMs;
  const auto overdue = lab_->overdue();
  ASSERT_THAT(overdue, SizeIs(1));
  EXPECT_EQ(overdue[0].person.name, "bob");
  now_ms_ += 500 * kTestDayMs;
  EXPECT_THAT(lab_->overdue(), SizeIs(2)) << "ada's last attempt is too long ago";
}

TEST_P(AnyRecords, NumbersMadeAnonymousAreNobodysAndTheRestIsErased) {
  const Person ada = lab_->enrolled("Marguerite Yourcenar");
  lab_->set_consent(ada.id, kResearch, true);
  lab_->add_note(ada.id, "ines", "born in Brussels");
  AttemptEnd end = end_of(82.25, true, 3);
  end.recording = folder_.write("session.rec", "how she moves");
  const std::string first = lab_->begin(start_of(ada));
  lab_->end(first, end);
  now_ms_ += 9 * kTestDayMs;
  const std::string second = take(ada, 40, false);
  lab_->exclude(second, "trainer", "she was ill");
  const auto before = lab_->attempts();
  const auto metrics = lab_->metrics(first);
  const Erased gone = lab_->make_anonymous(ada);
  EXPECT_EQ(gone.attempts, 2);
  EXPECT_EQ(gone.recordings, 1);
  EXPECT_EQ(lab_->find("Marguerite Yourcenar"), std::nullopt);
  EXPECT_EQ(lab_->find(ada.pseudonym), std::nullopt);
  const auto people = lab_->people();
  ASSERT_THAT(people, SizeIs(1));
  EXPECT_TRUE(people[0].anonymous);
  EXPECT_THAT(people[0].person.name, IsEmpty());
  const auto after = lab_->attempts();
  ASSERT_THAT(after, SizeIs(2));
  EXPECT_EQ(after[0].total, 82.25);
  EXPECT_EQ(after[1].passed, false);
  EXPECT_FALSE(after[1].counts()) << "excluded as before";
  EXPECT_EQ(after[0].started_ms, 0) << "not on a calendar";
  EXPECT_EQ(after[1].started_ms, before[1].started_ms - before[0].started_ms) << "the days between stay";
  const auto kept = lab_->metrics(after[0].id);
  ASSERT_EQ(kept.size(), metrics.size());
  for (std::size_t i = 0; i < kept.size(); ++i) EXPECT_EQ(kept[i].value, metrics[i].value);
  lab_->set(kRetentionDays, "30");
  EXPECT_THAT(lab_->overdue(), IsEmpty()) << "nobody is overdue any more";
  lab_.reset();
  for (const std::string& trace : {std::string("Yourcenar"), ada.pseudonym, std::string("how she moves"),
                                   std::string("Brussels"), std::string("she was ill"), std::string("trainer")}) {
    EXPECT_THAT(holding(folder_.path() / "lab", trace), IsEmpty()) << trace;
  }
  open();
  lab_->erase(*lab_->find(people[0].person.pseudonym));
  EXPECT_THAT(lab_->attempts(), IsEmpty());
}

TEST_P(AnyRecords, AWrongPinMakesTheNextTryWaitLongerAlsoAfterARestart) {
  std::optional<Lab> lab;
  const auto start = [&] {
    lab.reset();
    lab.emplace(LabSettings{.folder = folder_.path() / "lab",
                            .build = "test",
                            .clock = [this] { return now_ms_; },
                            .database = database_ ? database_->address() : ""});
  };
  const Person ada = lab_->enrolled("ada");
  lab_.reset();
  start();
  EXPECT_FALSE(lab->pin(ada.id).has_value());
  lab->set_pin(ada.id, "a hash");
  const auto wait_ms = [&] {
    const auto pin = lab->pin(ada.id);
    return pin ? pin->wait_ms : -1;
  };
  EXPECT_EQ(wait_ms(), 0);
  std::int64_t before = 0;
  for (int i = 0; i < 12; ++i) {
    lab->pin_tried(ada.id, false);
    start();
    const std::int64_t wait = wait_ms();
    EXPECT_EQ(wait, i == 0 ? 1000 : std::min(2 * before, kLongestPinWaitMs));
    before = wait;
    now_ms_ += wait;
    EXPECT_EQ(wait_ms(), 0) << "it ends";
  }
  lab->pin_tried(ada.id, false);
  now_ms_ -= 400 * kTestDayMs;  // the clock is set back
  EXPECT_EQ(wait_ms(), kLongestPinWaitMs);
  lab->pin_tried(ada.id, true);
  EXPECT_EQ(wait_ms(), 0);
  lab->set_pin(ada.id, "");
  EXPECT_FALSE(lab->pin(ada.id).has_value());
  lab->set_pin(ada.id, "a hash");
  lab->erase(ada);
  EXPECT_THAT(lab->database().run("SELECT 1 FROM pin"), IsEmpty());
}

TEST_P(AnyRecords, WhatCannotBeTakenInWholeLeavesNothing) {
  const Person ada = lab_->enrolled("ada");
  AttemptEnd end = end_of(82, true);
  end.recording = folder_.path() / "not there.rec";
  EXPECT_THAT(refusal([&] { lab_->take_in(start_of(ada), end, 1000, 2000); }), HasSubstr("not there.rec"));
  end.recording = folder_.write("elsewhere.rec", "what was done");
  end.metrics.push_back(end.metrics.front());  // one metric twice: the records refuse it
  EXPECT_THAT(refusal([&] { lab_->take_in(start_of(ada), end, 1000, 2000); }), HasSubstr("attempt_metric"));
  EXPECT_THAT(lab_->attempts(), IsEmpty());
  for (const auto& entry : fs::recursive_directory_iterator(folder_.path() / "lab")) {
    EXPECT_NE(entry.path().extension(), ".rec") << entry.path();
  }
  end.metrics.pop_back();
  EXPECT_NO_THROW(lab_->take_in(start_of(ada), end, 1000, 2000));
}

TEST_P(AnyRecords, AnAttemptIsThereFromItsBeginningAndWholeAtItsEnd) {
  const Person ada = lab_->enrolled("ada");
  const std::string attempt = lab_->begin(start_of(ada));
  ASSERT_THAT(lab_->attempts(), SizeIs(1));
  EXPECT_EQ(lab_->attempts()[0].status, "running");
  EXPECT_FALSE(lab_->attempts()[0].counts());
  AttemptEnd end = end_of(83.5, true);
  end.metrics[3].value.reset();
  end.metrics[4].points = 7.5;
  end.recording = folder_.write("session.rec", "every step");
  lab_->end(attempt, end);
  const AttemptRecord record = lab_->attempts(ada.id)[0];
  EXPECT_EQ(record.id, attempt);
  EXPECT_EQ(record.pseudonym, ada.pseudonym);
  EXPECT_EQ(record.scenario, "liver_biopsy");
  EXPECT_EQ(record.number, 1);
  EXPECT_EQ(record.status, "ended");
  EXPECT_EQ(record.total, 83.5);
  EXPECT_EQ(record.passed, true);
  EXPECT_GT(*record.ended_ms, record.started_ms);
  EXPECT_TRUE(record.counts());
  EXPECT_TRUE(record.succeeded());
  const auto metrics = lab_->metrics(attempt);
  ASSERT_THAT(metrics, SizeIs(31));
  EXPECT_EQ(metrics[0].value, 83.5);
  EXPECT_EQ(metrics[3].value, std::nullopt);
  EXPECT_EQ(metrics[4].points, 7.5);
  EXPECT_EQ(read(lab_->recording_of(attempt)), "every step");
  EXPECT_EQ(record.recording_sha256, sha256("every step"));
  EXPECT_THAT(lab_->recording_of(attempt).string(), HasSubstr("recordings/2026/03/"));
}

TEST_P(AnyRecords, WhoWalksAwayOrIsCutOffHasFailedAndADemonstrationDoesNotCount) {
  const Person ada = lab_->enrolled("ada");
  const std::string left = lab_->begin(start_of(ada));
  AttemptEnd broken_off = end_of(90, true);  // numbers as they were: it had not come to its end
  broken_off.status = "aborted";
  lab_->end(left, broken_off);
  lab_->begin(start_of(ada));
  open();  // the program is gone without an end
  AttemptStart shown = start_of(ada);
  shown.mode = "guided";
  lab_->end(lab_->begin(shown), end_of(95, true));
  const auto all = lab_->attempts(ada.id);
  ASSERT_THAT(all, SizeIs(3));
  EXPECT_TRUE(all[0].counts());
  EXPECT_FALSE(all[0].succeeded());
  EXPECT_EQ(all[1].status, "crashed");
  EXPECT_TRUE(all[1].counts());
  EXPECT_FALSE(all[1].succeeded());
  EXPECT_FALSE(all[2].counts());
  EXPECT_TRUE(fs::is_empty(lab_->folder() / (database_ ? "running-at-server" : "running")));
}

TEST_P(AnyRecords, AnAttemptUnderWayIsNotTakenForCutOffByAnotherProgram) {
  const Person ada = lab_->enrolled("ada");
  const std::string attempt = lab_->begin(start_of(ada));
  Lab other({.folder = lab_->folder(), .build = "test", .database = database_ ? database_->address() : ""});
  EXPECT_EQ(other.attempts()[0].status, "running");
  lab_->end(attempt, end_of(80, true));
  EXPECT_EQ(other.attempts()[0].status, "ended");
}

TEST_P(AnyRecords, NumbersAreOfATraineeAtAScenario) {
  const Person ada = lab_->enrolled("ada");
  const Person bob = lab_->enrolled("bob");
  take(ada, 50, false);
  take(bob, 60, false);
  take(ada, 70, true, "tutorial");
  take(ada, 80, true);
  const auto all = lab_->attempts();
  EXPECT_THAT((std::vector{all[0].number, all[1].number, all[2].number, all[3].number}),
              testing::ElementsAre(1, 1, 1, 2));
  EXPECT_THAT(lab_->attempts(ada.id), SizeIs(3));
  const auto people = lab_->people();
  ASSERT_THAT(people, SizeIs(2));
  EXPECT_EQ(people[0].person.name, "ada");
  EXPECT_EQ(people[0].attempts, 3);
  EXPECT_EQ(people[0].passed, 2);
  EXPECT_EQ(people[1].passed, 0);
  EXPECT_EQ(lab_->taken_by(all[1].id), people[1].person.pseudonym);
  EXPECT_EQ(lab_->taken_by("nobody's"), std::nullopt);
}

TEST_F(Records, MetricsAtAScenarioAreThoseOfEachByTheirNames) {
  take(lab_->enrolled("ada"), 50, false);
  take(lab_->enrolled("bob"), 60, true);
  const auto all = lab_->all_metrics();
  const std::string metric = all.begin()->second.back().metric;
  const std::string scenario = lab_->attempts()[0].scenario_sha256;
  const auto named = lab_->metrics_at(scenario, {metric, "no_such_metric"});
  ASSERT_THAT(named, SizeIs(2));
  for (const auto& [attempt, metrics] : named) {
    ASSERT_THAT(metrics, SizeIs(1)) << "of the one that was asked for";
    EXPECT_EQ(metrics[0].metric, metric);
    EXPECT_EQ(metrics[0].value, all.at(attempt).back().value);
  }
  EXPECT_THAT(lab_->metrics_at(scenario, {}), IsEmpty());
  EXPECT_THAT(lab_->metrics_at("another", {metric}), IsEmpty());
}

TEST_P(AnyRecords, PeopleAreFoundByNameOrPseudonymAsTheyAreWritten) {
  const Person ada = lab_->enrolled("ada lovelace");
  EXPECT_TRUE(ada.added);
  EXPECT_FALSE(lab_->enrolled("ada lovelace").added);
  EXPECT_TRUE(is_pseudonym(ada.pseudonym));
  std::string lower = ada.pseudonym;
  std::ranges::transform(lower, lower.begin(), [](char c) { return static_cast<char>(std::tolower(c)); });
  EXPECT_EQ(lab_->get(lower).id, ada.id);
  EXPECT_THAT(refusal([&] { lab_->get("ada lovelacs"); }), HasSubstr("did you mean ada lovelace?"));
  for (const char* name : {"", " ada", "ada\n", "\xff\xfe"}) {
    EXPECT_THAT(refusal([&] { lab_->enrolled(name); }), HasSubstr("is no name of a trainee")) << name;
  }
  EXPECT_THAT(refusal([&] { lab_->enrolled(std::string(201, 'a')); }), HasSubstr("is no name"));
  // Whatever is typed is a name, never SQL.
  const Person odd = lab_->enrolled("x'); DROP TABLE attempt; --</script>");
  EXPECT_EQ(lab_->get("x'); DROP TABLE attempt; --</script>").id, odd.id);
  EXPECT_THAT(lab_->people(), SizeIs(2));
}

TEST_F(Records, NamesAreInTheRosterAlone) {
  take(lab_->enrolled("Marguerite Yourcenar"), 80, true);
  lab_->back_up(folder_.path() / "copy");
  lab_.reset();
  EXPECT_THAT(holding(folder_.path(), "Yourcenar"), testing::UnorderedElementsAre("lab/roster.db", "copy/roster.db"));
  const fs::perms open = fs::perms::group_all | fs::perms::others_all;
  for (const char* file : {"lab", "lab/lab.db", "lab/roster.db", "copy", "copy/roster.db"}) {
    EXPECT_EQ(fs::status(folder_.path() / file).permissions() & open, fs::perms::none) << file;
  }
}

TEST_F(Records, AnErasureTakesEverythingOfAPersonAndTellsWhatItCannotReach) {
  const Person ada = lab_->enrolled("Marguerite Yourcenar");
  const Person bob = lab_->enrolled("bob");
  const std::string attempt = lab_->begin(start_of(ada));
  AttemptEnd end = end_of(12.125, true);
  end.recording = folder_.write("session.rec", "how she moves");
  lab_->end(attempt, end);
  lab_->exclude(attempt, "trainer", "device unplugged");
  take(bob, 60, false);
  const fs::path backup = lab_->back_up();
  const Erased erased = lab_->erase(ada);
  EXPECT_EQ(erased.attempts, 1);
  EXPECT_EQ(erased.recordings, 1);
  EXPECT_THAT(erased.backups, testing::ElementsAre(backup));
  EXPECT_EQ(lab_->find("Marguerite Yourcenar"), std::nullopt);
  EXPECT_EQ(lab_->find(ada.pseudonym), std::nullopt);
  EXPECT_THAT(lab_->attempts(), SizeIs(1));
  EXPECT_FALSE(fs::exists(lab_->recording_of(attempt)));
  lab_.reset();
  fs::remove_all(backup);
  const fs::path lab = folder_.path() / "lab";
  for (const std::string& trace :
       {std::string("Yourcenar"), ada.pseudonym, std::string("how she moves"), std::string("unplugged")}) {
    EXPECT_THAT(holding(lab, trace), IsEmpty()) << trace << ": also where the file was written before";
  }
}

TEST_F(Records, AnErasureThatWasCutOffIsFinishedAtTheNextStart) {
  const Person ada = lab_->enrolled("Yourcenar");  // no digits of an id
  const std::string attempt = lab_->begin(start_of(ada));
  AttemptEnd end = end_of(12, true);
  end.recording = folder_.write("session.rec", "how she moves");
  lab_->end(attempt, end);
  const fs::path recording = lab_->recording_of(attempt);
  const std::string kept = read(recording);
  const std::string roster = read(lab_->folder() / "roster.db");
  lab_->erase(ada);
  lab_.reset();
  // As a kill after the records' commit leaves it.
  std::ofstream(recording, std::ios::binary) << kept;
  std::ofstream(folder_.path() / "lab/roster.db", std::ios::binary) << roster;
  const fs::path part = recording.string() + ".part";  // and another one in the middle of a recording
  std::ofstream(part, std::ios::binary) << kept;
  {
    SqliteDatabase records(folder_.path() / "lab/lab.db", 0x53744C62);
    records.run("INSERT INTO tombstone VALUES ($1, 'name', 0)", {ada.pseudonym});
  }
  open();
  EXPECT_FALSE(fs::exists(part));
  EXPECT_FALSE(fs::exists(recording));
  EXPECT_THAT(holding(lab_->folder(), "Yourcenar"), IsEmpty());
}

TEST_P(AnyRecords, AnExclusionHasAnAuthorAndAReasonAndCanBeUndone) {
  const Person ada = lab_->enrolled("ada");
  const std::string attempt = take(ada, 20, false);
  take(ada, 80, true);
  EXPECT_EQ(lab_->exclude(attempt.substr(24), "trainer", "stylus unplugged"), attempt);
  EXPECT_EQ(lab_->attempts()[0].excluded, "stylus unplugged");
  EXPECT_FALSE(lab_->attempts()[0].counts());
  EXPECT_TRUE(lab_->attempts()[1].counts());
  lab_->exclude(attempt, "trainer", "");
  EXPECT_TRUE(lab_->attempts()[0].counts());
  EXPECT_THAT(refusal([&] { lab_->exclude("", "trainer", "x"); }), HasSubstr("lists the ends of their ids"));
  EXPECT_THAT(refusal([&] { lab_->exclude("zzz", "trainer", "x"); }), HasSubstr("is no attempt"));
}

TEST_F(Records, NamesOutliveRecordsThatWereLost) {
  const Person ada = lab_->enrolled("ada");
  lab_.reset();
  fs::rename(folder_ / "lab/lab.db", folder_ / "lost.db");
  open();
  EXPECT_EQ(lab_->find("ada"), std::nullopt);
  EXPECT_EQ(lab_->enrolled("ada").pseudonym, ada.pseudonym);
  lab_.reset();
  fs::remove(folder_ / "lab/lab.db");
  fs::rename(folder_ / "lost.db", folder_ / "lab/lab.db");
  open();
  EXPECT_EQ(lab_->get("ada").id, ada.id) << "restored, everybody is there again";
}

TEST_F(Records, WhoWasErasedComesBackAsSomebodyNew) {
  const Person ada = lab_->enrolled("ada");
  lab_->erase(ada);
  // As if the roster could not be written then.
  SqliteDatabase(folder_ / "lab/roster.db", 0x53744C72)
      .run("INSERT INTO person VALUES ($1, 'ada', 0)", {ada.pseudonym});
  lab_->database().run("INSERT INTO tombstone VALUES ($1, 'name', 0)", {ada.pseudonym});
  EXPECT_NE(lab_->enrolled("ada").pseudonym, ada.pseudonym);
  open();
  EXPECT_EQ(lab_->people()[0].person.name, "ada");
}

TEST_P(AnyRecords, ASlipInAPseudonymEnrolsNobody) {
  const Person ada = lab_->enrolled("ada");
  std::string slip = ada.pseudonym;
  slip[2] = slip[2] == '7' ? '8' : '7';
  EXPECT_THAT(refusal([&] { lab_->enrolled(slip); }), HasSubstr("did you mean " + ada.pseudonym));
  EXPECT_THAT(refusal([&] { lab_->enrolled(ada.pseudonym.substr(0, 6)); }), HasSubstr("did you mean"));
  std::string of_nobody;
  do {
    of_nobody = new_pseudonym();
  } while (!looks_like_pseudonym(of_nobody) || of_nobody == ada.pseudonym);
  EXPECT_THAT(refusal([&] { lab_->enrolled(of_nobody); }), HasSubstr("is nobody's"));
  for (const char* name : {"charles", "1234567", "bob"}) EXPECT_TRUE(lab_->enrolled(name).added) << name;
}

TEST_P(AnyRecords, TheRecordingIsACopyAndTheNumbersAreKeptAlsoWithoutIt) {
  const Person ada = lab_->enrolled("ada");
  const std::string attempt = lab_->begin(start_of(ada));
  AttemptEnd end = end_of(80, true);
  end.recording = folder_.write("session.rec", "every step");
  EXPECT_THAT(lab_->end(attempt, end), IsEmpty());
  std::ofstream(end.recording, std::ios::binary | std::ios::in) << "other";  // in place
  EXPECT_EQ(read(lab_->recording_of(attempt)), "every step");
  fs::remove_all(lab_->folder() / "recordings");
  std::ofstream(lab_->folder() / "recordings") << "in the way";
  const std::string second = lab_->begin(start_of(ada));
  EXPECT_THAT(lab_->end(second, end), HasSubstr("recordings"));
  const AttemptRecord record = lab_->attempts()[1];
  EXPECT_TRUE(record.succeeded());
  EXPECT_THAT(record.recording_sha256, IsEmpty());
  EXPECT_THAT(lab_->metrics(second), SizeIs(31));
}

TEST_P(AnyRecords, ABeginningThatCannotBeWrittenLeavesNothing) {
  AttemptStart nobody = start_of({.id = "nobody"});
  EXPECT_THROW(lab_->begin(nobody), files::ContentError);
  EXPECT_TRUE(fs::is_empty(lab_->folder() / (database_ ? "running-at-server" : "running")));
}

TEST_P(AnyRecords, AClockThatIsSetBackChangesNoOrderAndNoLastWord) {
  const Person ada = lab_->enrolled("ada");
  const std::string first = take(ada, 20, false);
  lab_->exclude(first, "trainer", "unplugged");
  now_ms_ -= 600'000;
  lab_->exclude(first, "trainer", "");
  const std::string second = take(ada, 80, true);
  EXPECT_THAT(lab_->attempts()[0].excluded, IsEmpty());
  EXPECT_EQ(lab_->attempts()[1].id, second);
  EXPECT_EQ(lab_->attempts()[1].number, 2);
}

TEST_P(AnyRecords, ACutOffAttemptIsFoundWhateverTheComputerIsCalled) {
  lab_->begin(start_of(lab_->enrolled("ada")));
  lab_->database().run("UPDATE station SET name = 'as it was called'");
  open();
  EXPECT_EQ(lab_->attempts()[0].status, "crashed");
}

TEST_P(AnyRecords, PassesOfTheListAreThoseThatCount) {
  const Person ada = lab_->enrolled("ada");
  AttemptStart shown = start_of(ada);
  shown.mode = "guided";
  lab_->end(lab_->begin(shown), end_of(95, true));
  const std::string passed = take(ada, 80, true);
  EXPECT_EQ(lab_->people()[0].attempts, 2);
  EXPECT_EQ(lab_->people()[0].passed, 1);
  lab_->exclude(passed, "trainer", "by a rule");
  EXPECT_EQ(lab_->people()[0].passed, 0);
  lab_->exclude(passed, "trainer", "");
  EXPECT_EQ(lab_->people()[0].passed, 1);
}

TEST_P(AnyRecords, NothingGoesWithItsAttemptUnasked) {
  take(lab_->enrolled("ada"), 80, true);
  EXPECT_THROW(lab_->database().run("DELETE FROM attempt"), files::ContentError);
  EXPECT_THAT(lab_->all_metrics(), SizeIs(1));
}

TEST_F(Records, ABackupTakesNothingAwayAndIsKnownToAnErasure) {
  const Person ada = lab_->enrolled("ada");
  fs::create_directories(folder_ / "copy.part");
  folder_.write("copy.part/mine", "a file of somebody");
  EXPECT_THAT(refusal([&] { lab_->back_up(folder_ / "copy"); }), HasSubstr("copy.part: is there already"));
  EXPECT_EQ(read(folder_ / "copy.part/mine"), "a file of somebody");
  const fs::path stick = lab_->back_up(folder_ / "stick");
  EXPECT_FALSE(fs::exists(folder_ / "stick.part"));
  EXPECT_TRUE(fs::is_empty(lab_->folder() / "backups")) << "the one on the way";
  EXPECT_THAT(lab_->erase(ada).backups, testing::ElementsAre(stick));
}

TEST_F(Records, ABackupIsALabOfItsOwn) {
  const Person ada = lab_->enrolled("ada");
  const std::string attempt = lab_->begin(start_of(ada));
  AttemptEnd end = end_of(80, true);
  end.recording = folder_.write("session.rec", "every step");
  lab_->end(attempt, end);
  const fs::path to = lab_->back_up(folder_.path() / "copy");
  take(ada, 90, true);
  EXPECT_THAT(refusal([&] { lab_->back_up(to); }), HasSubstr("is there already"));
  Lab copy({.folder = to, .build = "test"});
  ASSERT_THAT(copy.attempts(), SizeIs(1));
  EXPECT_THAT(copy.metrics(attempt), SizeIs(31));
  EXPECT_EQ(copy.get("ada").id, ada.id);
  EXPECT_EQ(read(copy.recording_of(attempt)), "every step");
}

TEST_F(Records, OfANewerProgramAreRefusedAndOfAnotherOneToo) {
  lab_->database().run("INSERT INTO schema_version VALUES (99, 0, 'future')");
  lab_.reset();
  EXPECT_THAT(refusal([&] { open(); }), HasSubstr("made by a newer Stylet"));
  const fs::path strange = folder_.path() / "strange";
  fs::create_directories(strange);
  { SqliteDatabase other(strange / "lab.db", 7); }
  EXPECT_THAT(refusal([&] { Lab lab({.folder = strange}); }), HasSubstr("another program"));
  folder_.write("text", "");
  EXPECT_THAT(refusal([&] { Lab lab({.folder = folder_.path() / "text"}); }), HasSubstr("text"));
}

TEST(Migrations, GoForwardAllOrNothing) {
  const support::TemporaryFolder folder;
  SqliteDatabase database(folder / "lab.db", 1);
  std::vector<Migration> steps(migrations().begin(), migrations().end());
  migrate(database, steps, 1, "old");
  const int before = schema_version(database);
  database.run("INSERT INTO trainee VALUES ('a', 'P', 'trainee', '', 1)");
  steps.push_back(
      {.version = before + 1, .statements = {"ALTER TABLE trainee ADD COLUMN born TEXT", "CREATE TABLE broken("}});
  EXPECT_THROW(migrate(database, steps, 2, "new"), files::ContentError);
  EXPECT_EQ(schema_version(database), before);
  EXPECT_THROW(database.run("SELECT born FROM trainee"), files::ContentError) << "the first half is rolled back";
  steps.back().statements.pop_back();
  migrate(database, steps, 3, "new");
  migrate(database, steps, 4, "new");
  EXPECT_EQ(schema_version(database), before + 1);
  EXPECT_EQ(text(database.run("SELECT pseudonym FROM trainee WHERE born IS NULL")[0][0]), "P");
  EXPECT_EQ(integer(database.run("SELECT count(*) FROM schema_version")[0][0]), before + 1);
}

TEST(Migrations, TheVeryFirstRecordsAreOpenedAndGoOn) {
  const support::TemporaryFolder folder;
  const fs::path lab = folder.path() / "lab";
  fs::create_directories(lab);
  const std::string attempt = new_id(1'772'442'985'480);
  {
    // As the first version wrote them.
    SqliteDatabase database(lab / "lab.db", 0x53744C62);
    migrate(database, migrations().first(1), 1, "first");
    ASSERT_EQ(schema_version(database), 1);
    EXPECT_THROW(database.run("SELECT 1 FROM setting"), files::ContentError);
    database.run("INSERT INTO station VALUES ('s', 'here', 1)");
    database.run("INSERT INTO trainee VALUES ('t', $1, 'trainee', '', 1)", {std::string("7Q4M2KX")});
    database.run("INSERT INTO scenario VALUES ('h', 'liver_biopsy', 'A title', '[]')");
    database.run(
        "INSERT INTO attempt(id, trainee, scenario, station, mode, build, stylus, loop_mode, started_ms, "
        "utc_offset_min, ended_ms, status, total, passed) VALUES ($1, 't', 'h', 's', 'graded', 'first', 'mouse', "
        "'threaded', 1772442985480, 60, 1772443000000, 'ended', 82.5, 1)",
        {attempt});
    database.run("INSERT INTO attempt_metric VALUES ($1, 'elapsed_time', 61.5, NULL, NULL)", {attempt});
  }
  Lab opened({.folder = lab, .build = "now"});
  EXPECT_EQ(schema_version(opened.database()), migrations().back().version);
  const auto attempts = opened.attempts();
  ASSERT_THAT(attempts, SizeIs(1));
  EXPECT_EQ(attempts[0].total, 82.5);
  EXPECT_TRUE(attempts[0].succeeded());
  EXPECT_EQ(opened.metrics(attempt)[0].value, 61.5);
  bool copied = false;
  for (const auto& entry : fs::directory_iterator(lab / "backups")) {
    copied = copied || entry.path().filename().string().starts_with("before-version-");
  }
  EXPECT_TRUE(copied) << "as it was before";
  // And everything of today works on it.
  opened.set(kRetentionDays, "30");
  EXPECT_THAT(opened.overdue(), SizeIs(1));
  opened.set_consent("t", kResearch, true);
  opened.set_pin("t", "a hash");
  opened.add_note("t", "ines", "good");
  opened.end(opened.begin(start_of({.id = "t"})), end_of(90, true));
  EXPECT_THAT(opened.attempts(), SizeIs(2));
}

TEST(Migrations, WhatWaitedBeforeAnybodyWasAskedIsKept) {
  const support::TemporaryFolder folder;
  const fs::path lab = folder.path() / "lab";
  fs::create_directories(lab);
  {
    SqliteDatabase database(lab / "lab.db", 0x53744C62);
    migrate(database, migrations().first(4), 1, "asks nobody");
    database.run("INSERT INTO station VALUES ('s', 'here', 1)");
    database.run("INSERT INTO trainee VALUES ('t', '7Q4M2KX', 'trainee', '', 1)");
    database.run("INSERT INTO scenario VALUES ('h', 'liver_biopsy', 'A title', '[]')");
    database.run(
        "INSERT INTO attempt(id, trainee, scenario, station, mode, build, stylus, loop_mode, started_ms, "
        "utc_offset_min, status) VALUES ('a', 't', 'h', 's', 'graded', 'b', 'mouse', 'threaded', 1, 60, 'ended')");
    database.run("INSERT INTO outbox VALUES ('one', 'a', 0, '{}', 1, 'waiting', '')");
  }
  Lab opened({.folder = lab, .build = "now"});
  EXPECT_THAT(opened.database().run("SELECT 1 FROM outbox WHERE state = 'waiting'"), SizeIs(1));
  EXPECT_FALSE(opened.consents_to("t", kRecordStore));
  opened.set_consent("t", kRecordStore, false);
  EXPECT_THAT(opened.database().run("SELECT 1 FROM outbox"), IsEmpty()) << "asked, and refused";
}

TEST(Identity, IdsSortByTimeAndPseudonymsFindASlip) {
  const std::string early = new_id(1'000'000);
  const std::string late = new_id(1'000'001);
  EXPECT_TRUE(is_id(early));
  EXPECT_LT(early, late);
  EXPECT_EQ(time_of(late), 1'000'001);
  EXPECT_EQ(early[14], '7');
  EXPECT_THAT(std::string("89ab"), HasSubstr(std::string(1, early[19])));
  EXPECT_FALSE(is_id("../../../../etc/passwd"));
  std::set<std::string> seen;
  for (int i = 0; i < 200; ++i) {
    const std::string pseudonym = new_pseudonym();
    EXPECT_TRUE(is_pseudonym(pseudonym));
    seen.insert(pseudonym);
    for (std::size_t at = 0; at < pseudonym.size(); ++at) {
      std::string slip = pseudonym;
      slip[at] = slip[at] == '7' ? '8' : '7';
      EXPECT_FALSE(is_pseudonym(slip)) << pseudonym << ' ' << slip;
    }
  }
  EXPECT_GT(seen.size(), 190u);
  EXPECT_EQ(normalized_pseudonym("oil7"), "0117");
}

TEST(Digest, IsSha256) {
  EXPECT_EQ(sha256("abc"), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");  // FIPS 180-2
  const support::TemporaryFolder folder;
  EXPECT_EQ(sha256_of_file(folder.write("abc", "abc")), sha256("abc"));
}

}  // namespace
}  // namespace stylet::lab::store
