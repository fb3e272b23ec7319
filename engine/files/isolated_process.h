// Another program, run on input that is not trusted, which can harm nobody but itself.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <vector>

namespace stylet::files {

/// What the program may use.
struct IsolationLimits {
  std::size_t output_bytes = 0;
  std::size_t memory_bytes = 768u << 20;  ///< not where sanitizers map terabytes
  int cpu_seconds = 2;
  int wall_seconds = 10;  ///< a loaded machine may be slow
};

struct IsolatedResult {
  std::vector<std::byte> output;
  int status = -1;  ///< what the program returned; -1: it crashed, or went beyond the limits
};

/// Runs `program` without arguments and waits: `input` is its standard input, its standard output comes back; of this
/// process it inherits nothing else, no open file and no variable of the environment.
/// For load time. @throws ContentError where the system cannot start a process
IsolatedResult run_isolated(const std::filesystem::path& program, std::span<const std::byte> input,
                            const IsolationLimits& limits);

}  // namespace stylet::files
