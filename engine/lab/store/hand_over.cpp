// A station gives to its server what it kept. By what refers to what in the schema, so that a new table of an attempt
// or a person goes with them by itself.
#include "engine/files/error.h"
#include "engine/lab/store/identity.h"
#include "engine/lab/store/lab.h"
#include "engine/lab/store/lab_files.h"
#include "engine/lab/store/postgres.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace stylet::lab::store {

namespace {

struct Reference {
  std::string table{};
  std::string column{};
};

/// Of a station's file: who refers to a table.
std::vector<Reference> references_to(Database& file, const std::string& table) {
  std::vector<Reference> all;
  for (const Row& row : file.run("SELECT m.name, f.\"from\" FROM sqlite_schema m, pragma_foreign_key_list(m.name) f "
                                 "WHERE m.type = 'table' AND f.\"table\" = $1 ORDER BY m.name",
                                 {table})) {
    all.push_back({text(row[0]), text(row[1])});
  }
  return all;
}

std::vector<std::string> columns_of(Database& file, const std::string& table) {
  std::vector<std::string> names;
  for (const Row& row : file.run("SELECT name FROM pragma_table_info($1) ORDER BY cid", {table})) {
    names.push_back(text(row[0]));
  }
  return names;
}

std::int64_t count_of(Database& database, const Reference& where, const std::string& key) {
  return integer(
      database.run(fmt::format("SELECT count(*) FROM {} WHERE {} = $1", where.table, where.column), {key})[0][0]);
}

struct Copied {
  std::int64_t rows = 0;  ///< that there were
  bool any_new = false;   ///< to the other database
};

/// Rows of a table with a key, as they are but for some columns; who is there already stays as there.
Copied copy_rows(Database& from, Database& to, const Reference& where, const Value& key,
                 const std::map<std::string, Value>& instead = {}) {
  const std::vector<std::string> columns = columns_of(from, where.table);
  std::vector<std::string> places;
  for (std::size_t i = 0; i < columns.size(); ++i) places.push_back(fmt::format("${}", i + 1));
  const std::string names = fmt::format("{}", fmt::join(columns, ", "));
  const std::string insert = fmt::format("INSERT INTO {}({}) VALUES ({}) ON CONFLICT DO NOTHING RETURNING {}",
                                         where.table, names, fmt::join(places, ", "), columns.front());
  Copied copied;
  for (Row& row : from.run(fmt::format("SELECT {} FROM {} WHERE {} = $1", names, where.table, where.column), {key})) {
    for (std::size_t i = 0; i < columns.size(); ++i) {
      if (const auto found = instead.find(columns[i]); found != instead.end()) row[i] = found->second;
    }
    ++copied.rows;
    copied.any_new = !to.run(insert, row).empty() || copied.any_new;
  }
  return copied;
}

std::string first_text(const std::vector<Row>& rows) {
  return rows.empty() ? std::string() : text(rows[0][0]);
}

std::set<std::string> texts(const std::vector<Row>& rows) {
  std::set<std::string> all;
  for (const Row& row : rows) all.insert(text(row[0]));
  return all;
}

}  // namespace

Person Lab::known(const Person& of_server) {
  const std::int64_t now = settings_.clock();
  if (!of_server.name.empty() && !roster_.names().contains(of_server.pseudonym))
    roster_.add(of_server.name, of_server.pseudonym, now);
  database_.run(
      "INSERT INTO trainee(id, pseudonym, role, level, created_ms) VALUES ($1, $2, 'trainee', '', $3) ON CONFLICT DO "
      "NOTHING",
      {of_server.id, of_server.pseudonym, now});
  Person person = get(of_server.pseudonym);
  person.added = of_server.added;
  return person;
}

Person Lab::enrolled_without_server(const std::string& who) {
  if (find(who) || !looks_like_pseudonym(who)) return enrolled(who);
  const std::int64_t now = settings_.clock();
  return known({.id = new_id(now), .pseudonym = normalized_pseudonym(who), .added = true});
}

std::optional<Person> Lab::of_station(const std::string& id) {
  const auto rows = database_.run(
      "SELECT pseudonym FROM trainee WHERE id = $1 OR id IN (SELECT trainee FROM joined WHERE joined.id = $1)", {id});
  return rows.empty() ? std::nullopt : find(text(rows[0][0]));
}

std::string Lab::joined(Lab& from, const Person& person, HandedOver& done) {
  if (!database_.run("SELECT 1 FROM tombstone WHERE id = $1 AND kind = 'trainee'", {person.id}).empty()) return {};
  std::string id = first_text(database_.run("SELECT trainee FROM joined WHERE id = $1", {person.id}));
  if (id.empty()) id = first_text(database_.run("SELECT id FROM trainee WHERE id = $1", {person.id}));
  if (!id.empty()) return id;
  std::string pseudonym = person.pseudonym;
  if (!person.name.empty()) {
    const auto names = roster_.names();
    const auto of_name = roster_.pseudonym_of(person.name);
    const std::string as_typed = normalized_pseudonym(person.name);
    if (of_name) {
      pseudonym = *of_name;
    } else if (!first_text(database_.run("SELECT id FROM trainee WHERE pseudonym = $1", {as_typed})).empty()) {
      pseudonym = as_typed;  // who gave a pseudonym of letters alone was taken for one of that name
    } else {
      while (names.contains(pseudonym)) pseudonym = new_pseudonym();  // of somebody else, by chance
      roster_.add(person.name, pseudonym, settings_.clock());
    }
  }
  id = first_text(database_.run("SELECT id FROM trainee WHERE pseudonym = $1", {pseudonym}));
  if (id.empty()) {
    copy_rows(from.database_, database_, {"trainee", "id"}, person.id, {{"pseudonym", pseudonym}});
    ++done.people;
    return person.id;
  }
  database_.run("INSERT INTO joined(id, trainee) VALUES ($1, $2)", {person.id, id});
  return id;
}

