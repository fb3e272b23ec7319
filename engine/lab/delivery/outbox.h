// Statements on their way to a record store: written with the attempt, in its transaction, gone when the store has
// them, also weeks later.
#pragma once

#include "engine/lab/delivery/record_store.h"
#include "engine/lab/store/database.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace stylet::lab::delivery {

struct OutboxState {
  int waiting = 0;
  std::optional<std::int64_t> oldest_ms{};  ///< of those that wait
  int held = 0;                             ///< until those whom they are about agree
  int conflicts = 0;                        ///< the store has another text by their id
  int rejected = 0;                         ///< the store does not take them
  std::string said{};                       ///< by the store, of the last of those two
};
OutboxState outbox_state(store::Database& database);

/// What was set aside waits again. @return how many
int try_again(store::Database& database);
/// Nothing waits any more, and nothing is set aside.
void empty_outbox(store::Database& database);

struct SendSettings {
  std::function<std::int64_t()> clock{};  ///< Unix milliseconds
  std::function<double()> random{};       ///< [0, 1): so that stations do not come back at once
  std::size_t most = 25;                  ///< statements a request
  std::size_t most_bytes = 1'000'000;
  int failures = 0;  ///< in a row before this outbox was made
};

struct Sent {
  int delivered = 0;
  std::string stopped_by{};               ///< what the store said or why it was not there; empty: nothing waits
  std::optional<std::int64_t> next_ms{};  ///< when to try again
  int failures = 0;                       ///< of the store in a row, for who makes an outbox anew each time
};

/// One thread; several processes may send at once: a statement is known by its id, whoever brings it again.
class Outbox {
public:
  Outbox(store::Database& database, RecordStore& store, SendSettings settings);

  /// Sends what waits of those who agree to it now, oldest first, until nothing does or the store is away. A
  /// statement leaves the outbox where the store says that it has it: 200 with its id, or 204; 409, where what the
  /// store has by its id is the same. A batch that is refused (400, 409, 413) is halved until it is known which one
  /// it is. Each time that the store is away the next try is twice as far, 15 minutes at most; an hour where it does
  /// not let us in.
  /// @throws files::ContentError  of the database
  Sent send();

private:
  struct Waiting {
    std::string id{};
    std::string body{};
  };
  std::vector<Waiting> next_batch();
  /// @return false: stop, `sent` says why
  bool deliver(const std::vector<Waiting>& batch, std::size_t from, std::size_t to, Sent& sent);
  /// Whether an answer is the list of ids that xAPI asks for: any web page answers 200.
  static bool names_all(const std::string& body, const std::vector<Waiting>& batch, std::size_t from, std::size_t to);
  bool resolve_conflict(const Waiting& statement, const Answer& conflict, Sent& sent);
  void leave(const std::vector<Waiting>& batch, std::size_t from, std::size_t to, Sent& sent);
  void set_aside(const Waiting& statement, const char* state, const std::string& said);
  bool stop(const Answer& answer, Sent& sent);

  store::Database& database_;
  RecordStore& store_;
  SendSettings settings_;
  int failures_ = 0;  ///< in a row
};

}  // namespace stylet::lab::delivery
