// Ctrl-C, a polite kill, a closed terminal, a file at its limit: work ends in order, nothing half-done stays behind.
#pragma once

namespace stylet::tools {

/// From now on SIGINT, SIGTERM and SIGHUP are remembered instead of deadly; a third one kills as ever. So is the
/// first SIGXFSZ; what was written then fails.
void catch_interrupts();
/// The first three are deadly again: for work that leaves nothing half-done behind.
/// @throws app::Stopped  one has come before
void let_interrupts_kill();
/// One has come since the last clear_interrupt().
bool interrupted();
/// The interrupt was answered: the session ended early, and the rest goes on.
void clear_interrupt();

}  // namespace stylet::tools