void Lab::hand_over_person(Lab& server, const Person& person, HandedOver& done) {
  Transaction transaction(server.database_);
  const std::string there = server.joined(*this, person, done);
  if (there.empty()) return;  // erased there this moment; the next time it is known
  for (const Reference& of_person : references_to(database_, "trainee")) {
    if (of_person.table == "attempt" || of_person.table == "joined") continue;
    copy_rows(database_, server.database_, of_person, person.id, {{of_person.column, there}});
  }
  if (server.refuses(there, kRecordStore)) server.take_back_statements(there);
  transaction.commit();
}

void Lab::hand_over_attempt(Lab& server, const Person& person, const std::string& attempt, HandedOver& done) {
  std::vector<std::pair<Reference, std::int64_t>> copied;
  bool erased = false;
  {
    Transaction transaction(server.database_);
    const std::string there = server.joined(*this, person, done);
    if (there.empty()) return;
    erased = !server.database_.run("SELECT 1 FROM tombstone WHERE id = $1 AND kind = 'attempt'", {attempt}).empty();
    if (!erased) {
      for (const Row& row : database_.run(
               "SELECT \"table\", \"from\", \"to\" FROM pragma_foreign_key_list('attempt') WHERE \"table\" <> "
               "'trainee'")) {
        const auto key = database_.run(fmt::format("SELECT {} FROM attempt WHERE id = $1", text(row[1])), {attempt});
        if (key.empty()) return;  // another program hands over too
        copy_rows(database_, server.database_, {text(row[0]), text(row[2])}, key[0][0]);
      }
      const bool is_new =
          copy_rows(database_, server.database_, {"attempt", "id"}, attempt, {{"trainee", there}}).any_new;
      for (const Reference& of_attempt : references_to(database_, "attempt")) {
        if (of_attempt.table == "outbox") continue;
        copied.emplace_back(of_attempt, copy_rows(database_, server.database_, of_attempt, attempt).rows);
      }
      // In its own words, by the pseudonym that the person has there; once, whoever brings the attempt again.
      if (is_new && server.setting(kHomePage).empty()) {
        if (!server.refuses(there, kRecordStore)) {
          copy_rows(database_, server.database_, {"outbox", "attempt"}, attempt);  // until it has a record store
        }
      } else if (is_new) {
        server.tell_beginning(attempt);
        server.tell_end(attempt);
      }
      transaction.commit();
      done.attempts += is_new ? 1 : 0;
    }
  }
  if (erased) remove_recording(recording_of(attempt));
  Transaction transaction(database_);
  // What somebody wrote of it in between goes the next time.
  if (!erased && std::ranges::any_of(copied, [&](const auto& table) {
        return count_of(database_, table.first, attempt) != table.second;
      })) {
    return;
  }
  for (const Reference& of_attempt : references_to(database_, "attempt")) {
    database_.run(fmt::format("DELETE FROM {} WHERE {} = $1", of_attempt.table, of_attempt.column), {attempt});
  }
  database_.run("DELETE FROM attempt WHERE id = $1", {attempt});
  transaction.commit();
}

HandedOver Lab::hand_over(Lab& server) {
  HandedOver done;
  server.forget_erased_names();
  const auto erased = texts(server.database_.run("SELECT id FROM tombstone WHERE kind = 'trainee'"));
  const auto there = texts(server.database_.run("SELECT id FROM trainee UNION SELECT id FROM joined"));
  for (const PersonSummary& summary : people()) {
    const Person& person = summary.person;
    if (erased.contains(person.id)) {
      Erased gone = erase(person);
      done.backups = std::move(gone.backups);
      ++done.erased;
      continue;
    }
    const auto of_person = references_to(database_, "trainee");
    const bool anything = std::ranges::any_of(of_person, [&](const Reference& where) {
      return where.table != "attempt" && where.table != "joined" && count_of(database_, where, person.id) > 0;
    });
    // What the server does not take stays, and holds up nothing else.
    const auto unless_refused = [&](const auto& act) {
      try {
        act();
      } catch (const ServerAway&) {
        throw;
      } catch (const files::ContentError& error) {
        ++done.left;
        done.problem = error.what();
      }
    };
    if (anything || !there.contains(person.id)) {
      unless_refused([&] { hand_over_person(server, person, done); });
    }
    for (const Row& row :
         database_.run("SELECT id FROM attempt WHERE trainee = $1 AND status <> 'running' ORDER BY started_ms, id",
                       {person.id})) {
      unless_refused([&] { hand_over_attempt(server, person, text(row[0]), done); });
    }
  }
  return done;
}

}  // namespace stylet::lab::store
