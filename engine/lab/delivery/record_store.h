// A learning record store as the outbox sees it: statements in, an answer out.
#pragma once

#include <optional>
#include <string>

namespace stylet::lab::delivery {

struct Answer {
  int http = 0;        ///< 0: there is none
  std::string body{};  ///< what the store says; without an answer why there is none
  std::optional<int> retry_after_s{};
};

class RecordStore {
public:
  virtual ~RecordStore() = default;
  /// @param statements  a JSON array
  virtual Answer post(const std::string& statements) = 0;
  /// One statement.
  virtual Answer get(const std::string& id) = 0;
};

}  // namespace stylet::lab::delivery
