// The command as a user runs it: a process, its exit code, what it says, its files.
#pragma once

#include "tests/support/shell.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <string>

namespace stylet {

namespace fs = std::filesystem;

struct Outcome {
  int exit_code = -1;
  std::string output;  // stdout and stderr
  std::ptrdiff_t lines() const { return std::count(output.begin(), output.end(), '\n'); }
};

/// Sound goes nowhere, unless the test says where; leaks are looked for where the process is ours alone: the Vulkan
/// driver keeps memory until the end.
inline constexpr const char* kTestEnvironment = "ALSOFT_DRIVERS=${ALSOFT_DRIVERS:-null} ASAN_OPTIONS=detect_leaks=0";

inline Outcome run(const std::string& arguments, const fs::path& binary = STYLET_COMMAND) {
  const auto [exit_code, output] =
      support::run_in_shell(fmt::format("{} '{}' {} 2>&1 </dev/null", kTestEnvironment, binary.string(), arguments));
  // Where the tests ask for the validation layers, the passes of whole sessions answer to them.
  EXPECT_EQ(output.find("Vulkan validation"), std::string::npos) << arguments << '\n' << output;
  return {exit_code, output};
}

inline std::string read_text(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

/// Relative to the folder.
inline std::set<std::string> files_below(const fs::path& folder) {
  std::set<std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) files.insert(fs::relative(entry.path(), folder).string());
  }
  return files;
}

}  // namespace stylet
