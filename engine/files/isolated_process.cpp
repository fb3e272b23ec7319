#include "engine/files/isolated_process.h"

#include "engine/files/child_process.h"
#include "engine/files/error.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <optional>
#include <system_error>

namespace stylet::files {
namespace {

constexpr int kNoProgram = 127;  // as a shell says

/// A file in memory, at its beginning; -1 where there is none to be had.
int memory_file(std::span<const std::byte> bytes) {
  const int file = memfd_create("input", MFD_CLOEXEC);
  while (file >= 0 && !bytes.empty()) {
    const ssize_t count = write(file, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) {
      close(file);
      return -1;
    }
    bytes = bytes.subspan(count);
  }
  if (file >= 0) lseek(file, 0, SEEK_SET);
  return file;
}

}  // namespace

IsolatedResult run_isolated(const std::filesystem::path& program, std::span<const std::byte> input,
                            const IsolationLimits& limits) {
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) throw ContentError("no pipe to another process; close some programs");
  const int file = memory_file(input);
  std::optional<ChildProcess> child;
  int problem = file < 0 ? ENOMEM : 0;
  try {
    if (problem == 0) {
      child.emplace(ChildSettings{
          .command = {program.string()},
          .input = file,
          .output = ends[1],
          .limits = ChildLimits{.memory_bytes = limits.memory_bytes, .cpu_seconds = limits.cpu_seconds}});
    }
  } catch (const std::system_error& error) {
    problem = error.code().value();
  }
  close(ends[1]);
  if (file >= 0) close(file);
  if (!child) {
    close(ends[0]);
    if (problem != EAGAIN && problem != ENOMEM) return {.output = {}, .status = kNoProgram};
    throw ContentError("no other process can be started; close some programs");
  }

  IsolatedResult result;
  bool ended = false;
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(limits.wall_seconds);
  std::vector<std::byte> part(1u << 16);
  while (result.output.size() <= limits.output_bytes) {
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    pollfd event{.fd = ends[0], .events = POLLIN, .revents = 0};
    const int ready = ::poll(&event, 1, static_cast<int>(std::max<std::int64_t>(left.count(), 0)));
    if (ready < 0 && errno == EINTR) continue;
    if (ready <= 0) break;
    const ssize_t count = ::read(ends[0], part.data(), part.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) {
      ended = count == 0;
      break;
    }
    result.output.insert(result.output.end(), part.begin(), part.begin() + count);
  }
  close(ends[0]);
  if (!ended) child->kill();
  if (const int status = child->wait(); ended && status < 128) result.status = status;
  return result;
}

}  // namespace stylet::files
