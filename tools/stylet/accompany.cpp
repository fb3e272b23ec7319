#include "tools/stylet/accompany.h"

#include "haptic/hand_device.h"
#include "tools/stylet/headset_session.h"
#include "tools/stylet/hid_device.h"
#include "tools/stylet/interrupt.h"
#include "tools/stylet/session_window.h"

#include <fmt/format.h>

#include <span>

namespace stylet::tools {

namespace {

/// What is the same whoever looks on.
struct Attended {
  session::LiveSession& live;
  const content::Scene& scene;
  const Company& with;
  desktop::Arrangement arrangement;
  bool in_headset = false;
  immersive::PanelLevel panel = immersive::PanelLevel::panel;
};

/// @return false: the headset is not there any more
bool pass_in_headset(Attended& session) {
  const Company& with = session.with;
  const char* if_lost = with.display != nullptr       ? "going on in a window"
                        : with.stylus.hand != nullptr ? "nothing leads the needle: the end"
                                                      : "going on headless";
  if (!with.graphics.of_headset()) {
    fmt::print(stderr, "stylet: {} makes no device any more; {}\n", with.headset->name(), if_lost);
    return false;
  }
  return show_in_headset(*with.headset, with.graphics.device(), session.scene, session.live,
                         {.hand = with.stylus.hand,
                          .hid = with.stylus.hid,
                          .probe = &with.probe,
                          .scanner = &session.arrangement.scanner,
                          .course = &with.course,
                          .images = &with.link,
                          .panel = &session.panel,
                          .if_lost = if_lost});
}

void pass_in_window(Attended& session, bool stereo) {
  const Company& with = session.with;
  show_session(*with.display, with.graphics.device(), session.scene, session.live,
               {.stereo = stereo,
                .mouse = with.stylus.mouse,
                .hid = with.stylus.hid,
                .device = with.stylus.device->name(),
                .probe = &with.probe,
                .arrangement = &session.arrangement,
                .course = &with.course,
                .images = &with.link});
}

/// @param drawn  false: there is no device for the link's images
void pass_headless(Attended& session, double duration_s, Progress& progress, bool drawn) {
  const Company& with = session.with;
  StylusWatch watch(with.stylus.hid);
  while (!session.live.finished() && !interrupted()) {
    watch.look();
    // Who has paused it is not there to go on with it.
    constexpr training::Action kResume = training::Action::resume;
    with.course.poll(session.live, std::span(&kResume, with.course.state().paused ? 1U : 0U));
    progress.show(session.live.lockstep() ? "Session in lockstep" : "Session in real time",
                  session.live.time_s() / duration_s);
    if (session.live.lockstep()) {
      session.live.advance(1 / session.scene.rates.simulation_hz);
    } else {
      with.link.pass_time(drawn ? &with.graphics.device() : nullptr, with.course);
    }
  }
}

}  // namespace

void accompany(session::LiveSession& live, const content::Scene& scene, const Company& with, bool stereo,
               double duration_s, Progress& progress) {
  Attended session{live, scene, with, {.scanner = scanner::ScannerConsole(scene.probe)}, with.headset != nullptr};
  const bool watched = with.headset != nullptr || with.display != nullptr;
  const bool needs_pictures = watched && with.stylus.held();  // who leads it, begins it and ends it
  while (true) {
    try {
      if (session.in_headset && pass_in_headset(session)) return;
      session.in_headset = false;
      if (with.display != nullptr) return pass_in_window(session, stereo);
      if (with.stylus.hand != nullptr) return;  // without the headset nobody would end its session
      return pass_headless(session, duration_s, progress, true);
    } catch (const gpu::DeviceLost& lost) {
      progress.done();
      with.link.drop_scanner();
      if (with.stylus.hand != nullptr) with.stylus.hand->release();
      if (!with.graphics.recover(lost, needs_pictures ? "nobody could lead the session any more: the end"
                                       : watched      ? "going on headless"
                                                      : "going on without images"))
        break;
    }
  }
  if (!needs_pictures) pass_headless(session, duration_s, progress, false);
}

}  // namespace stylet::tools
