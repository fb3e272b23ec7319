// SQLite as the lab opens it: durable, foreign keys, transactions, other writers.
#include "engine/lab/store/sqlite.h"
#include "engine/files/error.h"
#include "tests/support/temporary_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <string>

namespace stylet::lab::store {
namespace {

using ::testing::HasSubstr;

TEST(Sqlite, WriteAheadLogIsTakenOnlyWhereItsRaceIsMended) {
  EXPECT_FALSE(wal_is_safe(3040001));  // Debian 12
  EXPECT_FALSE(wal_is_safe(3051002));
  EXPECT_TRUE(wal_is_safe(3051003));
  EXPECT_TRUE(wal_is_safe(3052000));
  EXPECT_FALSE(wal_is_safe(3050006));
  EXPECT_TRUE(wal_is_safe(3050007));
  EXPECT_FALSE(wal_is_safe(3049001));
  EXPECT_TRUE(wal_is_safe(3044006));
  EXPECT_FALSE(wal_is_safe(3045000));
}

TEST(Sqlite, IsOpenedToKeepWhatIsCommitted) {
  const support::TemporaryFolder folder;
  SqliteDatabase database(folder / "a.db", 5);
  const std::string journal = text(database.run("PRAGMA journal_mode")[0][0]);
  EXPECT_EQ(journal, wal_is_safe(sqlite3_libversion_number()) ? "wal" : "truncate");
  EXPECT_EQ(integer(database.run("PRAGMA synchronous")[0][0]), 2) << "FULL";
  EXPECT_EQ(integer(database.run("PRAGMA foreign_keys")[0][0]), 1);
  EXPECT_EQ(integer(database.run("PRAGMA secure_delete")[0][0]), 1);
  EXPECT_EQ(integer(database.run("PRAGMA trusted_schema")[0][0]), 0);
  EXPECT_EQ(integer(database.run("PRAGMA application_id")[0][0]), 5);
}

TEST(Sqlite, ValuesComeBackAsTheyWere) {
  const support::TemporaryFolder folder;
  SqliteDatabase database(folder / "a.db", 5);
  database.run(database.in_its_words("CREATE TABLE t(a INT8, b REAL8, c TEXT, PRIMARY KEY(a)) KEYED"));
  const std::string odd("a\0b\xe2\x80\xae';--", 9);
  database.run("INSERT INTO t VALUES ($1, $2, $3)", {std::int64_t{1} << 60, 0.1, odd});
  database.run("INSERT INTO t VALUES ($1, $2, $3)", {std::int64_t{2}, Value(), Value()});
  const auto rows = database.run("SELECT * FROM t ORDER BY a DESC");
  EXPECT_EQ(integer(rows[0][0]), std::int64_t{1} << 60);
  EXPECT_EQ(number(rows[0][1]), 0.1);
  EXPECT_EQ(text(rows[0][2]), odd);
  EXPECT_EQ(number(rows[1][1]), std::nullopt);
  EXPECT_THROW(database.run("INSERT INTO t VALUES ('text', 1, 2)"), files::ContentError) << "strict types";
}

TEST(Sqlite, ParametersAreKnownByTheirNumberNotTheirPlace) {
  const support::TemporaryFolder folder;
  SqliteDatabase database(folder / "a.db", 5);
  const auto rows = database.run("SELECT $2, $1, $2", {std::string("one"), std::string("two")});
  EXPECT_EQ(text(rows[0][0]) + text(rows[0][1]) + text(rows[0][2]), "twoonetwo");
}

TEST(Sqlite, ATransactionThatIsNotCommittedLeavesNothing) {
  const support::TemporaryFolder folder;
  SqliteDatabase database(folder / "a.db", 5);
  database.run("CREATE TABLE t(a INTEGER PRIMARY KEY)");
  {
    Transaction transaction(database);
    database.run("INSERT INTO t VALUES (1)");
  }
  EXPECT_TRUE(database.run("SELECT * FROM t").empty());
  {
    Transaction transaction(database);
    database.run("INSERT INTO t VALUES (1)");
    EXPECT_THROW(database.run("INSERT INTO t VALUES (1)"), files::ContentError);
    transaction.commit();
  }
  EXPECT_EQ(database.run("SELECT * FROM t").size(), 1u);
}

/// Whether another process finds a lock on it.
bool locked_for_others(const std::filesystem::path& file) {
  const pid_t child = ::fork();
  if (child == 0) {
    struct flock any {};
    any.l_type = F_WRLCK;
    any.l_whence = SEEK_SET;
    const int opened = ::open(file.c_str(), O_RDWR | O_CLOEXEC);
    ::_exit(::fcntl(opened, F_GETLK, &any) == 0 && any.l_type != F_UNLCK ? 1 : 0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) && WEXITSTATUS(status) == 1;
}

TEST(Sqlite, AnotherConnectionOfTheProcessLeavesItsLocks) {
  if (wal_is_safe(sqlite3_libversion_number())) GTEST_SKIP() << "the locks are in another file";
  const support::TemporaryFolder folder;
  SqliteDatabase database(folder / "a.db", 5);
  database.run("CREATE TABLE t(a INTEGER PRIMARY KEY)");
  Transaction transaction(database);
  database.run("INSERT INTO t VALUES (1)");
  EXPECT_TRUE(locked_for_others(folder / "a.db"));
  const SqliteDatabase other(folder / "a.db", 5);
  EXPECT_TRUE(locked_for_others(folder / "a.db"));
  transaction.commit();
  EXPECT_FALSE(locked_for_others(folder / "a.db"));
}

TEST(Sqlite, ADamagedFileSaysSo) {
  const support::TemporaryFolder folder;
  const auto file = folder.write("a.db", std::string(5000, 'x'));
  try {
    SqliteDatabase database(file, 5);
    FAIL();
  } catch (const files::ContentError& error) {
    EXPECT_THAT(error.what(), HasSubstr("a.db"));
    EXPECT_THAT(error.what(), HasSubstr("restore it from a backup"));
  }
}

}  // namespace
}  // namespace stylet::lab::store
