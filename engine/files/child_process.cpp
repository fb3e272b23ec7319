#include "engine/files/child_process.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <system_error>

namespace stylet::files {
namespace {

constexpr int kStreams = 3;
constexpr int kOutOfTheWay = 10;  // of the numbers that the streams go to

void limit(decltype(RLIMIT_AS) resource, std::size_t value) {
  const rlimit limit{.rlim_cur = value, .rlim_max = value};
  setrlimit(resource, &limit);
}

void impose(const ChildLimits& limits) {
#ifndef STYLET_SANITIZED
  limit(RLIMIT_AS, limits.memory_bytes);
#endif
  limit(RLIMIT_CPU, static_cast<std::size_t>(limits.cpu_seconds));
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_FSIZE, 0);
}

/// In the child: becomes the program, or tells `failure` why not. Only what may be called between fork() and exec()
/// of a process with threads.
[[noreturn]] void become(char* const* arguments, const ChildSettings& settings, int failure) {
  const int nothing = open("/dev/null", O_RDWR | O_CLOEXEC);
  std::array<int, kStreams> streams{settings.input, settings.output, settings.messages};
  for (int& stream : streams) stream = fcntl(stream < 0 ? nothing : stream, F_DUPFD, kOutOfTheWay);
  failure = fcntl(failure, F_DUPFD, kOutOfTheWay);
  for (int k = 0; k < kStreams; ++k) dup2(streams[k], k);
  if (settings.limits && settings.messages < 0) close(STDERR_FILENO);
  close_range(kStreams, ~0U, CLOSE_RANGE_CLOEXEC);
  char* no_environment[] = {nullptr};
  if (settings.limits) impose(*settings.limits);
  execvpe(arguments[0], arguments, settings.limits ? no_environment : environ);
  const int reason = errno;
  // A broken pipe leaves nobody to tell.
  [[maybe_unused]] const ssize_t written = write(failure, &reason, sizeof reason);
  _exit(127);
}

int status_of(int status) {
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

}  // namespace

ChildProcess::ChildProcess(const ChildSettings& settings) {
  const std::string& name = settings.command.front();
  std::vector<char*> arguments;
  arguments.reserve(settings.command.size() + 1);
  for (const std::string& word : settings.command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  std::array<int, 2> failure{};
  if (pipe2(failure.data(), O_CLOEXEC) != 0) throw std::system_error(errno, std::generic_category(), name);
  id_ = fork();
  if (id_ == 0) become(arguments.data(), settings, failure[1]);
  int reason = id_ < 0 ? errno : 0;
  close(failure[1]);
  // Ends without a word where the program has begun.
  while (id_ > 0 && read(failure[0], &reason, sizeof reason) < 0 && errno == EINTR) continue;
  close(failure[0]);
  if (reason == 0) return;
  wait();
  throw std::system_error(reason, std::generic_category(), name);
}

ChildProcess::~ChildProcess() {
  kill();
}

int ChildProcess::wait() {
  int status = 0;
  while (id_ > 0 && waitpid(id_, &status, 0) < 0 && errno == EINTR) continue;
  if (id_ > 0) status_ = status_of(status);
  id_ = -1;
  return status_;
}

std::optional<int> ChildProcess::ended() {
  int status = 0;
  if (id_ > 0) {
    const pid_t done = waitpid(id_, &status, WNOHANG);
    if (done == 0 || (done < 0 && errno == EINTR)) return std::nullopt;
    status_ = status_of(status);
    id_ = -1;
  }
  return status_;
}

void ChildProcess::kill() {
  if (id_ > 0) ::kill(id_, SIGKILL);
  wait();
}

}  // namespace stylet::files
