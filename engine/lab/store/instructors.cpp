// Who teaches here, and what they note.
#include "engine/files/error.h"
#include "engine/files/json_scan.h"
#include "engine/lab/store/identity.h"
#include "engine/lab/store/lab.h"

#include <fmt/format.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace stylet::lab::store {

void Lab::set_instructor(const std::string& name, const std::string& hash) {
  Transaction transaction(database_);
  database_.run("DELETE FROM instructor WHERE name = $1", {name});
  database_.run("INSERT INTO instructor(name, password, created_ms) VALUES ($1, $2, $3)",
                {name, hash, settings_.clock()});
  transaction.commit();
}

std::optional<std::string> Lab::instructor(const std::string& name) {
  const auto rows = database_.run("SELECT password FROM instructor WHERE name = $1", {name});
  if (rows.empty()) return std::nullopt;
  return text(rows[0][0]);
}

bool Lab::has_instructors() {
  return !database_.run("SELECT 1 FROM instructor LIMIT 1").empty();
}

void Lab::add_note(const std::string& trainee, const std::string& author, const std::string& body) {
  if (body.empty() || body.size() > kLongestNote || !files::is_utf8(body)) {
    throw files::ContentError(fmt::format("a note has up to {} bytes, and some", kLongestNote));
  }
  const std::int64_t now = settings_.clock();
  database_.run("INSERT INTO note(id, trainee, author, at_ms, body) VALUES ($1, $2, $3, $4, $5)",
                {new_id(now), trainee, author, now, body});
}

std::vector<Note> Lab::notes(const std::string& trainee) {
  std::vector<Note> all;
  for (const Row& row :
       database_.run("SELECT author, at_ms, body FROM note WHERE trainee = $1 ORDER BY at_ms, id", {trainee})) {
    all.push_back({.author = text(row[0]), .at_ms = integer(row[1]), .body = text(row[2])});
  }
  return all;
}

}  // namespace stylet::lab::store
