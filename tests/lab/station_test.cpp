// A station and its server: which one it is, and that nothing keeps anybody from training while it is away.
#include "engine/lab/store/station.h"
#include "engine/files/error.h"
#include "tests/lab/refusal.h"
#include "tests/lab/sample_attempts.h"
#include "tests/support/postgres_database.h"
#include "tests/support/temporary_folder.h"
#include "tools/reference/postgres_server.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <string>

namespace stylet::lab::store {
namespace {

using test::end_of;
using test::start_of;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

constexpr const char* kNowhere = "postgresql://lab:secret@127.0.0.1:1/lab";

class StationTest : public testing::Test {
protected:
  StationTest() { ::unsetenv("STYLET_LAB_DATABASE"); }
  ~StationTest() override { ::unsetenv("STYLET_LAB_DATABASE"); }
  LabSettings settings(const std::string& database = {}) const {
    return {.folder = folder_ / "lab", .build = "test", .database = database};
  }
  support::TemporaryFolder folder_;
};

TEST_F(StationTest, ItsServerIsAskedForElseOfTheEnvironmentElseKept) {
  Lab own(settings());
  EXPECT_EQ(server_of(own, ""), "");
  own.set(kDatabase, "kept");
  EXPECT_EQ(server_of(own, ""), "kept");
  ::setenv("STYLET_LAB_DATABASE", "variable", 1);
  EXPECT_EQ(server_of(own, ""), "variable");
  EXPECT_EQ(server_of(own, "asked"), "asked");
  EXPECT_EQ(server_of(own, kOwnFiles), "");
}

TEST_F(StationTest, GoesOnWithoutAServerThatIsAwayAndSaysSoInOneLine) {
  Station station = open_station(settings(kNowhere));
  EXPECT_EQ(station.server, nullptr);
  EXPECT_THAT(station.away, HasSubstr("cannot be reached"));
  EXPECT_THAT(station.away, Not(HasSubstr("secret")));
  EXPECT_THAT(station.away, Not(HasSubstr("\n")));
  const Person ada = station.enrolled("ada");
  EXPECT_TRUE(ada.added);
  station.own->end(station.own->begin(start_of(ada)), end_of(80, true));
  EXPECT_THAT(station.lab().attempts(), SizeIs(1));
  EXPECT_EQ(station.in_lab(ada).id, ada.id);
  EXPECT_THAT(refusal([&] { station.hand_over(); }), HasSubstr("cannot be reached"));
  EXPECT_THAT(station.enrolled("7ZZZZZR").pseudonym, Not(IsEmpty())) << "whatever was given";
}

TEST_F(StationTest, AServerThatCannotTakeSomebodyKeepsNobodyFromTraining) {
  const auto postgres = support::test_postgres();
  if (!postgres) GTEST_SKIP() << "STYLET_TEST_POSTGRES is not set";
  const support::PostgresTestDatabase database(*postgres);
  Station station = open_station(settings(database.address()));
  ASSERT_NE(station.server, nullptr) << station.away;
  Database& there = station.server->database();
  there.run(
      "CREATE FUNCTION refuse() RETURNS trigger LANGUAGE plpgsql AS 'BEGIN RAISE EXCEPTION ''the disk is full''; "
      "END'");
  there.run("CREATE TRIGGER full_up BEFORE INSERT ON trainee FOR EACH ROW EXECUTE FUNCTION refuse()");
  const Person ada = station.enrolled("ada");
  EXPECT_TRUE(ada.added);
  EXPECT_THAT(station.away, HasSubstr("the disk is full"));
  station.own->end(station.own->begin(start_of(ada)), end_of(80, true));
  EXPECT_THAT(station.lab().attempts(), SizeIs(1));
  Station odd = open_station(settings(database.address()));
  EXPECT_THAT(refusal([&] { odd.enrolled(" "); }), HasSubstr("is no name")) << "of whom the server is not to blame";
}

TEST_F(StationTest, WithoutAServerIsTheLab) {
  Station station = open_station(settings());
  EXPECT_EQ(&station.lab(), station.own.get());
  EXPECT_THAT(station.away, IsEmpty());
  EXPECT_THAT(refusal([&] { station.hand_over(); }), HasSubstr("no server"));
}

TEST_F(StationTest, AServerThatStopsInTheMiddleOfASessionGetsItLater) {
  const auto programs = reference::postgres_programs();
  if (!programs) GTEST_SKIP() << "there is no PostgreSQL server here";
  reference::PostgresServer server(*programs);
  std::string pseudonym;
  {
    Station station = open_station(settings(server.address()));
    ASSERT_THAT(station.away, IsEmpty());
    const Person ada = station.enrolled("ada");
    EXPECT_TRUE(ada.added);
    pseudonym = ada.pseudonym;
    EXPECT_EQ(station.server->get("ada").id, ada.id) << "enrolled there, known here";
    const std::string attempt = station.own->begin(start_of(ada));
    server.stop();
    EXPECT_THAT(station.own->end(attempt, end_of(80, true)), IsEmpty());
    EXPECT_TRUE(station.enrolled("bob").added) << "it is away now";
    EXPECT_THAT(station.away, HasSubstr("PostgreSQL"));
  }
  {
    Station away = open_station(settings(server.address()));
    EXPECT_EQ(away.server, nullptr);
    EXPECT_EQ(away.enrolled("ada").pseudonym, pseudonym);
    away.own->end(away.own->begin(start_of(away.enrolled("ada"))), end_of(60, false));
  }
  server.start();
  Station back = open_station(settings(server.address()));
  EXPECT_THAT(back.away, IsEmpty());
  EXPECT_EQ(back.handed_over.attempts, 2);
  EXPECT_EQ(back.handed_over.people, 1) << "bob";
  EXPECT_THAT(back.own->attempts(), IsEmpty());
  EXPECT_THAT(back.lab().attempts(back.in_lab(back.enrolled("ada")).id), SizeIs(2));
  EXPECT_THAT(handed_over_words(back.handed_over, "there"), HasSubstr("2 attempts and 1 new people"));
  const Station again = open_station(settings(server.address()));
  EXPECT_THAT(handed_over_words(again.handed_over, "there"), IsEmpty());
}

}  // namespace
}  // namespace stylet::lab::store
