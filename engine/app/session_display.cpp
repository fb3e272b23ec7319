#include "engine/app/session_display.h"

#include "engine/app/headset_session.h"
#include "engine/app/stylus_watch.h"
#include "haptic/hand_device.h"

#include <fmt/format.h>

#include <optional>
#include <span>
#include <utility>

namespace stylet::app {

namespace {

/// What is the same wherever it is shown.
struct Shown {
  session::LiveSession& live;
  const content::Scene& scene;
  const SessionParts& parts;
  Observer& observer;
  scanner::ScannerConsole scanner;
  bool in_headset = false;
  immersive::PanelLevel panel = immersive::PanelLevel::panel;
};

/// @return false: the headset is not there any more
bool pass_in_headset(Shown& session) {
  const SessionParts& parts = session.parts;
  const char* if_lost = parts.screen != nullptr              ? "going on in a window"
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
                          .probe_device = parts.probe_device,
                          .probe = &parts.probe,
                          .breath = parts.breath,
                          .scanner = &session.scanner,
                          .course = &parts.course,
                          .images = &parts.link,
                          .pictures = &parts.pictures,
                          .panel = &session.panel,
                          .punctures = &parts.punctures,
                          .sound = parts.sound,
                          .left_handed = parts.left_handed,
                          .if_lost = if_lost},
                         session.observer);
}

/// @param drawn  false: there is no device for the link's images
void pass_headless(Shown& session, double duration_s, bool drawn) {
  const SessionParts& parts = session.parts;
  StylusWatch watch(*parts.stylus.device, session.observer);
  std::optional<StylusWatch> other_hand;
  if (parts.probe_device != nullptr) other_hand.emplace(*parts.probe_device, session.observer, "probe");
  while (!session.live.finished() && !session.observer.stop_requested()) {
    watch.look();
    if (other_hand) other_hand->look();
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

std::unique_ptr<SessionWindow> open_session_window(session::LiveSession& live, const content::Scene& scene,
                                                   const SessionParts& parts, bool stereo) {
  return std::make_unique<SessionWindow>(*parts.screen, parts.graphics.device(), scene, live,
                                         SessionWindowSettings{.stereo = stereo,
                                                               .mouse = parts.stylus.input.mouse,
                                                               .stylus = parts.stylus.device.get(),
                                                               .probe_device = parts.probe_device,
                                                               .probe = &parts.probe,
                                                               .breath = parts.breath,
                                                               .breath_button = button_words(parts.stylus),
                                                               .course = &parts.course,
                                                               .images = &parts.link,
                                                               .pictures = &parts.pictures,
                                                               .sound = parts.sound,
                                                               .saved = &parts.saved});
}

SessionShown show_to_end(session::LiveSession& live, const content::Scene& scene, const SessionParts& parts,
                         bool stereo, double duration_s, Observer& observer) {
  const scanner::ScannerConsole console =
      parts.screen != nullptr ? parts.screen->arrangement.scanner : scanner::ScannerConsole(scene.probe);
  Shown session{live, scene, parts, observer, console, parts.headset != nullptr};
  std::unique_ptr<SessionWindow> window;
  const bool watched = parts.headset != nullptr || parts.screen != nullptr;
  const bool needs_pictures = watched && parts.stylus.held();  // who leads it, begins it and ends it
  while (true) {
    try {
      if (session.in_headset && pass_in_headset(session)) return {.could_finish = false};
      if (session.in_headset && parts.screen != nullptr) parts.screen->arrangement.scanner = session.scanner;
      session.in_headset = false;
      if (parts.screen != nullptr) {
        window = open_session_window(live, scene, parts, stereo);
        if (!window->run(observer)) window.reset();
        return {.window = std::move(window)};
      }
      if (parts.stylus.input.hand != nullptr) return {};  // without the headset nobody would end its session
      pass_headless(session, duration_s, true);
      return {.could_finish = false};
    } catch (const gpu::DeviceLost& lost) {
      observer.task_done();
      parts.pictures.interrupted();
      window.reset();
      if (parts.screen != nullptr) parts.screen->close();
      parts.link.drop_scanner();
      if (parts.stylus.input.hand != nullptr) parts.stylus.input.hand->release();
      if (!parts.graphics.recover(lost, needs_pictures ? "nobody could lead the session any more: the end"
                                        : watched      ? "going on headless"
                                                       : "going on without images"))
        break;
    }
  }
  if (!needs_pictures) pass_headless(session, duration_s, false);
  return {.could_finish = needs_pictures};
}

}  // namespace stylet::app
