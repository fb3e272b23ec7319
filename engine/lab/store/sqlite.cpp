#include "engine/lab/store/sqlite.h"

#include "engine/files/error.h"

#include <sqlite3.h>

#include <fcntl.h>
#include <sys/vfs.h>
#include <unistd.h>

#include <fmt/format.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <system_error>
#include <type_traits>
#include <utility>

namespace stylet::lab::store {

namespace fs = std::filesystem;

namespace {

constexpr int kBusyMs = 5000;

bool on_network_drive(const fs::path& folder) {
  struct statfs about {};
  if (::statfs(folder.c_str(), &about) != 0) return false;
  // NFS, SMB, CIFS, SMB2.
  constexpr std::array<unsigned, 4> kRemote{0x6969U, 0x517BU, 0xFF534D42U, 0xFE534D42U};
  for (const unsigned type : kRemote) {
    if (static_cast<unsigned>(about.f_type) == type) return true;
  }
  return false;
}

/// What is in it is about people: SQLite would let the umask decide.
void make_private(const fs::path& file) {
  // Never opened where it is there: closing it would drop every lock that this process has on it (POSIX), also in the
  // middle of another connection's transaction.
  const int made = ::open(file.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0600);
  if (made < 0 && errno == EEXIST && ::access(file.c_str(), R_OK | W_OK) == 0) return;
  if (made < 0) {
    throw files::ContentError(
        fmt::format("{}: cannot be opened ({}); check folder and rights", file.string(), std::strerror(errno)));
  }
  ::close(made);
}

Value column(sqlite3_stmt* statement, int index) {
  switch (sqlite3_column_type(statement, index)) {
    case SQLITE_INTEGER:
      return static_cast<std::int64_t>(sqlite3_column_int64(statement, index));
    case SQLITE_FLOAT:
      return sqlite3_column_double(statement, index);
    case SQLITE_NULL:
      return {};
    default:
      return std::string(reinterpret_cast<const char*>(sqlite3_column_text(statement, index)),
                         static_cast<std::size_t>(sqlite3_column_bytes(statement, index)));
  }
}

void bind(sqlite3_stmt* statement, int index, const Value& value) {
  std::visit(
      [&](const auto& held) {
        using T = std::decay_t<decltype(held)>;
        if constexpr (std::is_same_v<T, std::monostate>) {
          sqlite3_bind_null(statement, index);
        } else if constexpr (std::is_same_v<T, std::int64_t>) {
          sqlite3_bind_int64(statement, index, held);
        } else if constexpr (std::is_same_v<T, double>) {
          sqlite3_bind_double(statement, index, held);
        } else {
          sqlite3_bind_text(statement, index, held.data(), static_cast<int>(held.size()), SQLITE_TRANSIENT);
        }
      },
      value);
}

}  // namespace

bool wal_is_safe(int version) {
  const int branch = version / 1000;  // 3051 is 3.51
  return version >= 3051003 || (branch == 3050 && version >= 3050007) || (branch == 3044 && version >= 3044006);
}

void SqliteDatabase::Close::operator()(sqlite3* database) const {
  sqlite3_close(database);
}

void SqliteDatabase::Close::operator()(sqlite3_stmt* statement) const {
  sqlite3_finalize(statement);
}

SqliteDatabase::SqliteDatabase(fs::path file, std::int32_t application_id) : file_(std::move(file)) {
  if (on_network_drive(file_.parent_path())) {
    throw files::ContentError(
        file_.string() + ": lies on a network drive, whose locks do not hold; keep it on a disk of this computer");
  }
  make_private(file_);
  std::error_code error;
  const fs::path journal = file_.string() + "-journal";
  was_cut_off_ = fs::exists(journal, error) && fs::file_size(journal, error) > 0;
  sqlite3* opened = nullptr;
  const int result = sqlite3_open_v2(file_.c_str(), &opened, SQLITE_OPEN_READWRITE | SQLITE_OPEN_EXRESCODE, nullptr);
  database_.reset(opened);
  if (result != SQLITE_OK) fail("cannot be opened");
  sqlite3_busy_timeout(database_.get(), kBusyMs);
  for (const char* setting : {"foreign_keys=ON", "trusted_schema=OFF", "cell_size_check=ON", "secure_delete=ON"}) {
    run(fmt::format("PRAGMA {}", setting));
  }
  // With several connections: the folder's entry of a journal is synced too where it is truncated, not deleted.
  run(wal_is_safe(sqlite3_libversion_number()) ? "PRAGMA journal_mode=WAL" : "PRAGMA journal_mode=TRUNCATE");
  run("PRAGMA synchronous=FULL");
  const std::int64_t of = integer(run("PRAGMA application_id")[0][0]);
  const bool empty = run("SELECT 1 FROM sqlite_schema LIMIT 1").empty();
  if (of == 0 && empty) {
    run(fmt::format("PRAGMA application_id={}", application_id));
  } else if (of != application_id) {
    throw files::ContentError(file_.string() + ": is a database of another program; name another folder");
  }
  if (was_cut_off_) check();
}

SqliteDatabase::~SqliteDatabase() {
  prepared_.clear();  // before what they are of
}

void SqliteDatabase::fail(const std::string& doing) {
  const int code = sqlite3_errcode(database_.get()) & 0xff;
  const char* what_to_do = code == SQLITE_BUSY   ? "; another program writes to it, try again"
                           : code == SQLITE_FULL ? "; make room on the disk"
                           : code == SQLITE_CORRUPT || code == SQLITE_NOTADB ? "; restore it from a backup"
                                                                             : "";
  throw files::ContentError(
      fmt::format("{}: {} ({}){}", file_.string(), doing, sqlite3_errmsg(database_.get()), what_to_do));
}

sqlite3_stmt* SqliteDatabase::prepared(const std::string& sql) {
  if (const auto found = prepared_.find(sql); found != prepared_.end()) return found->second.get();
  sqlite3_stmt* statement = nullptr;
  if (sqlite3_prepare_v2(database_.get(), sql.data(), static_cast<int>(sql.size()), &statement, nullptr) !=
      SQLITE_OK) {
    fail("does not understand: " + sql);
  }
  prepared_[sql].reset(statement);
  return statement;
}

std::vector<Row> SqliteDatabase::run(const std::string& sql, const std::vector<Value>& values) {
  sqlite3_stmt* statement = prepared(sql);
  // Left ready for the next time, however this ends.
  const struct Reset {
    sqlite3_stmt* statement;
    ~Reset() {
      sqlite3_reset(statement);
      sqlite3_clear_bindings(statement);
    }
  } reset{statement};
  for (std::size_t i = 0; i < values.size(); ++i) {
    // SQLite numbers names such as $2 in the order in which they come.
    const int index = sqlite3_bind_parameter_index(statement, fmt::format("${}", i + 1).c_str());
    if (index > 0) bind(statement, index, values[i]);
  }
  std::vector<Row> rows;
  int result = SQLITE_OK;
  while ((result = sqlite3_step(statement)) == SQLITE_ROW) {
    Row& row = rows.emplace_back();
    const int columns = sqlite3_column_count(statement);
    row.reserve(static_cast<std::size_t>(columns));
    for (int i = 0; i < columns; ++i) row.push_back(column(statement, i));
  }
  if (result != SQLITE_DONE) fail("cannot be read or written");
  return rows;
}

std::string SqliteDatabase::in_its_words(std::string_view ddl) const {
  return with_words(ddl, {{"INT8", "INTEGER"}, {"REAL8", "REAL"}, {"KEYED", "STRICT, WITHOUT ROWID"}});
}

void SqliteDatabase::check() {
  const std::vector<Row> rows = run("PRAGMA quick_check(1)");
  if (rows.size() == 1 && text(rows[0][0]) == "ok") return;
  throw files::ContentError(fmt::format("{}: is damaged ({}); restore it from a backup", file_.string(),
                                        rows.empty() ? "no answer" : text(rows[0][0])));
}

void SqliteDatabase::copy_to(const fs::path& to) {
  run("VACUUM INTO $1", {to.string()});
  std::error_code error;
  fs::permissions(to, fs::perms::owner_read | fs::perms::owner_write, error);
  const int file = ::open(to.c_str(), O_RDONLY | O_CLOEXEC);
  if (error || file < 0 || ::fsync(file) != 0) {
    if (file >= 0) ::close(file);
    throw files::ContentError(fmt::format("{}: cannot be written whole; check folder and space", to.string()));
  }
  ::close(file);
}

}  // namespace stylet::lab::store
