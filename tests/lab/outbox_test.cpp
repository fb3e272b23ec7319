// Statements reach a record store, each exactly once, whatever becomes of the store, of the way there, of us.
#include "engine/lab/delivery/outbox.h"

#include "engine/files/error.h"
#include "engine/lab/delivery/http_record_store.h"
#include "engine/lab/store/lab.h"
#include "tests/lab/record_store_server.h"
#include "tests/lab/refusal.h"
#include "tests/lab/sample_attempts.h"
#include "tests/lab/xapi_rules.h"
#include "tests/support/temporary_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <vector>

namespace stylet::lab::delivery {
namespace {

namespace fs = std::filesystem;
using store::Lab;
using store::test::end_of;
using store::test::start_of;
using test::RecordStoreServer;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;
using Mood = RecordStoreServer::Mood;

class Delivered : public ::testing::Test {
protected:
  Delivered() {
    lab_.set(store::kHomePage, "https://lab.example/stylet/");
    lab_.set_consent(ada_.id, store::kRecordStore, true);
  }

  std::string take(bool passed = true) {
    const std::string attempt = lab_.begin(start_of(ada_));
    lab_.end(attempt, end_of(passed ? 80 : 40, passed));
    return attempt;
  }
  SendSettings settings() {
    return {.clock = [this] { return now_ms_; }, .random = [] { return 0.0; }};
  }
  std::set<std::string> waiting() {
    std::set<std::string> ids;
    for (const store::Row& row : lab_.database().run("SELECT statement FROM outbox WHERE state = 'waiting'")) {
      ids.insert(store::text(row[0]));
    }
    return ids;
  }
  static HttpSettings address(const RecordStoreServer& server) {
    return {.endpoint = server.endpoint(), .key = RecordStoreServer::kKey};
  }
  static std::set<std::string> ids_of(const RecordStoreServer& server) {
    std::set<std::string> ids;
    for (const auto& [id, statement] : server.statements()) ids.insert(id);
    return ids;
  }

