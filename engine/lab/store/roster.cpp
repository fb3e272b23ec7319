#include "engine/lab/store/roster.h"

namespace stylet::lab::store {

namespace {
constexpr std::int32_t kRosterFile = 0x53744C72;  // "StLr"
}

Roster::Roster(const std::filesystem::path& file) : database_(file, kRosterFile) {
  database_.run(
      "CREATE TABLE IF NOT EXISTS person(pseudonym TEXT PRIMARY KEY, name TEXT NOT NULL UNIQUE, created_ms INTEGER "
      "NOT "
      "NULL) STRICT");
}

std::optional<std::string> Roster::pseudonym_of(const std::string& name) {
  const auto rows = database_.run("SELECT pseudonym FROM person WHERE name = $1", {name});
  if (rows.empty()) return std::nullopt;
  return text(rows[0][0]);
}

void Roster::add(const std::string& name, const std::string& pseudonym, std::int64_t now_ms) {
  database_.run("INSERT INTO person VALUES ($1, $2, $3) ON CONFLICT(name) DO NOTHING", {pseudonym, name, now_ms});
}

void Roster::remove(const std::string& pseudonym) {
  database_.run("DELETE FROM person WHERE pseudonym = $1", {pseudonym});
  database_.run("VACUUM");
}

std::map<std::string, std::string> Roster::names() {
  std::map<std::string, std::string> names;
  for (const Row& row : database_.run("SELECT pseudonym, name FROM person")) names[text(row[0])] = text(row[1]);
  return names;
}

}  // namespace stylet::lab::store
