// What xAPI 2.0 (IEEE 9274.1.1) asks of a statement: its tables, by themselves; a store that is strict refuses what
// is named here.
#pragma once

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace stylet::lab::test {

/// One line a problem, "result.score.scaled: above 1"; none: it is as the standard wants it.
std::vector<std::string> problems_of(const nlohmann::json& statement);

}  // namespace stylet::lab::test
