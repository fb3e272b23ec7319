// What `stylet` shows on a desktop where nobody has said what it is to do: a menu, and the sessions chosen in it.
#pragma once

#include "engine/app/run_session.h"

#include <functional>

namespace stylet::app {

/// Shows the menu, runs what is chosen, and shows the menu again, until the user leaves it or the observer asks for
/// the end. What keeps a session from starting is told in the menu. Where the lab's records (those of
/// lab::store::default_lab_folder()) have names, who trains is asked before each. Main thread.
/// @param done  after every session
/// @throws gpu::GpuError  there is no window; files::ContentError  no scenario
void run_from_menu(const SessionSettings& settings, SessionObserver& observer,
                   const std::function<void(const SessionSettings&, const SessionResult&)>& done);

}  // namespace stylet::app
