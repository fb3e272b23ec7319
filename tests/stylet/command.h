// The command as a user runs it: a process, its exit code, what it says, its files.
#pragma once

#include <sys/wait.h>

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdio>
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

inline Outcome run(const std::string& arguments, const fs::path& binary = STYLET_COMMAND) {
  // Leaks are looked for where the process is ours alone; the Vulkan driver keeps memory until the end.
  const std::string command =
      fmt::format("ASAN_OPTIONS=detect_leaks=0 '{}' {} 2>&1 </dev/null", binary.string(), arguments);
  Outcome outcome;
  FILE* pipe = ::popen(command.c_str(), "r");
  if (pipe == nullptr) return outcome;
  std::array<char, 4096> buffer{};
  while (const std::size_t n = std::fread(buffer.data(), 1, buffer.size(), pipe))
    outcome.output.append(buffer.data(), n);
  const int status = ::pclose(pipe);
  outcome.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : 128;
  // Where the tests ask for the validation layers, the passes of whole sessions answer to them.
  EXPECT_EQ(outcome.output.find("Vulkan validation"), std::string::npos) << arguments << '\n' << outcome.output;
  return outcome;
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
