// What people agreed to, and for how long they are kept.
#include "engine/files/error.h"
#include "engine/files/json_scan.h"
#include "engine/lab/store/identity.h"
#include "engine/lab/store/lab.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cstdint>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

namespace stylet::lab::store {

namespace {

constexpr std::int64_t kMsOfRetentionDay = 86'400'000;
constexpr std::array<const char*, 2> kPurposes{kRecordStore, kResearch};

}  // namespace

std::vector<std::string> purposes() {
  return {kPurposes.begin(), kPurposes.end()};
}

void Lab::set_consent(const std::string& trainee, const std::string& purpose, bool given) {
  if (std::ranges::find(kPurposes, std::string_view(purpose)) == kPurposes.end()) {
    throw files::ContentError(
        fmt::format("{} is no purpose; there are {}", files::printable(purpose), fmt::join(kPurposes, ", ")));
  }
  Transaction transaction(database_);
  // The last word is the newest also where the clock was set back.
  const std::int64_t before = integer(database_.run(
      "SELECT coalesce(max(at_ms), 0) FROM consent WHERE trainee = $1 AND purpose = $2", {trainee, purpose})[0][0]);
  const std::int64_t now = std::max(settings_.clock(), before + 1);
  database_.run("INSERT INTO consent(id, trainee, purpose, given, at_ms) VALUES ($1, $2, $3, $4, $5)",
                {new_id(now), trainee, purpose, std::int64_t{given ? 1 : 0}, now});
  if (!given && purpose == kRecordStore) take_back_statements(trainee);
  transaction.commit();
}

void Lab::take_back_statements(const std::string& trainee) {
  database_.run("DELETE FROM outbox WHERE attempt IN (SELECT id FROM attempt WHERE trainee = $1)", {trainee});
}

std::vector<Consent> Lab::consents(const std::string& trainee) {
  std::vector<Consent> all;
  for (const char* purpose : kPurposes) {
    Consent& consent = all.emplace_back(Consent{.purpose = purpose});
    const auto rows = database_.run("SELECT given, at_ms FROM consent_now WHERE trainee = $1 AND purpose = $2",
                                    {trainee, std::string(purpose)});
    if (rows.empty()) continue;
    consent.given = truth(rows[0][0]);
    consent.at_ms = integer(rows[0][1]);
  }
  return all;
}

std::optional<bool> Lab::last_word(const std::string& trainee, const std::string& purpose) {
  const auto rows =
      database_.run("SELECT given FROM consent_now WHERE trainee = $1 AND purpose = $2", {trainee, purpose});
  return rows.empty() ? std::nullopt : truth(rows[0][0]);
}

bool Lab::consents_to(const std::string& trainee, const std::string& purpose) {
  return last_word(trainee, purpose).value_or(false);
}

bool Lab::refuses(const std::string& trainee, const std::string& purpose) {
  return !last_word(trainee, purpose).value_or(true);
}

std::optional<std::int64_t> Lab::retention_days() {
  const std::string set = setting(kRetentionDays);
  std::int64_t days = 0;
  const auto [end, error] = std::from_chars(set.data(), set.data() + set.size(), days);
  if (error != std::errc{} || end != set.data() + set.size() || days <= 0) return std::nullopt;
  return days;
}

std::vector<PersonSummary> Lab::overdue() {
  const std::optional<std::int64_t> days = retention_days();
  if (!days) return {};
  const std::int64_t before = settings_.clock() - *days * kMsOfRetentionDay;
  std::set<std::string> ids;
  for (const Row& row : database_.run(
           "SELECT t.id FROM trainee t LEFT JOIN attempt a ON a.trainee = t.id WHERE t.level <> $1 GROUP BY t.id, "
           "t.created_ms HAVING coalesce(max(a.started_ms), t.created_ms) < $2",
           {std::string(kAnonymous), before})) {
    ids.insert(text(row[0]));
  }
  std::vector<PersonSummary> all = people();
  std::erase_if(all, [&](const PersonSummary& each) { return !ids.contains(each.person.id); });
  return all;
}

void Lab::keep_numbers_of_nobody(const std::string& trainee, std::int64_t now) {
  const auto attempts = database_.run(
      "SELECT id, started_ms, ended_ms FROM attempt WHERE trainee = $1 AND status <> 'running' ORDER BY started_ms, "
      "id",
      {trainee});
  if (attempts.empty()) return;
  std::string pseudonym;
  do {
    pseudonym = new_pseudonym();
  } while (find(pseudonym));
  const std::string nobody = new_id(now);
  database_.run("INSERT INTO trainee(id, pseudonym, role, level, created_ms) VALUES ($1, $2, 'trainee', $3, $4)",
                {nobody, pseudonym, std::string(kAnonymous), std::int64_t{0}});
  // The days between attempts stay, when they were does not: a calendar would name somebody.
  const std::int64_t first = integer(attempts[0][1]);
  for (const Row& row : attempts) {
    const std::int64_t began = integer(row[1]) - first;
    const std::string id = new_id(began);
    const Value ended = number(row[2]) ? Value(integer(row[2]) - first) : Value();
    database_.run(
        "INSERT INTO attempt(id, trainee, course, scenario, station, mode, build, stylus, loop_mode, started_ms, "
        "utc_offset_min, ended_ms, status, total, pass_mark, passed, failed_critical, missed_deadlines) "
        "SELECT $1, $2, course, scenario, station, mode, build, stylus, loop_mode, $3, 0, $4, status, total, "
        "pass_mark, passed, failed_critical, missed_deadlines FROM attempt WHERE id = $5",
        {id, nobody, began, ended, text(row[0])});
    database_.run(
        "INSERT INTO attempt_metric(attempt, metric, value, points, most) "
        "SELECT $1, metric, value, points, most FROM attempt_metric WHERE attempt = $2",
        {id, text(row[0])});
    const auto excluded = database_.run(
        "SELECT undone FROM exclusion WHERE attempt = $1 ORDER BY at_ms DESC, id DESC LIMIT 1", {text(row[0])});
    if (excluded.empty() || truth(excluded[0][0]).value_or(false)) continue;
    database_.run("INSERT INTO exclusion(id, attempt, author, at_ms, why, undone) VALUES ($1, $2, '', $3, $4, 0)",
                  {new_id(now), id, began, std::string("excluded before")});
  }
}

}  // namespace stylet::lab::store
