#include "engine/app/headset_session.h"

#include "engine/app/stylus_watch.h"
#include "engine/headset/headset.h"
#include "engine/immersive/hands_on_patient.h"
#include "engine/immersive/immersive_view.h"
#include "engine/immersive/thumb_on_scanner.h"
#include "engine/immersive/trainee_panel.h"
#include "engine/panels/breath_watch.h"
#include "engine/panels/session_watch.h"
#include "engine/scanner/live_scanner.h"
#include "engine/session/frame_publisher.h"

#include <fmt/format.h>

#include <chrono>
#include <cstdint>
#include <optional>
#include <span>
#include <thread>

namespace stylet::app {

namespace {

constexpr auto kIdle = std::chrono::milliseconds(10);  // between looks while the runtime wants no frames

/// What the menu button does.
training::Action menu_action(const training::FlowState& course) {
  if (course.stage == training::Stage::briefing) return training::Action::start;
  return course.paused ? training::Action::resume : training::Action::pause;
}

}  // namespace

std::unique_ptr<headset::HeadsetRuntime> find_headset(const char* instead, Observer& observer) {
  try {
    return std::make_unique<headset::HeadsetRuntime>();
  } catch (const headset::HeadsetError& error) {
    observer.note(Note::notice, fmt::format("--view headset: {}; going on {}", error.what(), instead));
    return nullptr;
  }
}

namespace {

headset::HeadsetSettings place_in(const content::Scene& scene, bool left_handed) {
  return {.room_from_standing = immersive::standing_place(scene),
          .room_from_floor = immersive::floor_place(scene),
          .left_handed = left_handed};
}

/// As show_in_headset(), of a headset that is there.
bool run_in_headset(headset::Headset& headset, gpu::Device& device, const content::Scene& scene,
                    session::LiveSession& session, scanner::LiveScanner& scanner,
                    const HeadsetSessionSettings& settings, Observer& observer) {
  immersive::ImmersiveView view(device, scene);
  immersive::SessionPanel panel(device, settings.left_handed, settings.breath != nullptr);
  std::optional<panels::BreathWatch> breath;
  if (settings.breath != nullptr) breath.emplace(*settings.breath);
  panels::SessionWatch session_watch(scene);
  immersive::ThumbOnScanner knobs;
  immersive::HandsOnPatient hands(scene, settings.hand, settings.probe);
  state::FrameState state = session.frames().make_frame();
  // One simulation period behind the newest state there is always a later one to interpolate to.
  const double delay_s = 1.5 / scene.rates.simulation_hz;
  StylusWatch watch(*settings.stylus, observer);
  std::optional<StylusWatch> other_hand;
  if (settings.probe_device != nullptr) other_hand.emplace(*settings.probe_device, observer, "probe");
  std::uint32_t recoils = settings.course != nullptr ? settings.course->recoils() : 0;
  while (!session.finished() && !observer.stop_requested()) {
    watch.look();
    if (other_hand) other_hand->look();
    scanner.poll(session.time_s());  // clients turn its knobs whether or not somebody looks on
    const headset::HeadsetPhase phase = headset.poll();
    if (phase == headset::HeadsetPhase::ended) return true;
    if (phase == headset::HeadsetPhase::lost) {
      observer.note(Note::notice, fmt::format("{}; {}", headset.reason(), settings.if_lost));
      return false;
    }
    const std::optional<headset::HeadsetFrame> frame = headset.begin_frame();
    if (!frame) {
      std::this_thread::sleep_for(kIdle);
      continue;
    }
    session.advance(session::kLockstepFrame);
    hands.move(frame->hands, session.time_s());
    if (settings.course != nullptr) {
      const training::Action menu = menu_action(settings.course->state());
      const training::FlowState& state_of_course =
          settings.course->poll(session, std::span(&menu, frame->hands.menu_pressed ? 1U : 0U));
      if (state_of_course.stage == training::Stage::debrief || settings.course->reset_asked_for()) {
        headset.end_frame(nullptr);
        return true;
      }
      if (settings.sound != nullptr) settings.sound->follow(session, *settings.course);
    }
    if (const std::uint32_t now = settings.course != nullptr ? settings.course->recoils() : 0; now != recoils) {
      recoils = now;
      headset.vibrate(immersive::kRecoil);
    }
    if (breath) {
      if (frame->hands.breath_pressed) breath->ask();
      breath->look(session);
    }
    if (settings.punctures != nullptr) {
      if (const auto puncture = settings.punctures->take()) headset.vibrate(immersive::vibration_of(*puncture));
    }
    if (frame->hands.panel_pressed) *settings.panel = next(*settings.panel);
    if (!frame->draw) {
      headset.end_frame(nullptr);
      continue;
    }
    for (const scanner::Command& command :
         knobs.commands(frame->hands, static_cast<double>(frame->display_time_ns) * 1e-9)) {
      scanner.apply(command, session.time_s());
    }
    session.frames().sample(session.time_s() - delay_s, state);
    if (settings.course != nullptr) settings.course->show(state);
    scanner.draw(state);
    session_watch.look(state);
    panels::SessionFacts facts = panels::facts_of(scene, settings.course);
    session_watch.fill(facts);
    if (breath) facts.breath = breath->in_words(session.time_s());
    panel.draw(facts, *settings.panel, static_cast<double>(frame->display_time_ns) * 1e-9);
    headset.end_frame(&view.draw(*frame, state,
                                 {.plane = scanner.in_view(),
                                  .screen = &scanner.screen(),
                                  .panel = panel.picture(),
                                  .see_through = see_through(*settings.panel),
                                  .needle = &session.newest_needle()}));
    if (settings.pictures == nullptr) continue;
    session::ShownPicture shown{.clock_s = static_cast<double>(frame->display_time_ns) * 1e-9,
                                .images = scanner.images()};
    if (!session.lockstep() && !session.paused()) {
      shown.needle_age_s = session.time_s() - session.newest_needle().shown_s();
      shown.ultrasound_age_s = session.time_s() - scanner.imaged_s();
    }
    settings.pictures->shown(shown);
  }
  return true;
}

}  // namespace

bool show_in_headset(headset::HeadsetRuntime& runtime, gpu::Device& device, const content::Scene& scene,
                     session::LiveSession& session, const HeadsetSessionSettings& settings, Observer& observer) {
  std::optional<headset::Headset> headset;
  try {
    headset.emplace(runtime, device, place_in(scene, settings.left_handed));
  } catch (const headset::HeadsetError& error) {
    observer.note(Note::notice, fmt::format("{}: {}; {}", runtime.name(), error.what(), settings.if_lost));
    return false;
  }
  scanner::LiveScanner scanner(device, scene, *settings.scanner);
  scanner.watch(settings.images);
  try {
    return run_in_headset(*headset, device, scene, session, scanner, settings, observer);
  } catch (const gpu::DeviceLost&) {
    *settings.scanner = scanner.console();
    throw;
  }
}

bool chosen_in_headset(headset::HeadsetRuntime& runtime, gpu::Device& device, const content::Scene& scene,
                       panels::TraineeChoice& choice, const content::Texts& texts, bool left_handed,
                       Observer& observer) {
  std::optional<headset::Headset> headset;
  try {
    headset.emplace(runtime, device, place_in(scene, left_handed));
  } catch (const headset::HeadsetError& error) {
    observer.note(Note::notice, fmt::format("{}: {}", runtime.name(), error.what()));
    return false;
  }
  immersive::ImmersiveView view(device, scene);
  immersive::TraineePanel panel(device, left_handed);
  immersive::HandsOnChoice hands;
  const state::FrameState rest = session::rest_frame(scene);
  while (!observer.stop_requested()) {
    const headset::HeadsetPhase phase = headset->poll();
    if (phase == headset::HeadsetPhase::ended) return false;
    if (phase == headset::HeadsetPhase::lost) {
      observer.note(Note::notice, headset->reason());
      return false;
    }
    const std::optional<headset::HeadsetFrame> frame = headset->begin_frame();
    if (!frame) {
      std::this_thread::sleep_for(kIdle);
      continue;
    }
    const panels::TraineeWish wish =
        choice.handle(hands.keys(frame->hands, static_cast<double>(frame->display_time_ns) * 1e-9));
    // There is nowhere to go back to: a name, or none, is always one of them.
    if (wish == panels::TraineeWish::chosen || !frame->draw) {
      headset->end_frame(nullptr);
      if (wish == panels::TraineeWish::chosen) return true;
      continue;
    }
    panel.draw(choice, texts, frame->period_s);
    headset->end_frame(&view.draw(*frame, rest, {.panel = &panel.picture()}));
  }
  return false;
}

}  // namespace stylet::app
