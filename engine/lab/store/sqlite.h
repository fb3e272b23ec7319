// SQLite, opened so that a commit outlives a power cut.
#pragma once

#include "engine/lab/store/database.h"

#include <filesystem>
#include <map>
#include <memory>

struct sqlite3;
struct sqlite3_stmt;

namespace stylet::lab::store {

/// Whether write-ahead logging is safe with several connections in this version (3053001 is 3.53.1): before 3.51.3 a
/// race could lose what was committed ("WAL-reset bug"); mended also in 3.50.7 and 3.44.6.
bool wal_is_safe(int version);

/// One connection, one thread at a time. Foreign keys hold; deleted content is overwritten; a rollback journal that
/// is truncated, with a sync at each commit, or a write-ahead log where wal_is_safe().
class SqliteDatabase final : public Database {
public:
  /// Opens the file, or makes it, readable by its owner alone. @param application_id  kept in the file; another
  /// program's file is refused
  /// @throws files::ContentError  it cannot be opened, is damaged, another program's, or on a network drive, whose
  /// locks do not hold
  SqliteDatabase(std::filesystem::path file, std::int32_t application_id);
  ~SqliteDatabase() override;
  SqliteDatabase(const SqliteDatabase&) = delete;
  SqliteDatabase& operator=(const SqliteDatabase&) = delete;

  std::vector<Row> run(const std::string& sql, const std::vector<Value>& values = {}) override;
  std::string in_its_words(std::string_view ddl) const override;
  void begin() override { run("BEGIN IMMEDIATE"); }

  /// Reads the whole file for damage. @throws files::ContentError  there is some
  void check();
  void copy_to(const std::filesystem::path& to) override;
  std::string place() const override { return file_.string(); }
  void wipe_deleted() override { run("VACUUM"); }
  /// The journal of a transaction that was cut off lay there when it was opened (and has been rolled back).
  bool was_cut_off() const { return was_cut_off_; }

private:
  [[noreturn]] void fail(const std::string& doing);
  sqlite3_stmt* prepared(const std::string& sql);

  struct Close {
    void operator()(sqlite3* database) const;
    void operator()(sqlite3_stmt* statement) const;
  };
  std::filesystem::path file_;
  bool was_cut_off_ = false;
  std::unique_ptr<sqlite3, Close> database_;
  std::map<std::string, std::unique_ptr<sqlite3_stmt, Close>> prepared_;
};

}  // namespace stylet::lab::store
