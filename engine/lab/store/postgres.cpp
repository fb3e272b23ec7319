#include "engine/lab/store/postgres.h"

#include <libpq-fe.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <map>
#include <sstream>
#include <type_traits>
#include <utility>

namespace stylet::lab::store {

namespace {

constexpr int kOldestServer = 120000;
// Of pg_type.dat.
constexpr Oid kBool = 16;
constexpr Oid kInt8 = 20;
constexpr Oid kInt2 = 21;
constexpr Oid kInt4 = 23;
constexpr Oid kText = 25;
constexpr Oid kFloat4 = 700;
constexpr Oid kFloat8 = 701;
constexpr Oid kNumeric = 1700;

using Options = std::map<std::string, std::string>;

Options options_of(const std::string& address) {
  // What libpq says of a string that it does not understand may quote it, password and all.
  char* said = nullptr;
  PQconninfoOption* parsed = PQconninfoParse(address.c_str(), &said);
  PQfreemem(said);
  if (parsed == nullptr) {
    throw files::ContentError(
        "the address of the lab's server is none; write postgresql://USER@HOST/DATABASE, a password into ~/.pgpass");
  }
  Options options;
  for (const PQconninfoOption* option = parsed; option->keyword != nullptr; ++option) {
    if (option->val != nullptr) options[option->keyword] = option->val;
  }
  PQconninfoFree(parsed);
  return options;
}

/// As given, else of libpq's environment.
std::string given(const Options& options, const char* keyword, const char* variable) {
  if (const auto found = options.find(keyword); found != options.end()) return found->second;
  const char* value = std::getenv(variable);
  return value != nullptr ? value : "";
}

bool is_this_computer(const std::string& hosts) {
  std::istringstream stream(hosts);
  for (std::string host; std::getline(stream, host, ',');) {
    const bool socket = host.empty() || host.front() == '/' || host.front() == '@';
    if (!socket && host != "localhost" && host != "::1" && !host.starts_with("127.")) return false;
  }
  return true;
}

void ask_for_tls(Options& options) {
  const bool here = is_this_computer(given(options, "host", "PGHOST")) &&
                    is_this_computer(given(options, "hostaddr", "PGHOSTADDR")) &&
                    given(options, "service", "PGSERVICE").empty();
  if (here) return;
  const std::string mode = given(options, "sslmode", "PGSSLMODE");
  if (mode.empty()) {
    options["sslmode"] = "require";
  } else if (mode != "require" && mode != "verify-ca" && mode != "verify-full") {
    throw files::ContentError(fmt::format(
        "the lab's server is another computer, and sslmode={} may send records in the clear; say require or "
        "verify-full",
        mode));
  }
}

std::string one_line_of(std::string said) {
  std::ranges::replace_if(
      said, [](char c) { return static_cast<unsigned char>(c) < 0x20; }, ' ');
  const std::size_t last = said.find_last_not_of(' ');
  return said.substr(0, last == std::string::npos ? 0 : last + 1);
}

Value value_of_text(Oid type, const char* text, std::size_t size) {
  const char* end = text + size;
  switch (type) {
    case kBool:
      return std::int64_t{*text == 't' ? 1 : 0};
    case kInt8:
    case kInt2:
    case kInt4: {
      std::int64_t value = 0;
      std::from_chars(text, end, value);
      return value;
    }
    case kNumeric:  // the sum of integers
      if (std::int64_t value = 0; std::from_chars(text, end, value).ptr == end) return value;
      [[fallthrough]];
    case kFloat4:
    case kFloat8: {
      double value = 0;
      std::from_chars(text, end, value);
      return value;
    }
    default:
      return std::string(text, size);
  }
}

/// Values as libpq takes them.
struct Parameters {
  explicit Parameters(const std::vector<Value>& values) {
    texts.reserve(values.size());
    for (const Value& value : values) {
      std::visit(
          [&](const auto& held) {
            using T = std::decay_t<decltype(held)>;
            if constexpr (std::is_same_v<T, std::monostate>) {
              add_null();
            } else if constexpr (std::is_same_v<T, std::int64_t>) {
              add(kInt8, fmt::format("{}", held));
            } else if constexpr (std::is_same_v<T, double>) {
              // As SQLite has it. The shortest text that is this number.
              if (std::isnan(held)) {
                add_null();
              } else {
                add(kFloat8, fmt::format("{}", held));
              }
            } else {
              if (held.find('\0') != std::string::npos) {
                throw files::ContentError("a text with a zero byte cannot be kept; take it out");
              }
              add(kText, held);
            }
          },
          value);
    }
  }
  void add(Oid type, std::string text) {
    types.push_back(type);
    pointers.push_back(texts.emplace_back(std::move(text)).c_str());
  }
  void add_null() {
    types.push_back(0);
    pointers.push_back(nullptr);
  }
  std::vector<Oid> types{};
  std::vector<std::string> texts{};  // never moved: reserved
  std::vector<const char*> pointers{};
};

}  // namespace

bool has_password(const std::string& address) {
  const Options options = options_of(address);
  return options.contains("password") || options.contains("sslpassword");
}

void PostgresDatabase::Close::operator()(pg_conn* connection) const {
  PQfinish(connection);
}

void PostgresDatabase::Close::operator()(pg_result* result) const {
  PQclear(result);
}

PostgresDatabase::PostgresDatabase(std::string address, std::string schema)
    : address_(std::move(address)), schema_(std::move(schema)) {
  connect();
}

void PostgresDatabase::connect() {
  Options options = options_of(address_);
  const std::string host = given(options, "host", "PGHOST");
  const std::string name = given(options, "dbname", "PGDATABASE");
  place_ = fmt::format("PostgreSQL {}{}", host.empty() ? std::string("of this computer") : "at " + host,
                       name.empty() ? "" : ", database " + name);
  ask_for_tls(options);
  // A server that is away is known to be in seconds, also where a cable was pulled.
  for (const auto& [keyword, value] :
       std::array<std::pair<const char*, const char*>, 7>{{{"connect_timeout", "3"},
                                                           {"tcp_user_timeout", "10000"},
                                                           {"keepalives_idle", "10"},
                                                           {"keepalives_interval", "5"},
                                                           {"keepalives_count", "3"},
                                                           {"fallback_application_name", "stylet"},
                                                           {"client_encoding", "UTF8"}}}) {
    options.emplace(keyword, value);
  }
  std::vector<const char*> keywords;
  std::vector<const char*> values;
  for (const auto& [keyword, value] : options) {
    keywords.push_back(keyword.c_str());
    values.push_back(value.c_str());
  }
  keywords.push_back(nullptr);
  values.push_back(nullptr);
  in_transaction_ = false;
  connection_.reset(PQconnectdbParams(keywords.data(), values.data(), 0));
  if (PQstatus(connection_.get()) != CONNECTION_OK) {
    const std::string said = one_line_of(PQerrorMessage(connection_.get()));
    connection_.reset();
    throw ServerAway(fmt::format("{}: cannot be reached ({}); check address, rights and network", place_, said));
  }
  if (PQserverVersion(connection_.get()) < kOldestServer) {
    throw files::ContentError(place_ + ": is older than PostgreSQL 12; use a newer one");
  }
  // No values in what it says of a row; no remarks on the terminal.
  PQsetErrorVerbosity(connection_.get(), PQERRORS_TERSE);
  PQsetNoticeProcessor(
      connection_.get(), [](void*, const char*) {}, nullptr);
  // A commit is on the disk; whoever hangs with a lock loses it.
  for (const char* setting : {"synchronous_commit TO on", "lock_timeout TO '60s'",
                              "idle_in_transaction_session_timeout TO '60s'", "client_min_messages TO warning"}) {
    run(fmt::format("SET {}", setting));
  }
  run(fmt::format("SET search_path TO {}", schema_));
  if (!run("SELECT 1 FROM pg_namespace WHERE nspname = $1", {schema_}).empty()) return;
  Transaction transaction(*this);
  run(fmt::format("CREATE SCHEMA IF NOT EXISTS {}", schema_));
  transaction.commit();
}

PostgresDatabase::Result PostgresDatabase::send(const std::string& sql, const std::vector<Value>& values) {
  const Parameters parameters(values);
  return Result(PQexecParams(connection_.get(), sql.c_str(), static_cast<int>(values.size()), parameters.types.data(),
                             parameters.pointers.data(), nullptr, nullptr, 0));
}

bool PostgresDatabase::is_lost(const Result& result) const {
  const ExecStatusType status = PQresultStatus(result.get());
  if (status == PGRES_TUPLES_OK || status == PGRES_COMMAND_OK) return false;
  // What has no code comes from this side; 57P..: it is being stopped. The status itself may lag behind.
  const char* code = PQresultErrorField(result.get(), PG_DIAG_SQLSTATE);
  return PQstatus(connection_.get()) != CONNECTION_OK || code == nullptr || std::string_view(code).starts_with("57P");
}

void PostgresDatabase::fail(const Result& result) {
  const std::string said = one_line_of(PQerrorMessage(connection_.get()));
  const char* field = PQresultErrorField(result.get(), PG_DIAG_SQLSTATE);
  const std::string_view code = field != nullptr ? field : "";
  throw ServerProblem(fmt::format("{}: cannot be read or written ({}){}", place_, said,
                                  code == "55P03"   ? "; another station writes to it, try again"
                                  : code == "53100" ? "; make room on its disk"
                                                    : ""));
}

std::vector<Row> PostgresDatabase::run(const std::string& sql, const std::vector<Value>& values) {
  const bool ends = sql == "ROLLBACK" || sql == "COMMIT";
  const bool within = in_transaction_;
  if (ends) in_transaction_ = false;
  if (!connection_) {
    if (sql == "ROLLBACK") return {};  // it has, by itself
    if (within) throw ServerAway(place_ + ": the connection is lost; try again when the server is back");
    connect();
  }
  Result result = send(sql, values);
  // What reads, or only begins, is asked once more where the server was started anew in between.
  if (!within && (sql.starts_with("SELECT") || sql.starts_with("BEGIN")) && is_lost(result)) {
    connect();
    result = send(sql, values);
  }
  if (is_lost(result)) {
    const std::string said = one_line_of(PQerrorMessage(connection_.get()));
    connection_.reset();
    if (sql == "ROLLBACK") return {};
    throw ServerAway(fmt::format("{}: the connection is lost ({}); try again when the server is back", place_, said));
  }
  const ExecStatusType status = PQresultStatus(result.get());
  if (status != PGRES_TUPLES_OK && status != PGRES_COMMAND_OK) fail(result);
  if (sql == "COMMIT" && std::string_view(PQcmdStatus(result.get())) != "COMMIT") {
    throw files::ContentError(place_ + ": did not keep what was written; try again");
  }
  std::vector<Row> rows;
  const int columns = PQnfields(result.get());
  for (int r = 0; r < PQntuples(result.get()); ++r) {
    Row& row = rows.emplace_back();
    row.reserve(static_cast<std::size_t>(columns));
    for (int c = 0; c < columns; ++c) {
      row.push_back(PQgetisnull(result.get(), r, c) != 0
                        ? Value()
                        : value_of_text(PQftype(result.get(), c), PQgetvalue(result.get(), r, c),
                                        static_cast<std::size_t>(PQgetlength(result.get(), r, c))));
    }
  }
  return rows;
}

void PostgresDatabase::begin() {
  // One at a time, by a lock that goes with the transaction; what it then reads is what the one before has committed.
  run("BEGIN ISOLATION LEVEL READ COMMITTED READ WRITE");
  in_transaction_ = true;
  try {
    run("SELECT pg_advisory_xact_lock(1400130658, hashtext($1))", {schema_});  // "StLb"
  } catch (...) {
    try {
      run("ROLLBACK");
    } catch (const files::ContentError&) {  // the first error says why
    }
    throw;
  }
}

std::string PostgresDatabase::in_its_words(std::string_view ddl) const {
  // Text is ordered by its bytes, as in SQLite.
  return with_words(ddl, {{"INT8", "BIGINT"},
                          {"REAL8", "DOUBLE PRECISION"},
                          {" STRICT", ""},
                          {" KEYED", ""},
                          {"TEXT", "TEXT COLLATE \"C\""}});
}

void PostgresDatabase::wipe_deleted() {
  try {
    for (const Row& row : run("SELECT quote_ident(tablename) FROM pg_tables WHERE schemaname = $1", {schema_})) {
      run("VACUUM FULL " + text(row[0]));
    }
  } catch (const files::ContentError&) {
    // Others read or write it all the time, or it is away: deleted it is, and no query finds it.
  }
}

void PostgresDatabase::copy_to(const std::filesystem::path& /*to*/) {
  throw files::ContentError(place_ +
                            ": is backed up where it is, by pg_dump; each station's own files by themselves");
}

}  // namespace stylet::lab::store
