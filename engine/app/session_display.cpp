#include "engine/app/session_display.h"

#include "engine/app/headset_session.h"
#include "engine/app/session_window.h"
#include "engine/app/stylus_watch.h"
#include "haptic/hand_device.h"

#include <fmt/format.h>

#include <span>

namespace stylet::app {

namespace {

/// What is the same wherever it is shown.
struct Shown {
  session::LiveSession& live;
  const content::Scene& scene;
  const SessionParts& parts;
  Observer& observer;
  desktop::Arrangement arrangement;
  bool in_headset = false;
  immersive::PanelLevel panel = immersive::PanelLevel::panel;
};

/// @return false: the headset is not there any more
bool pass_in_headset(Shown& session) {
  const SessionParts& parts = session.parts;
  const char* if_lost = parts.display != nullptr             ? "going on in a window"
                        : parts.stylus.input.hand != nullptr ? "nothing leads the needle: the end"
                                                             : "going on headless";
  if (!parts.graphics.of_headset()) {
    session.observer.note(Note::notice,
                          fmt::format("{} makes no device any more; {}", parts.headset->name(), if_lost));
    return false;
  }
  return show_in_headset(*parts.headset, parts.graphics.device(), session.scene, session.live,
                         {.hand = parts.stylus.input.hand,
                          .stylus = parts.stylus.device.get(),
                          .probe = &parts.probe,
                          .scanner = &session.arrangement.scanner,
                          .course = &parts.course,
                          .images = &parts.link,
                          .pictures = &parts.pictures,
                          .panel = &session.panel,
                          .if_lost = if_lost},
                         session.observer);
}

void pass_in_window(Shown& session, bool stereo) {
  const SessionParts& parts = session.parts;
  show_in_window(*parts.display, parts.graphics.device(), session.scene, session.live,
                 {.stereo = stereo,
                  .mouse = parts.stylus.input.mouse,
                  .stylus = parts.stylus.device.get(),
                  .probe = &parts.probe,
                  .arrangement = &session.arrangement,
                  .course = &parts.course,
                  .images = &parts.link,
                  .pictures = &parts.pictures},
                 session.observer);
}

/// @param drawn  false: there is no device for the link's images
void pass_headless(Shown& session, double duration_s, bool drawn) {
  const SessionParts& parts = session.parts;
  StylusWatch watch(*parts.stylus.device, session.observer);
  while (!session.live.finished() && !session.observer.stop_requested()) {
    watch.look();
    // Who has paused it is not there to go on with it.
    constexpr training::Action kResume = training::Action::resume;
    parts.course.poll(session.live, std::span(&kResume, parts.course.state().paused ? 1U : 0U));
    session.observer.progress(session.live.lockstep() ? "Session in lockstep" : "Session in real time",
                              session.live.time_s() / duration_s);
    if (session.live.lockstep()) {
      session.live.advance(1 / session.scene.rates.simulation_hz);
    } else {
      parts.link.pass_time(drawn ? &parts.graphics.device() : nullptr, parts.course);
    }
  }
}

}  // namespace

void show_to_end(session::LiveSession& live, const content::Scene& scene, const SessionParts& parts, bool stereo,
                 double duration_s, Observer& observer) {
  Shown session{
      live, scene, parts, observer, {.scanner = scanner::ScannerConsole(scene.probe)}, parts.headset != nullptr};
  const bool watched = parts.headset != nullptr || parts.display != nullptr;
  const bool needs_pictures = watched && parts.stylus.held();  // who leads it, begins it and ends it
  while (true) {
    try {
      if (session.in_headset && pass_in_headset(session)) return;
      session.in_headset = false;
      if (parts.display != nullptr) return pass_in_window(session, stereo);
      if (parts.stylus.input.hand != nullptr) return;  // without the headset nobody would end its session
      return pass_headless(session, duration_s, true);
    } catch (const gpu::DeviceLost& lost) {
      observer.task_done();
      parts.pictures.interrupted();
      parts.link.drop_scanner();
      if (parts.stylus.input.hand != nullptr) parts.stylus.input.hand->release();
      if (!parts.graphics.recover(lost, needs_pictures ? "nobody could lead the session any more: the end"
                                        : watched      ? "going on headless"
                                                       : "going on without images"))
        break;
    }
  }
  if (!needs_pictures) pass_headless(session, duration_s, false);
}

}  // namespace stylet::app
