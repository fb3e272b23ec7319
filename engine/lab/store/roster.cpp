#include "engine/lab/store/roster.h"

#include "engine/lab/store/sqlite.h"

#include <utility>

namespace stylet::lab::store {

namespace {
constexpr std::int32_t kRosterFile = 0x53744C72;  // "StLr"
}

Roster::Roster(const std::filesystem::path& file) : Roster(std::make_unique<SqliteDatabase>(file, kRosterFile)) {}

Roster::Roster(std::unique_ptr<Database> database) : database_(std::move(database)) {
  Transaction transaction(*database_);  // of two programs at once one makes it
  database_->run(database_->in_its_words(
      "CREATE TABLE IF NOT EXISTS person(pseudonym TEXT PRIMARY KEY, name TEXT NOT NULL UNIQUE, "
      "created_ms INT8 NOT NULL) STRICT"));
  transaction.commit();
}

std::optional<std::string> Roster::pseudonym_of(const std::string& name) {
  const auto rows = database_->run("SELECT pseudonym FROM person WHERE name = $1", {name});
  if (rows.empty()) return std::nullopt;
  return text(rows[0][0]);
}

void Roster::add(const std::string& name, const std::string& pseudonym, std::int64_t now_ms) {
  database_->run("INSERT INTO person VALUES ($1, $2, $3) ON CONFLICT(name) DO NOTHING", {pseudonym, name, now_ms});
}

void Roster::remove(const std::string& pseudonym) {
  database_->run("DELETE FROM person WHERE pseudonym = $1", {pseudonym});
  database_->wipe_deleted();
}

std::map<std::string, std::string> Roster::names() {
  std::map<std::string, std::string> names;
  for (const Row& row : database_->run("SELECT pseudonym, name FROM person")) names[text(row[0])] = text(row[1]);
  return names;
}

}  // namespace stylet::lab::store
