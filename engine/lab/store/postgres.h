// PostgreSQL, for a lab of many stations.
#pragma once

#include "engine/files/error.h"
#include "engine/lab/store/database.h"

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

struct pg_conn;
struct pg_result;

namespace stylet::lab::store {

/// The server cannot do what it was asked for: it is full, may only be read, or is not there.
class ServerProblem : public files::ContentError {
public:
  using ContentError::ContentError;
};

/// The server is not there, or is no more: another try later may do.
class ServerAway : public ServerProblem {
public:
  using ServerProblem::ServerProblem;
};

/// Whether a connection string has a password in it. @throws files::ContentError  it is no connection string
bool has_password(const std::string& address);

/// One connection, one thread at a time. Each transaction that may write waits for the one before, as in SQLite, also
/// those that make tables: eight stations may open the same empty database at once. A connection that is lost between
/// two transactions is made anew; within one it is an error, and nothing of it stays. Messages have no password and
/// no values.
class PostgresDatabase final : public Database {
public:
  /// @param address  as libpq has it, postgresql://USER@HOST/DATABASE; what it leaves out is of libpq's environment
  /// and files (~/.pgpass). Another computer than this one is reached by TLS alone: sslmode=require where it says
  /// nothing
  /// @param schema  of its tables there, lower case; made where it is not there
  /// @throws ServerAway; files::ContentError  the address is none, or would go through a network in the clear
  PostgresDatabase(std::string address, std::string schema);

  /// @throws ServerProblem
  std::vector<Row> run(const std::string& sql, const std::vector<Value>& values = {}) override;
  std::string in_its_words(std::string_view ddl) const override;
  void begin() override;
  std::string place() const override { return place_; }
  void wipe_deleted() override;
  void copy_to(const std::filesystem::path& to) override;

private:
  struct Close {
    void operator()(pg_conn* connection) const;
    void operator()(pg_result* result) const;
  };
  using Result = std::unique_ptr<pg_result, Close>;
  void connect();
  Result send(const std::string& sql, const std::vector<Value>& values);
  bool is_lost(const Result& result) const;
  [[noreturn]] void fail(const Result& result);

  std::string address_;
  std::string schema_;
  std::string place_;
  std::unique_ptr<pg_conn, Close> connection_;  ///< null: it is lost
  bool in_transaction_ = false;
};

}  // namespace stylet::lab::store
