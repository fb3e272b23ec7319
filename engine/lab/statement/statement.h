// What a learning record store is told of an attempt: xAPI statements (IEEE 9274.1.1, the subset that xAPI 1.0.3 and
// 2.0 share), of verbs and activity types of ADL's vocabulary.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace stylet::lab::statement {

/// Terms of our own: metrics, profile.
inline constexpr std::string_view kVocabulary = "https://w3id.org/stylet/xapi/";

struct AttemptFacts {
  std::string attempt{};  ///< UUID
  std::string pseudonym{};
  std::string scenario{};  ///< name
  std::string scenario_title{};
  std::string scenario_sha256{};
  std::string course{};     ///< name; empty: none
  std::string home_page{};  ///< IRI of the lab, ends in "/": names of people and activities are below it
  std::string mode{};
  std::string build{};
  std::int64_t started_ms = 0;
  // Of one that is over.
  std::int64_t ended_ms = 0;
  std::string status{};  ///< "ended", "aborted", "crashed"
  std::optional<double> total{};
  std::optional<bool> passed{};
  std::vector<std::string> failed_critical{};  ///< metrics
  std::string recording_sha256{};              ///< empty: none
  std::vector<std::pair<std::string, std::optional<double>>> metrics{};
};

struct Statement {
  std::string id{};    ///< the same whenever it is made: name-based on attempt and verb
  std::string body{};  ///< JSON
};

/// "initialized". @param facts  up to started_ms
Statement beginning(const AttemptFacts& facts);
/// Of what ended: "completed", then "passed" or "failed" where it is scored, both with every metric. Of what was
/// broken or cut off: "terminated".
std::vector<Statement> ending(const AttemptFacts& facts);

/// UUID version 5 (RFC 9562). @param space  a UUID
std::string name_based_id(const std::string& space, const std::string& name);
/// "PT142.36S"
std::string duration_text(std::int64_t ms);

}  // namespace stylet::lab::statement
