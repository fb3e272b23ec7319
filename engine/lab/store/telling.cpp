// What of the attempts goes to a record store, and the lab's settings.
#include "engine/files/error.h"
#include "engine/lab/statement/statement.h"
#include "engine/lab/store/lab.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <sstream>
#include <string>
#include <vector>

namespace stylet::lab::store {

namespace {

std::vector<std::string> words_of(const std::string& text) {
  std::istringstream stream(text);
  std::vector<std::string> words;
  for (std::string word; stream >> word;) words.push_back(word);
  return words;
}

statement::AttemptFacts facts_of(Database& database, const std::string& attempt, const std::string& home_page) {
  const auto rows = database.run(
      "SELECT t.pseudonym, s.name, s.title, a.scenario, coalesce(c.name, ''), a.mode, a.build, a.started_ms, "
      "a.ended_ms, a.status, a.total, a.passed, a.failed_critical, a.recording_sha256 FROM attempt a JOIN trainee t "
      "ON t.id = a.trainee JOIN scenario s ON s.sha256 = a.scenario LEFT JOIN course c ON c.sha256 = a.course WHERE "
      "a.id = $1",
      {attempt});
  if (rows.empty()) throw files::ContentError(fmt::format("attempt {}: is not in the records", attempt));
  const Row& row = rows[0];
  return {.attempt = attempt,
          .pseudonym = text(row[0]),
          .scenario = text(row[1]),
          .scenario_title = text(row[2]),
          .scenario_sha256 = text(row[3]),
          .course = text(row[4]),
          .home_page = home_page,
          .mode = text(row[5]),
          .build = text(row[6]),
          .started_ms = integer(row[7]),
          .ended_ms = integer(row[8]),
          .status = text(row[9]),
          .total = number(row[10]),
          .passed = truth(row[11]),
          .failed_critical = words_of(text(row[12])),
          .recording_sha256 = text(row[13])};
}

/// Whose it is agrees to its being told.
bool may_be_told(Lab& lab, const std::string& attempt) {
  const auto rows = lab.database().run("SELECT trainee FROM attempt WHERE id = $1", {attempt});
  return !rows.empty() && lab.consents_to(text(rows[0][0]), kRecordStore);
}

void write(Database& database, const std::string& attempt, const statement::Statement& told, std::int64_t seq,
           std::int64_t now) {
  // The same statement again is the one that is there.
  database.run(
      "INSERT INTO outbox(statement, attempt, seq, body, created_ms, state, said) VALUES ($1, $2, $3, $4, $5, "
      "'waiting', '') ON CONFLICT DO NOTHING",
      {told.id, attempt, seq, told.body, now});
}

}  // namespace

std::string Lab::setting(const std::string& name) {
  const auto rows = database_.run("SELECT value FROM setting WHERE name = $1", {name});
  return rows.empty() ? std::string() : text(rows[0][0]);
}

void Lab::set(const std::string& name, const std::string& value) {
  Transaction transaction(database_);
  database_.run("DELETE FROM setting WHERE name = $1", {name});
  if (!value.empty()) database_.run("INSERT INTO setting(name, value) VALUES ($1, $2)", {name, value});
  transaction.commit();
}

void Lab::tell_beginning(const std::string& attempt) {
  const std::string home_page = setting(kHomePage);
  if (home_page.empty() || !may_be_told(*this, attempt)) return;
  write(database_, attempt, statement::beginning(facts_of(database_, attempt, home_page)), 0, settings_.clock());
}

void Lab::tell_end(const std::string& attempt) {
  const std::string home_page = setting(kHomePage);
  if (home_page.empty() || !may_be_told(*this, attempt)) return;
  statement::AttemptFacts facts = facts_of(database_, attempt, home_page);
  const std::int64_t now = settings_.clock();
  if (facts.status == "crashed") facts.ended_ms = std::max(facts.started_ms, now);  // known now
  for (const MetricResult& metric : metrics(attempt)) facts.metrics.emplace_back(metric.metric, metric.value);
  std::int64_t seq = 1;
  for (const statement::Statement& told : statement::ending(facts)) write(database_, attempt, told, seq++, now);
}

}  // namespace stylet::lab::store
