// The tables, by the versions that they have had: numbered steps forward, never back.
#pragma once

#include "engine/lab/store/database.h"

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace stylet::lab::store {

/// From the version before to `version`.
struct Migration {
  int version = 0;
  std::vector<std::string_view> statements{};  ///< in the words of Database::in_its_words
};

/// Those of this program.
std::span<const Migration> migrations();

/// 0: an empty database.
int schema_version(Database& database);

/// Takes the database to the newest version, each step all or nothing. Harmless where it is there already, also while
/// another program does the same.
/// @throws files::ContentError  it is of a newer program
void migrate(Database& database, std::span<const Migration> steps, std::int64_t now_ms, const std::string& build);

}  // namespace stylet::lab::store
