// What follows a session: its numbers at once, then the debrief, the pictures, the replay of its recording and the
// film, in the window that it ended in or without one. Whatever is written stays, however the rest ends.
#pragma once

#include "engine/app/graphics.h"
#include "engine/app/kept_attempts.h"
#include "engine/app/replay_check.h"
#include "engine/app/run_session.h"
#include "engine/app/session_window.h"
#include "engine/debrief/debrief.h"
#include "engine/debrief/live_footage.h"
#include "engine/files/output_directory.h"

#include <functional>
#include <memory>
#include <string>

namespace stylet::app {

/// A session that is over and whose numbers are in its folder.
struct OverSession {
  const content::Scene& scene;
  const recording::Recording& recording;
  debrief::LiveFootage& footage;
  const figures::ForceTrace& force;
  bool own_motion = false;  ///< the scenario's motion led the needle
  const KeptAttempts& before;
};

/// What the trainee wants after it.
enum class AfterSession : std::uint8_t { leave, again, next };

/// Main thread.
class SessionEnd {
public:
  /// Keeps references to all of them.
  SessionEnd(const SessionSettings& settings, const OverSession& session, SessionResult& result, Graphics& graphics,
             SessionObserver& observer);

  /// Without a window: replays, then draws all that is wanted, then writes the pages of the attempts before. A stop
  /// leaves out what is still to come.
  void finish();

  /// In the window: score, advice and buttons, while the rest goes on; until the trainee wants something else, or the
  /// observer asks for the end. The page is there when it returns, the rest as far as it came.
  /// @param reopen  opens the window again after a device was lost; null: it cannot be
  /// @param next    title of the scenario that comes next; empty: there is none
  AfterSession show(std::unique_ptr<SessionWindow> window, Screen& screen,
                    const std::function<std::unique_ptr<SessionWindow>()>& reopen, const std::string& next);

private:
  void take_replay(const CheckedReplay& replay);
  void draw_piece();
  /// What the background has found out, and what is still under way, for the window.
  void tell(panels::Ending& ending, BackgroundCheck& check);
  std::string open_page() const;
  void debrief_attempts();
  void note_attempts_without_page();
  void note_state();

  const SessionSettings& settings_;
  OverSession session_;
  SessionResult& result_;
  Graphics& graphics_;
  SessionObserver& observer_;
  files::OutputDirectory out_;
  debrief::DebriefWork work_;
};

/// What the window shows of a session that is over. @param result  with its training
panels::Ending ending_of(const SessionResult& result);

}  // namespace stylet::app