  std::int64_t now_ms_ = 1'790'000'000'000;
  support::TemporaryFolder folder_;
  Lab lab_{{.folder = folder_.path() / "lab", .build = "test", .clock = [this] { return now_ms_ += 1000; }}};
  store::Person ada_ = lab_.enrolled("ada");
};

TEST_F(Delivered, NothingIsToldWhereNoRecordStoreIsWanted) {
  lab_.set(store::kHomePage, "");
  take();
  EXPECT_THAT(waiting(), IsEmpty());
}

TEST_F(Delivered, NobodyIsToldOfWithoutConsentAndWhatWaitsGoesWithIt) {
  const store::Person bob = lab_.enrolled("bob");
  EXPECT_FALSE(lab_.consents_to(bob.id, store::kRecordStore));
  lab_.end(lab_.begin(start_of(bob)), end_of(80, true));
  EXPECT_THAT(waiting(), IsEmpty()) << "never asked is no consent";
  lab_.set_consent(bob.id, store::kResearch, true);
  lab_.end(lab_.begin(start_of(bob)), end_of(80, true));
  EXPECT_THAT(waiting(), IsEmpty()) << "to another purpose";
  take();
  lab_.set_consent(bob.id, store::kRecordStore, true);
  lab_.end(lab_.begin(start_of(bob)), end_of(80, true));
  EXPECT_THAT(waiting(), SizeIs(6));
  now_ms_ -= 3'600'000;  // the clock is set back: the last word is the newest all the same
  lab_.set_consent(bob.id, store::kRecordStore, false);
  EXPECT_FALSE(lab_.consents_to(bob.id, store::kRecordStore));
  EXPECT_TRUE(lab_.consents_to(bob.id, store::kResearch));
  EXPECT_THAT(waiting(), SizeIs(3)) << "ada's stay";
  EXPECT_THAT(refusal([&] { lab_.set_consent(bob.id, "advertising", true); }), HasSubstr("record_store, research"));
  lab_.erase(bob);
  EXPECT_THAT(lab_.database().run("SELECT 1 FROM consent WHERE trainee = $1", {bob.id}), IsEmpty());
}

TEST_F(Delivered, WhatWaitsOfWhoWasNeverAskedIsHeldBackUntilConsent) {
  RecordStoreServer server;
  HttpRecordStore store(address(server));
  take();
  const store::Person bob = lab_.enrolled("bob");
  lab_.set_consent(bob.id, store::kRecordStore, true);
  lab_.end(lab_.begin(start_of(bob)), end_of(80, true));
  lab_.database().run("DELETE FROM consent WHERE trainee = $1", {ada_.id});  // as in records of earlier versions
  const OutboxState before = outbox_state(lab_.database());
  EXPECT_EQ(before.held, 3);
  EXPECT_EQ(before.waiting, 3);
  EXPECT_EQ(Outbox(lab_.database(), store, settings()).send().delivered, 3) << "bob's";
  EXPECT_THAT(server.statements(), SizeIs(3));
  EXPECT_EQ(outbox_state(lab_.database()).held, 3);
  EXPECT_EQ(outbox_state(lab_.database()).waiting, 0);
  lab_.set_consent(ada_.id, store::kRecordStore, true);
  EXPECT_EQ(Outbox(lab_.database(), store, settings()).send().delivered, 3);
  EXPECT_THAT(server.statements(), SizeIs(6));
}

TEST_F(Delivered, StatementsAreWrittenWithTheAttemptOrNotAtAll) {
  const std::string attempt = lab_.begin(start_of(ada_));
  EXPECT_THAT(waiting(), SizeIs(1));
  store::AttemptEnd end = end_of(80, true);
  end.metrics.push_back(end.metrics.front());  // refused: the whole end is
  EXPECT_THROW(lab_.end(attempt, end), files::ContentError);
  EXPECT_THAT(waiting(), SizeIs(1));
  end.metrics.pop_back();
  lab_.end(attempt, end);
  EXPECT_THAT(waiting(), SizeIs(3));
  for (const store::Row& row : lab_.database().run("SELECT body FROM outbox")) {
    const auto statement = nlohmann::json::parse(store::text(row[0]));
    EXPECT_THAT(test::problems_of(statement), IsEmpty());
    EXPECT_EQ(statement["actor"]["account"]["name"], ada_.pseudonym) << "never the name";
    EXPECT_THAT(statement.dump(), testing::Not(HasSubstr("\"ada\"")));
  }
  lab_.erase(ada_);
  EXPECT_THAT(waiting(), IsEmpty()) << "what has not been told is not told of who was erased";
}

TEST_F(Delivered, AStoreGetsEveryStatement) {
  RecordStoreServer server;
  for (int i = 0; i < 12; ++i) take(i % 2 == 0);
  const std::set<std::string> all = waiting();
  ASSERT_THAT(all, SizeIs(36));
  HttpRecordStore store(address(server));
  const Sent sent = Outbox(lab_.database(), store, settings()).send();
  EXPECT_EQ(sent.delivered, 36);
  EXPECT_EQ(sent.stopped_by, "");
  EXPECT_EQ(ids_of(server), all);
  EXPECT_EQ(server.requests(), 2) << "25 and 11";
  EXPECT_THAT(waiting(), IsEmpty());
  EXPECT_THAT(server.refused(), IsEmpty());
}

TEST_F(Delivered, APageThatAnswersAnythingIsNoRecordStore) {
  RecordStoreServer server;
  server.set(Mood::babbling);
  take();
  const std::set<std::string> all = waiting();
  ASSERT_THAT(all, SizeIs(3));
  HttpRecordStore store(address(server));
  const Sent sent = Outbox(lab_.database(), store, settings()).send();
  EXPECT_EQ(sent.delivered, 0);
  EXPECT_THAT(sent.stopped_by, HasSubstr("is it a record store?"));
  EXPECT_EQ(waiting(), all);
  server.set(Mood::there);
  EXPECT_EQ(Outbox(lab_.database(), store, settings()).send().delivered, 3);
}

TEST_F(Delivered, AnOutboxMadeAnewGoesOnWaitingLonger) {
  RecordStoreServer server;
  server.set(Mood::gone);
  take();
  HttpRecordStore store(address(server));
  int failures = 0;
  std::int64_t before_ms = 0;
  for (int k = 0; k < 5; ++k) {
    SendSettings again = settings();
    again.failures = failures;
    const Sent sent = Outbox(lab_.database(), store, again).send();
    failures = sent.failures;
    EXPECT_EQ(failures, k + 1);
    const std::int64_t wait_ms = sent.next_ms.value_or(0) - now_ms_;
    EXPECT_GT(wait_ms, before_ms);
    before_ms = wait_ms;
  }
}

TEST_F(Delivered, NoProxySeesWhatStaysOnThisComputer) {
  RecordStoreServer server;
  take();
  setenv("http_proxy", "http://127.0.0.1:1", 1);
  HttpRecordStore store(address(server));
  const Sent sent = Outbox(lab_.database(), store, settings()).send();
  unsetenv("http_proxy");
  EXPECT_EQ(sent.delivered, 3) << sent.stopped_by;
}

TEST_F(Delivered, AStoreThatComesAndGoesFiftyTimesHasEachExactlyOnce) {
  RecordStoreServer server;
  HttpRecordStore store(address(server));
  Outbox outbox(lab_.database(), store, settings());
  std::set<std::string> all;
  int delivered = 0;
  for (int round = 0; round < 50; ++round) {
    // Gone, or worse: it takes them, and nobody hears of it; and then says of each that it has it.
    const Mood away[]{Mood::gone, Mood::answer_lost, Mood::busy};
    server.set(away[round % 3]);
    take();
    const std::set<std::string> now = waiting();
    all.insert(now.begin(), now.end());
    Sent sent = outbox.send();
    EXPECT_EQ(sent.delivered, 0);
    EXPECT_NE(sent.stopped_by, "");
    ASSERT_TRUE(sent.next_ms.has_value());
    EXPECT_EQ(waiting(), now) << "nothing is given up";
    server.set(round % 2 == 0 ? Mood::there : Mood::stubborn);
    sent = outbox.send();
    delivered += sent.delivered;
    EXPECT_EQ(sent.stopped_by, "");
    EXPECT_THAT(waiting(), IsEmpty());
  }
  EXPECT_THAT(all, SizeIs(150));
  EXPECT_EQ(delivered, 150);
  EXPECT_EQ(ids_of(server), all);
  EXPECT_THAT(server.refused(), IsEmpty());
  const OutboxState state = outbox_state(lab_.database());
  EXPECT_EQ(state.conflicts + state.rejected, 0);
}

TEST_F(Delivered, AWeekWithoutTheStoreIsSurvived) {
  RecordStoreServer server;
  HttpRecordStore store(address(server));
  server.set(Mood::gone);
  std::set<std::string> all;
  std::int64_t longest = 0;
  const std::int64_t first_ms = now_ms_;
  {
    Outbox outbox(lab_.database(), store, settings());
    for (int day = 0; day < 7; ++day) {
      take();
      for (int i = 0; i < 12; ++i) {
        const Sent sent = outbox.send();
        ASSERT_TRUE(sent.next_ms.has_value());
        EXPECT_GT(*sent.next_ms, now_ms_);
        longest = std::max(longest, *sent.next_ms - now_ms_);
        now_ms_ = *sent.next_ms;
      }
      now_ms_ += 86'400'000;
    }
  }
  EXPECT_EQ(longest, 15 * 60'000 / 2) << "half of a quarter of an hour, by the random number of the test";
  all = waiting();
  EXPECT_THAT(all, SizeIs(21));
  const auto oldest = outbox_state(lab_.database()).oldest_ms;
  ASSERT_TRUE(oldest.has_value());
  EXPECT_LT(*oldest - first_ms, 60'000);
  server.set(Mood::there);
  Lab again({.folder = folder_.path() / "lab", .build = "test"});  // after a restart
  EXPECT_EQ(Outbox(again.database(), store, settings()).send().delivered, 21);
  EXPECT_EQ(ids_of(server), all);
}

TEST_F(Delivered, WaitsAsLongAsTheStoreSaysAndAnHourWhereItIsNotLetIn) {
  RecordStoreServer server;
  HttpRecordStore store(address(server));
  take();
  Outbox outbox(lab_.database(), store, settings());
  server.set(Mood::busy);
  EXPECT_EQ(outbox.send().next_ms.value_or(0) - now_ms_, 7000);
  for (const Mood mood : {Mood::stranger, Mood::moved}) {
    server.set(mood);
    const Sent sent = outbox.send();
    EXPECT_EQ(sent.next_ms.value_or(0) - now_ms_, 3'600'000);
    EXPECT_THAT(sent.stopped_by, HasSubstr(mood == Mood::moved ? "302" : "401: who are you?"));
  }
  EXPECT_THAT(waiting(), SizeIs(3));
}

TEST_F(Delivered, OneThatIsRefusedOrToldOtherwiseIsSetAsideAndTheOthersGoOn) {
  RecordStoreServer server;
  HttpRecordStore store(address(server));
  for (int i = 0; i < 5; ++i) take();
  std::set<std::string> all = waiting();
  // One that no store takes, one that it knows otherwise.
  const std::string bad = *all.begin();
  const std::string other = *all.rbegin();
  lab_.database().run("UPDATE outbox SET body = $1 WHERE statement = $2",
                      {R"({"id": ")" + bad + R"(", "actor": {}})", bad});
  auto known = nlohmann::json::parse(
      store::text(lab_.database().run("SELECT body FROM outbox WHERE statement = $1", {other})[0][0]));
  known["timestamp"] = "2020-01-01T00:00:00Z";
  server.put(known);
  const Sent sent = Outbox(lab_.database(), store, settings()).send();
  EXPECT_EQ(sent.delivered, 13);
  EXPECT_EQ(sent.stopped_by, "");
  const OutboxState state = outbox_state(lab_.database());
  EXPECT_EQ(state.waiting, 0);
  EXPECT_EQ(state.rejected, 1);
  EXPECT_EQ(state.conflicts, 1);
  all.erase(bad);
  EXPECT_EQ(ids_of(server), all);
}

TEST_F(Delivered, AStoreWithoutRoomForManyGetsThemOneByOne) {
  RecordStoreServer server;
  HttpRecordStore store(address(server));
  for (int i = 0; i < 3; ++i) take();
  server.set(Mood::small);
  EXPECT_EQ(Outbox(lab_.database(), store, settings()).send().delivered, 9);
}

TEST_F(Delivered, WhoIsKilledBetweenSendingAndForgettingSendsAgainAndNothingIsThereTwice) {
  RecordStoreServer server;
  for (int i = 0; i < 20; ++i) take();
  const std::set<std::string> all = waiting();
  std::mt19937 random(5);
  // Children that send, killed in the middle; each with its own connections.
  for (int k = 0; k < 10 && !waiting().empty(); ++k) {
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      Lab lab({.folder = folder_.path() / "lab", .build = "test"});
      HttpRecordStore store(address(server));
      SendSettings one_by_one = settings();
      one_by_one.most = 1;
      Outbox(lab.database(), store, one_by_one).send();
      ::_exit(0);
    }
    ::usleep(static_cast<useconds_t>(random() % 40'000));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
  }
  HttpRecordStore store(address(server));
  EXPECT_EQ(Outbox(lab_.database(), store, settings()).send().stopped_by, "");
  EXPECT_THAT(waiting(), IsEmpty());
  EXPECT_EQ(ids_of(server), all);
  EXPECT_THAT(server.refused(), IsEmpty());
}

TEST_F(Delivered, AnAttemptThatWasCutOffIsToldWhenItIsKnown) {
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    Lab lab({.folder = folder_.path() / "lab", .build = "test"});
    lab.begin(start_of(ada_));
    ::_exit(0);
  }
  ::waitpid(child, nullptr, 0);
  Lab again({.folder = folder_.path() / "lab", .build = "test"});
  std::set<std::string> verbs;
  for (const store::Row& row : again.database().run("SELECT body FROM outbox")) {
    const auto statement = nlohmann::json::parse(store::text(row[0]));
    EXPECT_THAT(test::problems_of(statement), IsEmpty());
    verbs.insert(statement["verb"]["display"]["en"]);
  }
  EXPECT_EQ(verbs, (std::set<std::string>{"initialized", "terminated"}));
}

TEST_F(Delivered, WhatWasSetAsideIsTriedAgainWhereSomebodyAsks) {
  RecordStoreServer server;
  HttpRecordStore store(address(server));
  take();
  const std::string id = *waiting().begin();
  const std::string good =
      store::text(lab_.database().run("SELECT body FROM outbox WHERE statement = $1", {id})[0][0]);
  lab_.database().run("UPDATE outbox SET body = '{}' WHERE statement = $1", {id});
  EXPECT_EQ(Outbox(lab_.database(), store, settings()).send().delivered, 2);
  EXPECT_EQ(outbox_state(lab_.database()).rejected, 1);
  lab_.database().run("UPDATE outbox SET body = $1 WHERE statement = $2", {good, id});
  EXPECT_EQ(Outbox(lab_.database(), store, settings()).send().delivered, 0) << "nobody asked";
  EXPECT_EQ(try_again(lab_.database()), 1);
  EXPECT_EQ(Outbox(lab_.database(), store, settings()).send().delivered, 1);
  EXPECT_EQ(try_again(lab_.database()), 0);
  EXPECT_THAT(server.statements(), SizeIs(3));
}

TEST(HttpRecordStore, KnowsWhichVersionAStoreSpeaks) {
  EXPECT_EQ(version_of({.http = 200, .body = R"({"version": ["0.95", "1.0.0", "1.0.3"]})"}), "1.0.3");
  EXPECT_EQ(version_of({.http = 200, .body = R"({"version": ["2.0.0", "1.0.3"]})"}), "2.0.0");
  for (const char* none : {"", "<html>", "[]", "{}", R"({"version": "2.0.0"})", R"({"version": [2, null]})",
                           R"({"version": ["3.0"]})"}) {
    EXPECT_EQ(version_of({.http = 200, .body = none}), "") << none;
  }
  EXPECT_EQ(version_of({.http = 404, .body = R"({"version": ["2.0.0"]})"}), "");
}

TEST(HttpRecordStore, TakesOnlySafeAddressesAndPrivateKeys) {
  for (const char* address : {"http://lrs.example/xapi", "ftp://lrs.example", "lrs.example", "", "https://",
                              "https://me:secret@lrs.example/xapi", "https://lrs.example/xapi?a=b",
                              "file:///etc/passwd", "http://127.0.0.1.lrs.example/"}) {
    EXPECT_THAT(refusal([&] { HttpRecordStore({.endpoint = address}); }), HasSubstr("is no address")) << address;
  }
  EXPECT_NO_THROW(HttpRecordStore({.endpoint = "https://lrs.example/xapi/"}));
  EXPECT_NO_THROW(HttpRecordStore({.endpoint = "http://localhost:8080/xapi"}));
  const support::TemporaryFolder folder;
  const fs::path file = folder.write("key", "lab:secret\nmore\n");
  fs::permissions(file, fs::perms::owner_read | fs::perms::group_read);
  EXPECT_THAT(refusal([&] { read_key(file); }), HasSubstr("chmod 600"));
  fs::permissions(file, fs::perms::owner_read);
  EXPECT_EQ(read_key(file), "lab:secret");
  const fs::path none = folder.write("none", "nothing\n");
  fs::permissions(none, fs::perms::owner_read);
  EXPECT_THAT(refusal([&] { read_key(none); }), HasSubstr("name:secret"));
  EXPECT_THAT(refusal([&] { read_key(folder.path() / "gone"); }), HasSubstr("is no file"));
}

}  // namespace
}  // namespace stylet::lab::delivery
