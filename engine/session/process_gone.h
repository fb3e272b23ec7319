// Whether the process that left something on disk still runs.
#pragma once

#include <signal.h>
#include <unistd.h>

#include <cerrno>

namespace stylet::session {

/// No other process of this number runs. What carries this process's own number was left by an earlier one.
inline bool process_is_gone(int process) {
  return process == ::getpid() || (process > 0 && ::kill(process, 0) != 0 && errno == ESRCH);
}

}  // namespace stylet::session
