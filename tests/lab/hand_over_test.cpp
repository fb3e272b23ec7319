// What a station gives to its server: everything once, whoever it was, whatever was killed in between.
#include "engine/lab/store/identity.h"
#include "engine/lab/store/lab.h"
#include "tests/lab/sample_attempts.h"
#include "tests/support/postgres_database.h"
#include "tests/support/temporary_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <filesystem>
#include <functional>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <thread>
#include <vector>

namespace stylet::lab::store {
namespace {

namespace fs = std::filesystem;
using test::end_of;
using test::start_of;
using ::testing::ElementsAre;
using ::testing::Field;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

class HandOver : public testing::TestWithParam<const char*> {
protected:
  void SetUp() override {
    if (GetParam() == std::string("PostgreSQL")) {
      const auto address = support::test_postgres();
      if (!address) GTEST_SKIP() << "STYLET_TEST_POSTGRES is not set";
      database_.emplace(*address);
    }
    own_.emplace(own_settings());
    own_->database().run("PRAGMA synchronous=OFF");
    server_.emplace(server_settings());
  }
  LabSettings own_settings() const { return {.folder = folder_ / "own", .build = "test"}; }
  LabSettings server_settings() const {
    return {.folder = folder_ / "server", .build = "test", .database = database_ ? database_->address() : ""};
  }
  /// Somebody of whom a record store may be told.
  static Person told_of(Lab& lab, const std::string& who) {
    const Person person = lab.enrolled(who);
    if (!lab.consents_to(person.id, kRecordStore)) lab.set_consent(person.id, kRecordStore, true);
    return person;
  }
  std::string take(Lab& lab, const Person& person, double total = 80) const {
    const std::string attempt = lab.begin(start_of(person));
    AttemptEnd end = end_of(total, total >= 70);
    end.recording = recording_;
    lab.end(attempt, end);
    return attempt;
  }
  static std::vector<std::string> column(Lab& lab, const std::string& query) {
    std::vector<std::string> all;
    for (const Row& row : lab.database().run(query)) all.push_back(text(row[0]));
    return all;
  }
  /// The own files as they were, as a kill after the server's commit leaves them.
  void with_own_files_back(const std::function<void()>& act) {
    own_.reset();
    fs::copy(folder_ / "own/lab.db", folder_ / "before.db");
    own_.emplace(own_settings());
    act();
    own_.reset();
    fs::copy(folder_ / "before.db", folder_ / "own/lab.db", fs::copy_options::overwrite_existing);
    own_.emplace(own_settings());
  }

