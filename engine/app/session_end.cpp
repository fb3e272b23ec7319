#include "engine/app/session_end.h"

#include "engine/app/debrief_recording.h"
#include "engine/app/expert_choice.h"
#include "engine/app/saved_images.h"
#include "engine/debrief/still_moment.h"
#include "engine/files/child_process.h"
#include "engine/files/error.h"

#include <fmt/format.h>

#include <system_error>
#include <utility>

namespace stylet::app {

SessionEnd::SessionEnd(const SessionSettings& settings, const OverSession& session, SessionResult& result,
                       Graphics& graphics, SessionObserver& observer)
    : settings_(settings),
      session_(session),
      result_(result),
      graphics_(graphics),
      observer_(observer),
      out_(settings.out),
      work_(out_, {session.scene, session.recording, session.footage, session.force},
            {.stills = {.film = {.stereo = settings.stereo}},
             .film = settings.film,
             .attempts = session.before.list(),
             .saved = saved_pictures(out_.destination()),
             .metrics = result.training.metrics}) {}

void SessionEnd::take_replay(const CheckedReplay& replay) {
  result_.report.replay_identical = replay.identical;
  result_.report.replay_hashes = replay.hashes;
  out_.named_in_place([&] {
    session::write_json(out_.staged("session.json"), numbers_of(result_.report, result_.training, session_.before));
  });
  out_.publish({"session.json"});
}

void SessionEnd::note_state() {
  result_.page_written = work_.page_written();
  result_.drawn = work_.done();
  result_.film_frames = work_.film_frames();
  result_.still_moment = debrief::still_words(session_.recording.events);
}

void SessionEnd::finish() {
  try {
    take_replay(check_replay(session_.scene, session_.recording, result_.report.state_hash, observer_));
    observer_.task_done();
    observer_.measured(result_);
    if (auto expert = chosen_expert(settings_.expert, session_.own_motion, session_.scene, observer_)) {
      work_.compare_with(*std::move(expert));
    }
    graphics_.draw([this](gpu::Device& device) {
      try {
        while (!work_.done()) {
          show_progress(observer_, work_.doing(), work_.share());
          work_.step(device);
        }
      } catch (const gpu::DeviceLost&) {
        work_.release_device();
        throw;
      }
    });
    debrief_attempts();
  } catch (const Stopped&) {
  } catch (const gpu::GpuError& error) {
    result_.not_drawn_because = error.what();
  }
  work_.release_device();
  observer_.task_done();
  note_attempts_without_page();
  note_state();
}

void SessionEnd::debrief_attempts() {
  for (const std::filesystem::path& folder : session_.before.without_page()) {
    debrief_recording({.recording = folder.string(), .expert = settings_.expert, .out = folder, .gpu = settings_.gpu},
                      observer_);
  }
}

void SessionEnd::note_attempts_without_page() {
  for (const std::filesystem::path& folder : session_.before.without_page()) {
    observer_.note(Note::notice, fmt::format("{} has no debrief yet; `stylet debrief {} --out {}` writes it",
                                             folder.string(), folder.string(), folder.string()));
  }
}

std::string SessionEnd::open_page() const {
  const std::string page = (out_.destination() / "debrief.html").string();
  try {
    // A browser outlives this program.
    files::ChildProcess({.command = {"setsid", "--fork", "xdg-open", page}}).wait();
  } catch (const std::system_error&) {
  }
  return page;
}

void SessionEnd::tell(panels::Ending& ending, BackgroundCheck& check) {
  if (auto expert = check.take_expert()) work_.compare_with(*std::move(expert));
  if (const auto replay = check.take_replay()) {
    take_replay(*replay);
    ending.note = replay->identical ? fmt::format("The recording replays bit for bit ({} hashes).", replay->hashes)
                                    : "The recording does NOT replay bit for bit: see session.json.";
  }
  if (const std::string problem = check.take_problem(); !problem.empty()) {
    ending.note = problem;
    observer_.note(Note::notice, problem);
  }
  const BackgroundCheck::Doing checked = check.doing();
  ending.doing = work_.done() ? checked.task : work_.doing();
  ending.share = work_.done() ? checked.share : work_.share();
}

void SessionEnd::draw_piece() {
  try {
    work_.step(graphics_.device());
  } catch (const gpu::DeviceLost&) {
    throw;
  } catch (const std::exception& error) {  // no disk, no ffmpeg: the window stays
    work_.give_up();
    throw files::ContentError(error.what());
  }
}

AfterSession SessionEnd::show(std::unique_ptr<SessionWindow> window, Screen& screen,
                              const std::function<std::unique_ptr<SessionWindow>()>& reopen,
                              const std::string& next) {
  observer_.measured(result_);
  const bool waits = result_.waits_for_user;
  if (waits) work_.leave_out_film();
  const BackgroundCheck::Settings wanted{.expert = settings_.expert,
                                         .own_hand = session_.own_motion,
                                         .state_hash = result_.report.state_hash,
                                         .attempts = session_.before.without_page(),
                                         .gpu = settings_.gpu};
  std::optional<BackgroundCheck> check(std::in_place, session_.scene, session_.recording, wanted);
  std::optional<AfterSession> after;
  panels::Ending ending = ending_of(result_);
  window->end(ending);
  while (true) {
    try {
      tell(*window->ending(), *check);
      const auto wish = window->frame_at_end(next);
      std::string& note = window->ending()->note;
      if (wish == desktop::EndWish(desktop::CourseButton::again)) after = AfterSession::again;
      if (wish == desktop::EndWish(desktop::EndButton::next)) after = AfterSession::next;
      if (wish == desktop::EndWish(desktop::EndButton::leave) || observer_.stop_requested()) {
        after = AfterSession::leave;
      }
      if (wish == desktop::EndWish(desktop::EndButton::film)) work_.add_film();
      if (wish == desktop::EndWish(desktop::EndButton::debrief)) {
        note = work_.page_written() ? "In the browser: " + open_page() : "The debrief is being written.";
      }
      if (after && (work_.page_written() || work_.done())) break;
      if (!waits && work_.done() && check->doing().task.empty()) break;
      if (!work_.done()) draw_piece();
    } catch (const gpu::DeviceLost& lost) {
      ending = *window->ending();
      work_.release_device();
      window.reset();
      screen.close();
      if (!graphics_.recover(lost, "the debrief can be written with `stylet debrief`")) {
        result_.not_drawn_because = lost.what();
        break;
      }
      window = reopen();
      window->end(ending);
    } catch (const files::ContentError& error) {
      window->ending()->note = error.what();
      observer_.note(Note::notice, error.what());
    }
  }
  work_.release_device();
  check.reset();
  if (after != AfterSession::again) note_attempts_without_page();
  note_state();
  return after.value_or(AfterSession::leave);
}

panels::Ending ending_of(const SessionResult& result) {
  return panels::ending_of(result.training, result.procedure);
}

}  // namespace stylet::app
