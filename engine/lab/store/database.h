// A database as the queries of this room see it: SQL that SQLite and PostgreSQL both have, values in, rows out.
// Parameters are $1, $2, ... in order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace stylet::lab::store {

/// Null, integer, number, text.
using Value = std::variant<std::monostate, std::int64_t, double, std::string>;
using Row = std::vector<Value>;

/// The value or null.
template <typename T>
Value value_of(const std::optional<T>& value) {
  return value ? Value(*value) : Value();
}

// Values as the column's type has them; null is empty, 0 or nothing.
std::string text(const Value& value);
std::string text(Value&& value);
std::int64_t integer(const Value& value);
std::optional<double> number(const Value& value);
std::optional<bool> truth(const Value& value);

class Database {
public:
  virtual ~Database() = default;
  /// Runs one statement. @throws files::ContentError  what the database says, with the file or server
  virtual std::vector<Row> run(const std::string& sql, const std::vector<Value>& values = {}) = 0;
  /// A statement that makes a table, written with INT8, REAL8, STRICT and KEYED (its primary key is its order), in
  /// the words of this database.
  virtual std::string in_its_words(std::string_view ddl) const = 0;
  /// Begins a transaction that may write; waits until it is the only one.
  virtual void begin() = 0;
  /// Its file or server, without a password.
  virtual std::string place() const = 0;
  /// What was deleted is no more in the files that it reads and writes.
  virtual void wipe_deleted() = 0;
  /// Writes a copy, whole as of now, while others go on. @throws files::ContentError  also where `to` is there
  /// already, or the database is one of a server
  virtual void copy_to(const std::filesystem::path& to) = 0;
};

/// The text with each of the words replaced.
std::string with_words(std::string_view text,
                       const std::vector<std::pair<std::string_view, std::string_view>>& words);

/// All or nothing: rolled back unless committed.
class Transaction {
public:
  explicit Transaction(Database& database);
  ~Transaction();
  Transaction(const Transaction&) = delete;
  Transaction& operator=(const Transaction&) = delete;
  void commit();

private:
  Database& database_;
  bool open_ = true;
};

}  // namespace stylet::lab::store
