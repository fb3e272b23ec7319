// The command under way: what it prints is read as it comes, and it can be interrupted.
#pragma once

#include "tests/stylet/command.h"

#include <sys/wait.h>

#include <array>
#include <charconv>
#include <csignal>
#include <cstdio>

namespace stylet {

class RunningCommand {
public:
  explicit RunningCommand(const std::string& arguments)
      : pipe_(::popen(fmt::format("export {}; echo $$; exec setpriv --pdeathsig KILL '{}' {} 2>&1 </dev/null",
                                  kTestEnvironment, STYLET_COMMAND, arguments)
                          .c_str(),
                      "r")) {
    if (read_line()) std::from_chars(line_.data(), line_.data() + line_.size(), process_);
    output_.clear();
  }
  /// Left by a test that failed, it is not waited for.
  ~RunningCommand() { kill(); }
  RunningCommand(const RunningCommand&) = delete;
  RunningCommand& operator=(const RunningCommand&) = delete;

  /// The rest of the line after `words`, once it is printed; empty: it never was.
  std::string wait_for(const std::string& words) {
    while (read_line()) {
      const std::size_t found = line_.find(words);
      if (found != std::string::npos) return line_.substr(found + words.size());
    }
    return {};
  }
  /// Ctrl-C: a session ends early and is debriefed.
  void interrupt() const {
    ASSERT_GT(process_, 0);
    ::kill(process_, SIGINT);
  }
  /// Outright, and nothing of it is left when this returns.
  void kill() {
    if (pipe_ != nullptr && process_ > 0) ::kill(process_, SIGKILL);
    end();
  }
  /// @return exit code
  int end() {
    if (pipe_ == nullptr) return -1;
    while (read_line()) {
    }
    const int status = ::pclose(pipe_);
    pipe_ = nullptr;
    return WIFEXITED(status) ? WEXITSTATUS(status) : 128;
  }
  const std::string& output() const { return output_; }

private:
  bool read_line() {
    std::array<char, 4096> buffer{};
    if (std::fgets(buffer.data(), buffer.size(), pipe_) == nullptr) return false;
    line_ = buffer.data();
    output_ += line_;
    return true;
  }

  FILE* pipe_;
  pid_t process_ = 0;
  std::string line_;
  std::string output_;
};

}  // namespace stylet