  support::TemporaryFolder folder_;
  fs::path recording_ = folder_.write("session.rec", "every step");
  std::optional<support::PostgresTestDatabase> database_;
  std::optional<Lab> own_;
  std::optional<Lab> server_;
};
INSTANTIATE_TEST_SUITE_P(To, HandOver, testing::Values("SQLite", "PostgreSQL"),
                         [](const auto& database) { return std::string(database.param); });

TEST_P(HandOver, GivesEverythingOfAnAttemptAndKeepsNothingButItsRecording) {
  const Person ada = own_->enrolled("ada");
  const std::string first = take(*own_, ada, 20);
  const std::string second = take(*own_, ada, 80.125);
  own_->exclude(first, "trainer", "unplugged");
  own_->add_note(ada.id, "ines", "hesitates");
  const AttemptRecord before = own_->attempts()[1];
  const HandedOver done = own_->hand_over(*server_);
  EXPECT_EQ(done.attempts, 2);
  EXPECT_EQ(done.people, 1);
  EXPECT_THAT(own_->attempts(), IsEmpty());
  EXPECT_THAT(own_->all_metrics(), IsEmpty());
  EXPECT_TRUE(fs::exists(own_->recording_of(second)));
  const auto there = server_->attempts();
  ASSERT_THAT(there, SizeIs(2));
  EXPECT_EQ(there[0].id, first);
  EXPECT_EQ(there[0].excluded, "unplugged");
  EXPECT_EQ(there[1].id, second);
  EXPECT_EQ(there[1].pseudonym, ada.pseudonym);
  EXPECT_EQ(there[1].total, 80.125);
  EXPECT_EQ(there[1].started_ms, before.started_ms);
  EXPECT_EQ(there[1].ended_ms, before.ended_ms);
  EXPECT_EQ(there[1].scenario_sha256, before.scenario_sha256);
  EXPECT_EQ(there[1].recording_sha256, before.recording_sha256);
  EXPECT_THAT(server_->metrics(second), SizeIs(31));
  EXPECT_EQ(server_->metrics(second)[7].value, 87.125);
  EXPECT_THAT(server_->notes(ada.id), ElementsAre(Field(&Note::body, "hesitates")));
  EXPECT_EQ(server_->get("ada").pseudonym, ada.pseudonym);
  own_->hand_over(*server_);
  EXPECT_THAT(server_->attempts(), SizeIs(2));
  EXPECT_THAT(server_->notes(ada.id), SizeIs(1));
}

TEST_P(HandOver, AgainAfterAKillAtItsWorstMomentIsTheSameAndEachStatementIsToldOnce) {
  server_->set(kHomePage, "https://lab.example/stylet/");
  const std::string attempt = take(*own_, told_of(*own_, "ada"));
  std::set<std::string> told;
  with_own_files_back([&] {
    own_->hand_over(*server_);
    for (const std::string& id : column(*server_, "SELECT statement FROM outbox")) told.insert(id);
  });
  EXPECT_THAT(told, SizeIs(3)) << "initialized, completed, passed";
  server_->database().run("DELETE FROM outbox");  // the record store has them
  ASSERT_THAT(own_->attempts(), SizeIs(1));
  EXPECT_EQ(own_->hand_over(*server_).attempts, 0);
  EXPECT_THAT(own_->attempts(), IsEmpty());
  EXPECT_THAT(server_->attempts(), SizeIs(1));
  EXPECT_THAT(server_->metrics(attempt), SizeIs(31));
  EXPECT_THAT(column(*server_, "SELECT statement FROM outbox"), IsEmpty());
}

TEST_P(HandOver, StatementsOfAStationsOwnWaitAtAServerThatTellsNobodyYet) {
  own_->set(kHomePage, "https://lab.example/stylet/");
  take(*own_, told_of(*own_, "ada"));
  const auto waiting = column(*own_, "SELECT body FROM outbox ORDER BY seq");
  own_->hand_over(*server_);
  EXPECT_THAT(waiting, SizeIs(3));
  EXPECT_EQ(column(*server_, "SELECT body FROM outbox ORDER BY seq"), waiting);
  EXPECT_THAT(column(*own_, "SELECT body FROM outbox"), IsEmpty());
}

TEST_P(HandOver, TheLastWordOnAPurposeCountsWhereverItWasSaid) {
  server_->set(kHomePage, "https://lab.example/stylet/");
  const Person there = server_->enrolled("ada");
  const Person here = told_of(*own_, "ada");
  ASSERT_NE(here.id, there.id);
  take(*own_, here);
  own_->hand_over(*server_);
  EXPECT_TRUE(server_->consents_to(there.id, kRecordStore)) << "said at the station, of whom the server knew by name";
  EXPECT_THAT(column(*server_, "SELECT statement FROM outbox"), SizeIs(3));
  // Taken back there, where the station does not know it yet.
  server_->set_consent(there.id, kRecordStore, false);
  EXPECT_THAT(column(*server_, "SELECT statement FROM outbox"), IsEmpty());
  take(*own_, here);
  own_->hand_over(*server_);
  EXPECT_TRUE(server_->refuses(there.id, kRecordStore));
  EXPECT_THAT(column(*server_, "SELECT statement FROM outbox"), IsEmpty());
  // And the other way round: what waits at the server goes once the station hands over the refusal.
  server_->set_consent(there.id, kRecordStore, true);
  take(*server_, there);
  EXPECT_THAT(column(*server_, "SELECT statement FROM outbox"), SizeIs(3));
  std::this_thread::sleep_for(std::chrono::milliseconds(5));  // another clock's reading than that of the word before
  own_->set_consent(here.id, kRecordStore, false);
  own_->hand_over(*server_);
  EXPECT_TRUE(server_->refuses(there.id, kRecordStore));
  EXPECT_THAT(column(*server_, "SELECT statement FROM outbox"), IsEmpty());
  EXPECT_THAT(server_->attempts(there.id), SizeIs(3)) << "which are kept as before";
}

TEST_P(HandOver, StatementsOfWhomTheServerHasTheRefusalStayBehind) {
  own_->set(kHomePage, "https://lab.example/stylet/");
  const Person there = server_->enrolled("ada");
  const Person here = own_->known(there);
  own_->set_consent(here.id, kRecordStore, true);
  take(*own_, here);
  EXPECT_THAT(column(*own_, "SELECT statement FROM outbox"), SizeIs(3));
  std::this_thread::sleep_for(std::chrono::milliseconds(5));
  server_->set_consent(there.id, kRecordStore, false);
  own_->hand_over(*server_);
  EXPECT_THAT(server_->attempts(), SizeIs(1));
  EXPECT_THAT(column(*server_, "SELECT statement FROM outbox"), IsEmpty());
  EXPECT_THAT(column(*own_, "SELECT statement FROM outbox"), IsEmpty());
}

TEST_P(HandOver, APinGoesAlongAndChangesNoneThatIsThere) {
  const Person ada = own_->enrolled("ada");
  own_->set_pin(ada.id, "of the station");
  own_->hand_over(*server_);
  ASSERT_TRUE(server_->pin(ada.id).has_value());
  EXPECT_EQ(server_->pin(ada.id).value_or(Pin{}).hash, "of the station");
  server_->set_pin(ada.id, "of the server");
  own_->hand_over(*server_);
  EXPECT_EQ(server_->pin(ada.id).value_or(Pin{}).hash, "of the server");
}

TEST_P(HandOver, WhoseNumbersAloneAreLeftIsNobodyAtTheServerToo) {
  const Person ada = own_->enrolled("ada");
  own_->set_consent(ada.id, kResearch, true);
  take(*own_, ada);
  own_->make_anonymous(ada);
  own_->hand_over(*server_);
  ASSERT_THAT(server_->people(), SizeIs(1));
  EXPECT_TRUE(server_->people()[0].anonymous);
  EXPECT_THAT(server_->everybody(), IsEmpty());
  EXPECT_EQ(server_->find("ada"), std::nullopt);
  ASSERT_THAT(server_->attempts(), SizeIs(1));
  EXPECT_EQ(server_->attempts()[0].started_ms, 0);
}

TEST_P(HandOver, LeavesWhatIsUnderWayAndWhatWasWrittenOfAnAttemptMeanwhile) {
  const Person ada = own_->enrolled("ada");
  const std::string attempt = own_->begin(start_of(ada));
  EXPECT_EQ(own_->hand_over(*server_).attempts, 0);
  own_->end(attempt, end_of(80, true));
  with_own_files_back([&] { own_->hand_over(*server_); });
  own_->exclude(attempt, "trainer", "unplugged");
  EXPECT_EQ(own_->hand_over(*server_).attempts, 0);
  EXPECT_EQ(server_->attempts()[0].excluded, "unplugged");
  EXPECT_THAT(own_->attempts(), IsEmpty());
}

TEST_P(HandOver, WhoIsThereAlreadyByNameIsThatPersonAndIsToldOfByTheirPseudonym) {
  server_->set(kHomePage, "https://lab.example/stylet/");
  const Person there = server_->enrolled("ada");
  const Person here = told_of(*own_, "ada");
  ASSERT_NE(here.id, there.id);
  const std::string attempt = take(*own_, here);
  EXPECT_EQ(own_->hand_over(*server_).people, 0);
  EXPECT_THAT(server_->people(), SizeIs(1));
  EXPECT_EQ(server_->attempts(there.id)[0].id, attempt);
  EXPECT_EQ(server_->of_station(here.id)->id, there.id);
  EXPECT_THAT(column(*server_, "SELECT body FROM outbox"), SizeIs(3));
  for (const std::string& body : column(*server_, "SELECT body FROM outbox")) {
    EXPECT_THAT(body, HasSubstr(there.pseudonym));
    EXPECT_THAT(body, Not(HasSubstr(here.pseudonym)));
  }
}

TEST_P(HandOver, WhoGaveAPseudonymWhileTheServerWasAwayIsItsOwner) {
  Person there = server_->enrolled("ada");
  for (int k = 0; !looks_like_pseudonym(there.pseudonym); ++k) there = server_->enrolled("ada" + std::to_string(k));
  const Person here = own_->enrolled_without_server(there.pseudonym);
  EXPECT_TRUE(here.added);
  EXPECT_EQ(own_->enrolled_without_server(there.pseudonym).id, here.id);
  take(*own_, here);
  own_->hand_over(*server_);
  EXPECT_THAT(server_->attempts(there.id), SizeIs(1));
  // One of letters alone is taken for a name.
  const std::string letters = "ABCDEFG";
  server_->database().run(
      "INSERT INTO trainee(id, pseudonym, role, level, created_ms) VALUES ($1, $2, 'trainee', '', 1)",
      {new_id(1), letters});
  take(*own_, own_->enrolled_without_server("abcdefg"));
  own_->hand_over(*server_);
  EXPECT_THAT(server_->attempts(server_->get(letters).id), SizeIs(1));
}

TEST_P(HandOver, TwoPeopleWhoGotOnePseudonymByChanceStayTwo) {
  const Person there = server_->enrolled("bob");
  own_->known({.id = new_id(1), .pseudonym = there.pseudonym, .name = "ada"});
  take(*own_, own_->get("ada"));
  own_->hand_over(*server_);
  EXPECT_THAT(server_->attempts(there.id), IsEmpty());
  EXPECT_THAT(server_->attempts(server_->get("ada").id), SizeIs(1));
}

TEST_P(HandOver, WhoWasErasedThereStaysErasedAndIsErasedHere) {
  const Person there = server_->enrolled("ada");
  const Person here = own_->known(there);
  const std::string before = take(*own_, here);
  own_->hand_over(*server_);
  server_->erase(there);
  const std::string after = take(*own_, here);  // nobody told the station yet
  const HandedOver done = own_->hand_over(*server_);
  EXPECT_EQ(done.erased, 1);
  EXPECT_EQ(done.attempts, 0);
  EXPECT_THAT(server_->attempts(), IsEmpty());
  EXPECT_THAT(server_->people(), IsEmpty());
  EXPECT_EQ(own_->find("ada"), std::nullopt);
  EXPECT_THAT(own_->attempts(), IsEmpty());
  EXPECT_FALSE(fs::exists(own_->recording_of(after)));
  server_.reset();
  LabSettings at_station = server_settings();  // as the station opens it, with its own recordings
  if (database_) {
    at_station.folder = own_->folder();
    const Lab opened(at_station);
    EXPECT_FALSE(fs::exists(own_->recording_of(before)));
  }
}

TEST_P(HandOver, WhoWasJoinedByNameAndErasedThereStaysErasedToo) {
  const Person there = server_->enrolled("ada");
  const Person here = own_->enrolled("ada");
  take(*own_, here);
  own_->hand_over(*server_);
  server_->erase(there);
  take(*own_, here);
  EXPECT_EQ(own_->hand_over(*server_).erased, 1);
  EXPECT_THAT(server_->attempts(), IsEmpty());
  EXPECT_THAT(server_->people(), IsEmpty());
  EXPECT_TRUE(own_->enrolled("ada").added) << "who comes back is somebody new";
}

TEST_P(HandOver, CarriesTablesThatCameLater) {
  for (Lab* lab : {&*own_, &*server_}) {
    for (const char* table :
         {"CREATE TABLE badge(id TEXT PRIMARY KEY, trainee TEXT NOT NULL REFERENCES trainee(id)) STRICT",
          "CREATE TABLE mark(attempt TEXT NOT NULL REFERENCES attempt(id), at INT8, PRIMARY KEY(attempt, at)) "
          "KEYED"}) {
      lab->database().run(lab->database().in_its_words(table));
    }
  }
  const Person ada = own_->enrolled("ada");
  const std::string attempt = take(*own_, ada);
  own_->database().run("INSERT INTO badge VALUES ('b', $1)", {ada.id});
  own_->database().run("INSERT INTO mark VALUES ($1, 7)", {attempt});
  own_->hand_over(*server_);
  EXPECT_THAT(column(*server_, "SELECT trainee FROM badge"), ElementsAre(ada.id));
  EXPECT_THAT(column(*server_, "SELECT attempt FROM mark"), ElementsAre(attempt));
  EXPECT_THAT(column(*own_, "SELECT attempt FROM mark"), IsEmpty());
}

TEST_P(HandOver, WhatTheServerDoesNotTakeStaysAndHoldsUpNothingElse) {
  own_->database().run("CREATE TABLE mark(attempt TEXT PRIMARY KEY REFERENCES attempt(id)) STRICT");
  const std::string refused = take(*own_, own_->enrolled("ada"));
  own_->database().run("INSERT INTO mark VALUES ($1)", {refused});  // a table that the server has not
  const std::string taken = take(*own_, own_->enrolled("ada"));
  const HandedOver done = own_->hand_over(*server_);
  EXPECT_EQ(done.attempts, 1);
  EXPECT_EQ(done.left, 1);
  EXPECT_THAT(done.problem, HasSubstr("mark"));
  EXPECT_THAT(own_->attempts(), ElementsAre(Field(&AttemptRecord::id, refused)));
  EXPECT_THAT(server_->attempts(), ElementsAre(Field(&AttemptRecord::id, taken)));
}

TEST_P(HandOver, KilledAgainAndAgainItLosesNothingAndDoublesNothing) {
  constexpr int kAttempts = 8;
  server_->set(kHomePage, "https://lab.example/stylet/");
  server_->enrolled("ada");
  std::set<std::string> taken;
  for (int i = 0; i < kAttempts; ++i) taken.insert(take(*own_, told_of(*own_, i % 2 == 0 ? "ada" : "bob")));
  own_.reset();
  server_.reset();
  std::mt19937 random(27);
  int kills = 0;
  for (bool done = false; !done;) {
    ASSERT_LT(++kills, 1000);
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      Lab own(own_settings());
      Lab server(server_settings());
      own.hand_over(server);
      ::_exit(0);
    }
    // Longer and longer, so that it ends on a machine of any speed.
    ::usleep(static_cast<useconds_t>(random() % (10'000u * static_cast<unsigned>(kills))));
    ::kill(child, SIGKILL);
    int status = 0;
    ::waitpid(child, &status, 0);
    done = WIFEXITED(status) && WEXITSTATUS(status) == 0;
  }
  own_.emplace(own_settings());
  server_.emplace(server_settings());
  EXPECT_THAT(own_->attempts(), IsEmpty());
  std::set<std::string> there;
  for (const AttemptRecord& attempt : server_->attempts()) {
    EXPECT_TRUE(there.insert(attempt.id).second);
    EXPECT_THAT(server_->metrics(attempt.id), SizeIs(31));
    EXPECT_EQ(attempt.status, "ended");
  }
  EXPECT_EQ(there, taken);
  EXPECT_THAT(server_->people(), SizeIs(2));
  EXPECT_THAT(column(*server_, "SELECT statement FROM outbox"), SizeIs(3 * kAttempts));
}

}  // namespace
}  // namespace stylet::lab::store
