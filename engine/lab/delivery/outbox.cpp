#include "engine/lab/delivery/outbox.h"

#include "engine/lab/store/lab.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <utility>

namespace stylet::lab::delivery {

namespace {

constexpr std::int64_t kFirstWaitMs = 1000;
constexpr std::int64_t kLongestWaitMs = 15 * 60'000;
constexpr std::int64_t kNotLetInMs = 60 * 60'000;
constexpr std::size_t kMostSaid = 2000;  // bytes of an answer that are kept

/// Of a row of the outbox: whom it is about agrees to it now.
std::string agreed() {
  return fmt::format(
      "EXISTS (SELECT 1 FROM attempt a JOIN consent_now c ON c.trainee = a.trainee WHERE a.id = outbox.attempt AND "
      "c.purpose = '{}' AND c.given = 1)",
      store::kRecordStore);
}

/// What a store adds by itself (stored, authority, version, what is absent in ours) is no difference.
bool says_the_same(const nlohmann::json& ours, const nlohmann::json& theirs) {
  if (ours.is_object()) {
    return theirs.is_object() && std::ranges::all_of(ours.items(), [&](const auto& item) {
             const auto there = theirs.find(item.key());
             return there != theirs.end() && says_the_same(item.value(), *there);
           });
  }
  if (ours.is_array()) {
    return theirs.is_array() && std::ranges::equal(ours, theirs, says_the_same);
  }
  return ours == theirs;
}

std::string shortened(const std::string& text) {
  return text.substr(0, kMostSaid);
}

}  // namespace

OutboxState outbox_state(store::Database& database) {
  OutboxState state;
  for (const store::Row& row :
       database.run(fmt::format("SELECT CASE WHEN state = 'waiting' AND NOT {} THEN 'held' ELSE state END, count(*), "
                                "min(created_ms) FROM outbox GROUP BY 1 ORDER BY 1",
                                agreed()))) {
    const std::string name = store::text(row[0]);
    const int count = static_cast<int>(store::integer(row[1]));
    if (name == "waiting") {
      state.waiting = count;
      state.oldest_ms = store::integer(row[2]);
    }
    if (name == "held") state.held = count;
    if (name == "conflict") state.conflicts = count;
    if (name == "rejected") state.rejected = count;
  }
  const auto said =
      database.run("SELECT said FROM outbox WHERE state <> 'waiting' ORDER BY created_ms DESC, seq DESC LIMIT 1");
  if (!said.empty()) state.said = store::text(said[0][0]);
  return state;
}

int try_again(store::Database& database) {
  return static_cast<int>(
      database.run("UPDATE outbox SET state = 'waiting', said = '' WHERE state <> 'waiting' RETURNING statement")
          .size());
}

void empty_outbox(store::Database& database) {
  database.run("DELETE FROM outbox");
}

Outbox::Outbox(store::Database& database, RecordStore& store, SendSettings settings)
    : database_(database), store_(store), settings_(std::move(settings)), failures_(settings_.failures) {}

std::vector<Outbox::Waiting> Outbox::next_batch() {
  std::vector<Waiting> batch;
  std::size_t bytes = 2;
  for (const store::Row& row :
       database_.run(fmt::format("SELECT statement, body FROM outbox WHERE state = 'waiting' AND {} ORDER BY "
                                 "created_ms, seq, statement LIMIT $1",
                                 agreed()),
                     {static_cast<std::int64_t>(settings_.most)})) {
    Waiting waiting{.id = store::text(row[0]), .body = store::text(row[1])};
    bytes += waiting.body.size() + 1;
    if (!batch.empty() && bytes > settings_.most_bytes) break;
    batch.push_back(std::move(waiting));
  }
  return batch;
}

void Outbox::leave(const std::vector<Waiting>& batch, std::size_t from, std::size_t to, Sent& sent) {
  store::Transaction transaction(database_);
  for (std::size_t i = from; i < to; ++i) {
    database_.run("DELETE FROM outbox WHERE statement = $1", {batch[i].id});
  }
  transaction.commit();
  sent.delivered += static_cast<int>(to - from);
}

void Outbox::set_aside(const Waiting& statement, const char* state, const std::string& said) {
  database_.run("UPDATE outbox SET state = $1, said = $2 WHERE statement = $3",
                {std::string(state), shortened(said), statement.id});
}

bool Outbox::stop(const Answer& answer, Sent& sent) {
  const bool not_let_in =
      answer.http == 401 || answer.http == 403 || answer.http == 404 || (answer.http >= 300 && answer.http < 400);
  sent.stopped_by = answer.http == 0 ? shortened(answer.body)
                                     : fmt::format("it answers {}{}{}", answer.http, answer.body.empty() ? "" : ": ",
                                                   shortened(answer.body));
  std::int64_t wait_ms = kNotLetInMs;
  if (!not_let_in) {
    const std::int64_t doubled = kFirstWaitMs << std::min(failures_, 20);
    ++failures_;
    // Between half of it and all of it.
    wait_ms = static_cast<std::int64_t>(static_cast<double>(std::min(doubled, kLongestWaitMs)) *
                                        (0.5 + 0.5 * settings_.random()));
    if (answer.retry_after_s) wait_ms = std::max(wait_ms, std::int64_t{*answer.retry_after_s} * 1000);
  }
  sent.next_ms = settings_.clock() + wait_ms;
  return false;
}

bool Outbox::resolve_conflict(const Waiting& statement, const Answer& conflict, Sent& sent) {
  const Answer there = store_.get(statement.id);
  if (there.http != 200) {
    if (there.http == 404) {
      set_aside(statement, "conflict", conflict.body);
      return true;
    }
    return stop(there, sent);
  }
  const auto ours = nlohmann::json::parse(statement.body, nullptr, false);
  const auto theirs = nlohmann::json::parse(there.body, nullptr, false);
  if (says_the_same(ours, theirs)) {
    leave({statement}, 0, 1, sent);
  } else {
    set_aside(statement, "conflict", conflict.body);
  }
  return true;
}

bool Outbox::names_all(const std::string& body, const std::vector<Waiting>& batch, std::size_t from, std::size_t to) {
  const auto ids = nlohmann::json::parse(body, nullptr, false);
  if (!ids.is_array()) return false;
  return std::all_of(
      batch.begin() + static_cast<std::ptrdiff_t>(from), batch.begin() + static_cast<std::ptrdiff_t>(to),
      [&](const Waiting& each) { return std::ranges::find(ids, nlohmann::json(each.id)) != ids.end(); });
}

bool Outbox::deliver(const std::vector<Waiting>& batch, std::size_t from, std::size_t to, Sent& sent) {
  std::string body = "[";
  for (std::size_t i = from; i < to; ++i) body += (i > from ? "," : "") + batch[i].body;
  const Answer answer = store_.post(body + "]");
  if (answer.http == 200 && !names_all(answer.body, batch, from, to)) {
    return stop({.http = 200, .body = "but names none of the statements as kept: is it a record store?"}, sent);
  }
  if (answer.http == 200 || answer.http == 204) {
    failures_ = 0;
    leave(batch, from, to, sent);
    return true;
  }
  if (answer.http != 400 && answer.http != 409 && answer.http != 413) return stop(answer, sent);
  failures_ = 0;  // it is there
  if (to - from > 1) {
    const std::size_t middle = from + (to - from) / 2;
    return deliver(batch, from, middle, sent) && deliver(batch, middle, to, sent);
  }
  if (answer.http == 409) return resolve_conflict(batch[from], answer, sent);
  set_aside(batch[from], "rejected", fmt::format("{}: {}", answer.http, answer.body));
  return true;
}

Sent Outbox::send() {
  Sent sent;
  while (true) {
    const std::vector<Waiting> batch = next_batch();
    if (batch.empty() || !deliver(batch, 0, batch.size(), sent)) {
      sent.failures = failures_;
      return sent;
    }
  }
}

}  // namespace stylet::lab::delivery
