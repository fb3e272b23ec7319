// Whether a JSON schema and the reader of its format know the same keys.
#pragma once

#include "engine/files/json_reader.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <filesystem>
#include <functional>
#include <set>
#include <string>

namespace stylet::readers::test {

/// The sub-schema at a pattern of accepted_keys(): '*' is an array's item or a free name.
inline const nlohmann::json* schema_at(const nlohmann::json& schema, const std::string& pattern) {
  const nlohmann::json* at = &schema;
  for (std::size_t i = 0; i < pattern.size();) {
    const std::size_t end = std::min(pattern.find('/', i + 1), pattern.size());
    const std::string key = pattern.substr(i + 1, end - i - 1);
    const char* kind = key != "*" ? "properties" : at->contains("items") ? "items" : "additionalProperties";
    if (!at->contains(kind) || !(*at)[kind].is_object()) return nullptr;
    at = &(*at)[kind];
    if (key != "*") {
      if (!at->contains(key)) return nullptr;
      at = &(*at)[key];
    }
    i = end;
  }
  return at;
}

/// Every object the reader visits has exactly the keys the schema lists for it, and the other way round.
/// @param at       stands for the file with `text` in messages and for the paths in it
/// @param objects  that the reader visits: all there are
inline void expect_schema_agrees(const std::filesystem::path& schema_path, const std::filesystem::path& at,
                                 const std::string& text, std::size_t objects,
                                 const std::function<void(files::JsonFile&)>& read) {
  const std::string name = schema_path.filename().string();
  const files::JsonFile schema_file(schema_path);
  files::JsonFile file(at, text);
  read(file);
  EXPECT_EQ(file.accepted_keys().size(), objects) << name << ": the example does not visit every object";
  for (const auto& [pattern, keys] : file.accepted_keys()) {
    const nlohmann::json* schema = schema_at(schema_file.tree(), pattern);
    ASSERT_NE(schema, nullptr) << name << " has no " << pattern;
    std::set<std::string> listed;
    if (schema->contains("properties")) {
      for (const auto& [key, value] : (*schema)["properties"].items()) listed.insert(key);
    }
    EXPECT_EQ(listed, keys) << name << pattern;
  }
}

}  // namespace stylet::readers::test
