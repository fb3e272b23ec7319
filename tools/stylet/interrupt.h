// Ctrl-C and a polite kill: work ends in order, nothing half-done stays behind.
#pragma once

#include <exception>

namespace stylet::tools {

/// Thrown by throw_if_interrupted(); main() ends with kExitInterrupted.
class Interrupted final : public std::exception {
public:
  const char* what() const noexcept override { return "interrupted; what was not finished was removed"; }
};

/// From now on SIGINT and SIGTERM are remembered instead of deadly; a third one kills as ever.
void catch_interrupts();
/// They are deadly again: for work that leaves nothing half-done behind.
void let_interrupts_kill();
/// One has come since the last clear_interrupt().
bool interrupted();
/// The interrupt was answered: the session ended early, and the rest goes on.
void clear_interrupt();
void throw_if_interrupted();

}  // namespace stylet::tools
