// PostgreSQL as the lab uses it: values, transactions, many stations at once, connections that are lost, what is
// told.
#include "engine/lab/store/postgres.h"
#include "engine/files/error.h"
#include "engine/lab/store/lab.h"
#include "engine/lab/store/schema.h"
#include "tests/lab/refusal.h"
#include "tests/lab/sample_attempts.h"
#include "tests/support/postgres_database.h"
#include "tests/support/temporary_folder.h"
#include "tools/reference/postgres_server.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <thread>
#include <vector>

namespace stylet::lab::store {
namespace {

using test::end_of;
using test::start_of;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::SizeIs;

constexpr int kStations = 8;

class Postgres : public testing::Test {
protected:
  void SetUp() override {
    const auto server = support::test_postgres();
    if (!server) GTEST_SKIP() << "STYLET_TEST_POSTGRES is not set";
    database_.emplace(*server);
  }
  PostgresDatabase connected() const { return PostgresDatabase(database_->address(), "stylet"); }

  std::optional<support::PostgresTestDatabase> database_;
};

TEST_F(Postgres, ValuesComeBackAsTheyWere) {
  PostgresDatabase database = connected();
  database.run(database.in_its_words("CREATE TABLE t(a INT8, b REAL8, c TEXT, PRIMARY KEY(a)) KEYED"));
  const std::string odd = "a'b\"\xe2\x80\xae';--\\ $1";
  database.run("INSERT INTO t VALUES ($1, $2, $3)", {std::int64_t{1} << 60, 0.1, odd});
  database.run("INSERT INTO t VALUES ($1, $2, $3)", {std::int64_t{2}, Value(), Value()});
  database.run("INSERT INTO t VALUES ($1, $2, $3)", {std::int64_t{1}, 1e300 / 7, std::string()});
  const auto rows = database.run("SELECT * FROM t ORDER BY a DESC");
  EXPECT_EQ(integer(rows[0][0]), std::int64_t{1} << 60);
  EXPECT_EQ(number(rows[0][1]), 0.1);
  EXPECT_EQ(text(rows[0][2]), odd);
  EXPECT_EQ(rows[1][1], Value());
  EXPECT_EQ(number(rows[2][1]), 1e300 / 7);
  EXPECT_EQ(rows[2][2], Value(std::string()));
  EXPECT_EQ(integer(database.run("SELECT sum(a) FROM t WHERE a < 3")[0][0]), 3);
  EXPECT_EQ(number(database.run("SELECT avg(a) FROM t WHERE a < 3")[0][0]), 1.5);
  EXPECT_THROW(database.run("INSERT INTO t VALUES ('text', 1, 2)"), files::ContentError);
  EXPECT_THAT(refusal([&] { database.run("SELECT $1", {std::string("a\0b", 3)}); }), HasSubstr("zero byte"));
}

TEST_F(Postgres, TextIsInTheOrderOfItsBytes) {
  PostgresDatabase database = connected();
  database.run(database.in_its_words("CREATE TABLE t(a TEXT PRIMARY KEY) STRICT"));
  for (const char* word : {"b", "B", "_", "a"}) database.run("INSERT INTO t VALUES ($1)", {std::string(word)});
  std::string order;
  for (const Row& row : database.run("SELECT a FROM t ORDER BY a")) order += text(row[0]);
  EXPECT_EQ(order, "B_ab");
}

TEST_F(Postgres, OneWritesAtATimeAndWhatIsNotCommittedLeavesNothing) {
  PostgresDatabase one = connected();
  PostgresDatabase other = connected();
  one.run("CREATE TABLE t(a BIGINT PRIMARY KEY)");
  other.run("SET lock_timeout TO '20ms'");
  {
    Transaction transaction(one);
    one.run("INSERT INTO t VALUES (1)");
    EXPECT_THAT(refusal([&] { Transaction second(other); }), HasSubstr("another station writes to it"));
    EXPECT_TRUE(other.run("SELECT * FROM t").empty());
  }
  EXPECT_TRUE(one.run("SELECT * FROM t").empty());
  {
    Transaction transaction(other);
    other.run("INSERT INTO t VALUES (1)");
    EXPECT_THROW(other.run("INSERT INTO t VALUES (1)"), files::ContentError);
    EXPECT_THAT(refusal([&] { transaction.commit(); }), HasSubstr("did not keep")) << "one of its statements failed";
  }
  EXPECT_TRUE(one.run("SELECT * FROM t").empty());
}

TEST_F(Postgres, StationsThatOpenTheSameEmptyDatabaseAtOnceMakeItOnce) {
  std::vector<std::thread> stations;
  std::array<std::string, kStations> problems;
  const support::TemporaryFolder folder;
  for (std::size_t i = 0; i < kStations; ++i) {
    stations.emplace_back([&, i] {
      problems[i] = refusal([&] {
        const Lab lab({.folder = folder / std::to_string(i), .build = "test", .database = database_->address()});
      });
    });
  }
  for (std::thread& station : stations) station.join();
  for (const std::string& problem : problems) EXPECT_EQ(problem, "nothing was refused");
  PostgresDatabase database = connected();
  EXPECT_EQ(integer(database.run("SELECT count(*) FROM schema_version")[0][0]),
            static_cast<std::int64_t>(migrations().size()));
}

TEST_F(Postgres, StationsThatWriteAtOnceLoseNothingAndDoubleNothing) {
  constexpr int kAttempts = 6;
  const support::TemporaryFolder folder;
  std::array<std::vector<std::string>, kStations> taken;
  std::array<std::string, kStations> problems;
  std::vector<std::thread> stations;
  for (std::size_t i = 0; i < kStations; ++i) {
    stations.emplace_back([&, i] {
      problems[i] = refusal([&] {
        Lab lab({.folder = folder / std::to_string(i), .build = "test", .database = database_->address()});
        // All of them enroll the same person, at once.
        const Person ada = lab.enrolled("ada");
        for (int k = 0; k < kAttempts; ++k) {
          taken[i].push_back(lab.begin(start_of(ada)));
          lab.end(taken[i].back(), end_of(80, true));
        }
      });
    });
  }
  for (std::thread& station : stations) station.join();
  for (const std::string& problem : problems) EXPECT_EQ(problem, "nothing was refused");
  Lab lab({.folder = folder / "0", .build = "test", .database = database_->address()});
  EXPECT_THAT(lab.people(), SizeIs(1));
  std::multiset<std::string> there;
  std::set<int> numbers;
  const auto metrics = lab.all_metrics();
  for (const AttemptRecord& attempt : lab.attempts()) {
    there.insert(attempt.id);
    numbers.insert(attempt.number);
    EXPECT_EQ(attempt.status, "ended") << "other stations' attempts are not taken for cut off";
    EXPECT_THAT(metrics.at(attempt.id), SizeIs(31));
  }
  EXPECT_THAT(there, SizeIs(kStations * kAttempts));
  EXPECT_THAT(numbers, SizeIs(kStations * kAttempts));
  for (const auto& of_station : taken) {
    for (const std::string& attempt : of_station) EXPECT_EQ(there.count(attempt), 1u);
  }
}

TEST_F(Postgres, ProcessesThatHandOverAtOnceLoseNothingAndDoubleNothing) {
  constexpr int kAttempts = 4;
  const support::TemporaryFolder folder;
  std::set<std::string> taken;
  for (int i = 0; i < kStations; ++i) {
    Lab own({.folder = folder / std::to_string(i), .build = "test"});
    own.database().run("PRAGMA synchronous=OFF");
    for (int k = 0; k < kAttempts; ++k) {
      const std::string attempt = own.begin(start_of(own.enrolled(k % 2 == 0 ? "ada" : "bob")));
      own.end(attempt, end_of(80, true));
      taken.insert(attempt);
    }
  }
  std::vector<pid_t> children;
  for (int i = 0; i < kStations; ++i) {
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      const std::string problem = refusal([&] {
        Lab own({.folder = folder / std::to_string(i), .build = "test"});
        Lab server({.folder = folder / std::to_string(i), .build = "test", .database = database_->address()});
        own.hand_over(server);
      });
      ::_exit(problem == "nothing was refused" ? 0 : 1);
    }
    children.push_back(child);
  }
  for (const pid_t child : children) {
    int status = 0;
    ::waitpid(child, &status, 0);
    EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  }
  Lab server({.folder = folder / "server", .build = "test", .database = database_->address()});
  EXPECT_THAT(server.people(), SizeIs(2)) << "each enrolled at eight stations by themselves";
  std::set<std::string> there;
  for (const AttemptRecord& attempt : server.attempts()) {
    EXPECT_TRUE(there.insert(attempt.id).second);
    EXPECT_THAT(server.metrics(attempt.id), SizeIs(31));
  }
  EXPECT_EQ(there, taken);
}

TEST_F(Postgres, NamesAreApartFromTheRecordsAndAnErasureTakesBoth) {
  const support::TemporaryFolder folder;
  Lab lab({.folder = folder / "lab", .build = "test", .database = database_->address()});
  const Person ada = lab.enrolled("Marguerite Yourcenar");
  lab.end(lab.begin(start_of(ada)), end_of(80, true));
  lab.add_note(ada.id, "ines", "hesitates");
  PostgresDatabase roster(database_->address(), "stylet_roster");
  EXPECT_THAT(roster.run("SELECT name FROM person"), SizeIs(1));
  EXPECT_EQ(integer(lab.database().run("SELECT count(*) FROM pg_tables WHERE schemaname = 'stylet' AND tablename = "
                                       "'person'")[0][0]),
            0);
  lab.erase(ada);
  EXPECT_TRUE(roster.run("SELECT name FROM person").empty());
  EXPECT_TRUE(lab.attempts().empty());
  EXPECT_TRUE(lab.people().empty());
  for (const char* table : {"attempt_metric", "note", "outbox"}) {
    EXPECT_TRUE(lab.database().run(std::string("SELECT 1 FROM ") + table).empty()) << table;
  }
  EXPECT_THAT(refusal([&] { lab.back_up(); }), HasSubstr("pg_dump"));
}

TEST(PostgresAddress, ItsPasswordIsInNoMessage) {
  EXPECT_TRUE(has_password("postgresql://u:secret@h/d"));
  EXPECT_TRUE(has_password("host=h password=secret"));
  EXPECT_FALSE(has_password("postgresql://u@h/d"));
  for (const char* address :
       {"postgresql://u:secret@[h/d", "postgresql://u:sec%zzret@h/d?a=secret", "postgresql://u:secret@127.0.0.1:1/d",
        "host=127.0.0.1 port=1 password=secret", "host=127.0.0.1 passwort=secret",
        "postgresql://u:secret@db.example/d?sslmode=disable"}) {
    const std::string said = refusal([&] { const PostgresDatabase database(address, "stylet"); });
    EXPECT_THAT(said, Not(HasSubstr("secret"))) << address;
    EXPECT_THAT(said, HasSubstr("; ")) << address << ": and what to do";
    EXPECT_THAT(said, Not(HasSubstr("\n"))) << address;
  }
  EXPECT_THAT(refusal([&] { const PostgresDatabase d("postgresql://u@db.example/d?sslmode=prefer", "stylet"); }),
              HasSubstr("in the clear"));
}

TEST(PostgresAddress, AnotherComputerIsAskedForTlsAndToldNothingWithout) {
  // A server that has no TLS; its address is none of this computer's loopback.
  const int listening = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  ASSERT_EQ(::bind(listening, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  ASSERT_EQ(::listen(listening, 4), 0);
  ASSERT_EQ(::getsockname(listening, reinterpret_cast<sockaddr*>(&address), &size), 0);
  std::vector<std::string> heard;
  std::thread server([&] {
    while (true) {
      const int client = ::accept(listening, nullptr, nullptr);
      if (client < 0) return;
      std::string all;
      std::array<char, 512> bytes{};
      ssize_t n = ::recv(client, bytes.data(), 8, MSG_WAITALL);
      if (n == 8) all.assign(bytes.data(), 8);
      if (::send(client, "N", 1, MSG_NOSIGNAL) == 1) {
        while ((n = ::recv(client, bytes.data(), bytes.size(), 0)) > 0)
          all.append(bytes.data(), static_cast<std::size_t>(n));
      }
      heard.push_back(all);
      ::close(client);
    }
  });
  const std::string said = refusal([&] {
    const PostgresDatabase database(
        "postgresql://u:secret@0.0.0.0:" + std::to_string(ntohs(address.sin_port)) + "/d?gssencmode=disable",
        "stylet");
  });
  ::shutdown(listening, SHUT_RDWR);
  server.join();
  ::close(listening);
  EXPECT_THAT(said, HasSubstr("SSL"));
  ASSERT_THAT(heard, SizeIs(1));
  EXPECT_EQ(heard[0], std::string("\x00\x00\x00\x08\x04\xd2\x16\x2f", 8)) << "nothing but the question for TLS";
}

TEST(PostgresServer, ThatStopsAndComesBackLosesNothing) {
  const auto programs = reference::postgres_programs();
  if (!programs) GTEST_SKIP() << "there is no PostgreSQL server here";
  reference::PostgresServer server(*programs);
  PostgresDatabase database(server.address(), "stylet");
  database.run("CREATE TABLE t(a BIGINT PRIMARY KEY)");
  database.run("INSERT INTO t VALUES (1)");
  server.stop();
  server.start();
  EXPECT_THAT(database.run("SELECT * FROM t"), SizeIs(1)) << "connected anew";
  {
    Transaction transaction(database);
    database.run("INSERT INTO t VALUES (2)");
    server.stop();
    const std::string said = refusal([&] { database.run("INSERT INTO t VALUES (3)"); });
    EXPECT_THAT(said, HasSubstr("the connection is lost"));
    EXPECT_THAT(said, Not(HasSubstr("\n")));
    EXPECT_THROW(transaction.commit(), ServerAway);
  }
  EXPECT_THROW(database.run("SELECT * FROM t"), ServerAway);
  EXPECT_THROW({ Transaction transaction(database); }, ServerAway);
  server.start();
  EXPECT_THAT(database.run("SELECT * FROM t"), SizeIs(1));
  Transaction transaction(database);
  database.run("INSERT INTO t VALUES (2)");
  transaction.commit();
  EXPECT_THAT(database.run("SELECT * FROM t"), SizeIs(2));
}

}  // namespace
}  // namespace stylet::lab::store
