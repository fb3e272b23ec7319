// A number that keeps others from training by somebody's name at a station: a convenience, no login.
#include "engine/files/error.h"
#include "engine/lab/store/lab.h"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>

namespace stylet::lab::store {

void Lab::set_pin(const std::string& trainee, const std::string& hash) {
  Transaction transaction(database_);
  database_.run("DELETE FROM pin WHERE trainee = $1", {trainee});
  if (!hash.empty()) {
    database_.run("INSERT INTO pin(trainee, hash, wrong, until_ms) VALUES ($1, $2, 0, 0)", {trainee, hash});
  }
  transaction.commit();
}

std::optional<Pin> Lab::pin(const std::string& trainee) {
  const auto rows = database_.run("SELECT hash, wrong, until_ms FROM pin WHERE trainee = $1", {trainee});
  if (rows.empty()) return std::nullopt;
  // Where the clock was set back nobody waits for longer than the longest wait.
  const std::int64_t wait = std::clamp<std::int64_t>(integer(rows[0][2]) - settings_.clock(), 0, kLongestPinWaitMs);
  return Pin{.hash = text(rows[0][0]), .wrong = static_cast<int>(integer(rows[0][1])), .wait_ms = wait};
}

void Lab::pin_tried(const std::string& trainee, bool right) {
  if (right) {
    database_.run("UPDATE pin SET wrong = 0, until_ms = 0 WHERE trainee = $1", {trainee});
    return;
  }
  Transaction transaction(database_);  // two windows at once are two tries
  const std::optional<Pin> before = pin(trainee);
  if (!before) return;
  constexpr int kMostDoublings = 20;
  const std::int64_t wait =
      std::min(kLongestPinWaitMs, std::int64_t{1000} << std::min(before->wrong, kMostDoublings));
  database_.run("UPDATE pin SET wrong = wrong + 1, until_ms = $1 WHERE trainee = $2",
                {settings_.clock() + wait, trainee});
  transaction.commit();
}

}  // namespace stylet::lab::store
