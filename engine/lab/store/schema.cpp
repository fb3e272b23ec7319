#include "engine/lab/store/schema.h"

#include "engine/files/error.h"

#include <fmt/format.h>

namespace stylet::lab::store {

namespace {

// Ids are UUIDs of version 7 as 36 characters, times Unix milliseconds UTC, truths 0 and 1. What people may change
// later is a new row. The number of an attempt is computed: two stations that are offline would both write "7".
const std::vector<Migration>& all() {
  static const std::vector<Migration> steps{
      {.version = 1,
       .statements =
           {
               "CREATE TABLE station(id TEXT PRIMARY KEY, name TEXT NOT NULL, created_ms INT8 NOT NULL) STRICT",
               "CREATE TABLE trainee(id TEXT PRIMARY KEY, pseudonym TEXT NOT NULL UNIQUE, role TEXT NOT NULL CHECK "
               "(role IN "
               "('trainee', 'expert', 'instructor', 'test')), level TEXT NOT NULL, created_ms INT8 NOT NULL) STRICT",
               // By their content: a changed rule is another row.
               "CREATE TABLE course(sha256 TEXT PRIMARY KEY, name TEXT NOT NULL, spec TEXT NOT NULL) STRICT",
               "CREATE TABLE scenario(sha256 TEXT PRIMARY KEY, name TEXT NOT NULL, title TEXT NOT NULL, scoring TEXT "
               "NOT "
               "NULL) STRICT",
               "CREATE TABLE attempt(id TEXT PRIMARY KEY, trainee TEXT NOT NULL REFERENCES trainee(id), course TEXT "
               "REFERENCES course(sha256), scenario TEXT NOT NULL REFERENCES scenario(sha256), station TEXT NOT NULL "
               "REFERENCES station(id), mode TEXT NOT NULL CHECK (mode IN ('tutorial', 'guided', 'practice', "
               "'graded', "
               "'retention', 'benchmark')), build TEXT NOT NULL, stylus TEXT NOT NULL, loop_mode TEXT NOT NULL, "
               "started_ms "
               "INT8 NOT NULL, utc_offset_min INT8 NOT NULL, ended_ms INT8, status TEXT NOT NULL CHECK (status IN "
               "('running', 'ended', 'aborted', 'crashed')), total REAL8, pass_mark REAL8, passed INT8, "
               "failed_critical "
               "TEXT, missed_deadlines INT8, state_hash TEXT, recording_sha256 TEXT, recording_bytes INT8) STRICT",
               "CREATE INDEX attempt_of_trainee ON attempt(trainee, scenario, started_ms)",
               "CREATE INDEX attempt_by_status ON attempt(status)",
               // No cascade: with it a later version that rebuilds `attempt` (DROP TABLE deletes its rows first)
               // would empty what refers to it.
               "CREATE TABLE attempt_metric(attempt TEXT NOT NULL REFERENCES attempt(id), metric "
               "TEXT NOT "
               "NULL, value REAL8, points REAL8, most REAL8, PRIMARY KEY(attempt, metric)) KEYED",
               "CREATE TABLE exclusion(id TEXT PRIMARY KEY, attempt TEXT NOT NULL REFERENCES attempt(id), "
               "author TEXT NOT NULL, at_ms INT8 NOT NULL, why TEXT NOT NULL, undone INT8 NOT NULL) STRICT",
               "CREATE INDEX exclusion_of_attempt ON exclusion(attempt)",
               "CREATE TABLE audit(id TEXT PRIMARY KEY, at_ms INT8 NOT NULL, who TEXT NOT NULL, what TEXT NOT NULL, "
               "object "
               "TEXT NOT NULL) STRICT",
               "CREATE TABLE tombstone(id TEXT PRIMARY KEY, kind TEXT NOT NULL, at_ms INT8 NOT NULL) STRICT",
           }},
      {.version = 2,
       .statements =
           {
               // Of the lab: "xapi.endpoint".
               "CREATE TABLE setting(name TEXT PRIMARY KEY, value TEXT NOT NULL) STRICT",
               // Statements that a record store has not got yet, frozen when they were written.
               "CREATE TABLE outbox(statement TEXT PRIMARY KEY, attempt TEXT NOT NULL REFERENCES attempt(id), seq "
               "INT8 "
               "NOT NULL, body TEXT NOT NULL, created_ms INT8 NOT NULL, state TEXT NOT NULL CHECK (state IN "
               "('waiting', 'conflict', 'rejected')), said TEXT NOT NULL) STRICT",
               "CREATE INDEX outbox_in_order ON outbox(state, created_ms, seq)",
               "CREATE INDEX outbox_of_attempt ON outbox(attempt)",
           }},
      {.version = 3,
       .statements =
           {
               "CREATE TABLE instructor(name TEXT PRIMARY KEY, password TEXT NOT NULL, created_ms INT8 NOT NULL) "
               "STRICT",
               "CREATE TABLE note(id TEXT PRIMARY KEY, trainee TEXT NOT NULL REFERENCES trainee(id), author TEXT NOT "
               "NULL, at_ms INT8 NOT NULL, body TEXT NOT NULL) STRICT",
               "CREATE INDEX note_of_trainee ON note(trainee, at_ms)",
           }},
      {.version = 4,
       .statements =
           {
               // Whoever was enrolled at a station without the server, and was somebody there already.
               "CREATE TABLE joined(id TEXT PRIMARY KEY, trainee TEXT NOT NULL REFERENCES trainee(id)) STRICT",
               "CREATE INDEX joined_of_trainee ON joined(trainee)",
           }},
      {.version = 5,
       .statements =
           {
               "CREATE TABLE consent(id TEXT PRIMARY KEY, trainee TEXT NOT NULL REFERENCES trainee(id), purpose TEXT "
               "NOT NULL CHECK (purpose IN ('record_store', 'research')), given INT8 NOT NULL, at_ms INT8 NOT NULL) "
               "STRICT",
               "CREATE INDEX consent_of_trainee ON consent(trainee, purpose, at_ms)",
               // The last word on a purpose. Statements that wait from before are held back without it.
               "CREATE VIEW consent_now AS SELECT c.trainee, c.purpose, c.given, c.at_ms FROM consent c WHERE NOT "
               "EXISTS (SELECT 1 FROM consent later WHERE later.trainee = c.trainee AND later.purpose = c.purpose "
               "AND "
               "(later.at_ms > c.at_ms OR (later.at_ms = c.at_ms AND later.id > c.id)))",
               // Of a trainee at a station; how many tries in a row were wrong, and from when the next is looked at.
               "CREATE TABLE pin(trainee TEXT PRIMARY KEY REFERENCES trainee(id), hash TEXT NOT NULL, wrong INT8 NOT "
               "NULL, until_ms INT8 NOT NULL) STRICT",
           }},
  };
  return steps;
}

constexpr std::string_view kVersions =
    "CREATE TABLE IF NOT EXISTS schema_version(version INT8 PRIMARY KEY, applied_ms INT8 NOT NULL, build TEXT NOT "
    "NULL) "
    "STRICT";

int version_in(Database& database) {
  return static_cast<int>(integer(database.run("SELECT max(version) FROM schema_version")[0][0]));
}

}  // namespace

std::span<const Migration> migrations() {
  return all();
}

int schema_version(Database& database) {
  Transaction transaction(database);  // of two programs at once one makes it
  database.run(database.in_its_words(kVersions));
  const int version = version_in(database);
  transaction.commit();
  return version;
}

void migrate(Database& database, std::span<const Migration> steps, std::int64_t now_ms, const std::string& build) {
  const int newest = steps.empty() ? 0 : steps.back().version;
  if (const int version = schema_version(database); version > newest) {
    throw files::ContentError(
        fmt::format("the lab's records are of version {}, made by a newer Stylet; this one knows "
                    "up to {}: use the newer one",
                    version, newest));
  }
  for (const Migration& step : steps) {
    Transaction transaction(database);
    if (version_in(database) >= step.version) continue;  // another program was faster
    for (const std::string_view statement : step.statements) database.run(database.in_its_words(statement));
    database.run("INSERT INTO schema_version VALUES ($1, $2, $3)", {std::int64_t{step.version}, now_ms, build});
    transaction.commit();
  }
}

}  // namespace stylet::lab::store
