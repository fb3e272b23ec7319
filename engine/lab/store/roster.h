// Which name has which pseudonym: a file of its own, so that the records by themselves name nobody.
#pragma once

#include "engine/lab/store/database.h"

#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>

namespace stylet::lab::store {

class Roster {
public:
  /// Of a file. @throws files::ContentError
  explicit Roster(const std::filesystem::path& file);
  /// @throws files::ContentError
  explicit Roster(std::unique_ptr<Database> database);

  /// Of a name as it was written. Nothing: nobody has it.
  std::optional<std::string> pseudonym_of(const std::string& name);
  void add(const std::string& name, const std::string& pseudonym, std::int64_t now_ms);
  /// Harmless where there is none.
  void remove(const std::string& pseudonym);
  /// Names by pseudonym.
  std::map<std::string, std::string> names();
  Database& database() { return *database_; }

private:
  std::unique_ptr<Database> database_;
};

}  // namespace stylet::lab::store
