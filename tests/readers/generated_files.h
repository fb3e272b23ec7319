// Whether what is made of the tables of keys, schemas and the tables of content/README.md, is what they make.
#pragma once

#include "engine/files/json_reader.h"
#include "engine/files/key_tables.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <string_view>

namespace stylet::readers::test {

inline constexpr std::string_view kAnew = " is not what the tables of keys make; run `stylet schema --write content`";

inline void expect_in_readme(const std::filesystem::path& content, std::string_view name, std::string_view table) {
  const std::string page = files::read_file(content / "README.md", 4u << 20);
  EXPECT_TRUE(files::with_generated(page, name, table) == page) << "README.md, " << name << kAnew;
}

inline void expect_generated(const std::filesystem::path& content, const files::FileFormat& format) {
  const std::string schema = std::string(format.name) + ".schema.json";
  EXPECT_TRUE(files::read_file(content / "schemas" / schema, 4u << 20) == files::json_schema(format))
      << schema << kAnew;
  expect_in_readme(content, format.name, files::markdown_table(format));
}

}  // namespace stylet::readers::test
