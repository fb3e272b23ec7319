#include "engine/files/isolated_process.h"

#include "engine/files/error.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdint>

namespace stylet::files {
namespace {

void limit(decltype(RLIMIT_AS) resource, std::size_t value) {
  const rlimit limit{.rlim_cur = value, .rlim_max = value};
  setrlimit(resource, &limit);
}

/// In the child: becomes the program. Only what may be called between fork() and exec() of a process with threads.
[[noreturn]] void become(const char* program, int input, int output, const IsolationLimits& limits) {
  // First out of the way of the two numbers they go to.
  const int from = fcntl(input, F_DUPFD, 10);
  const int to = fcntl(output, F_DUPFD, 10);
  dup2(from, 0);
  dup2(to, 1);
  close(2);
  close_range(3, ~0U, 0);
#ifndef STYLET_SANITIZED
  limit(RLIMIT_AS, limits.memory_bytes);
#endif
  limit(RLIMIT_CPU, static_cast<std::size_t>(limits.cpu_seconds));
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_FSIZE, 0);
  char* arguments[] = {const_cast<char*>(program), nullptr};
  char* environment[] = {nullptr};
  execve(program, arguments, environment);
  _exit(127);
}

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
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
  if (file >= 0) lseek(file, 0, SEEK_SET);
  return file;
}

}  // namespace

IsolatedResult run_isolated(const std::filesystem::path& program, std::span<const std::byte> input,
                            const IsolationLimits& limits) {
  const std::string name = program.string();
  std::array<int, 2> ends{};
  if (pipe2(ends.data(), O_CLOEXEC) != 0) throw ContentError("no pipe to another process; close some programs");
  const int file = memory_file(input);
  const pid_t child = file < 0 ? -1 : fork();
  if (child == 0) become(name.c_str(), file, ends[1], limits);
  close(ends[1]);
  if (file >= 0) close(file);
  if (child < 0) {
    close(ends[0]);
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
  if (!ended) kill(child, SIGKILL);
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) continue;
  if (ended && WIFEXITED(status)) result.status = WEXITSTATUS(status);
  return result;
}

}  // namespace stylet::files
