// Who trains, asked before a session.
#pragma once

#include "engine/app/observer.h"
#include "engine/app/run_session.h"
#include "engine/app/screen.h"
#include "engine/content/texts.h"
#include "engine/panels/trainee_choice.h"

namespace stylet::app {

/// In a window that is open. Main thread. @return false: who was asked went back, or the observer asks for the end
bool chosen_in_window(Screen& screen, panels::TraineeChoice& choice, const content::Texts& texts, Observer& observer);

/// In the headset of a session that wants one, where there is one; else in a window of its own. Of the records that
/// the settings name; where nobody is in them nothing is asked. Main thread.
/// @param settings  gets the name
/// @return false: who was asked went back, or the observer asks for the end
/// @throws files::ContentError  also where there is nothing to ask in; gpu::GpuError
bool ask_trainee(SessionSettings& settings, Observer& observer);

}  // namespace stylet::app
