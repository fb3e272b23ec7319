#include "engine/app/replay.h"

#include "engine/app/replay_window.h"
#include "engine/debrief/debrief.h"
#include "engine/debrief/film.h"
#include "engine/debrief/still_moment.h"
#include "engine/desktop/replay_keys.h"
#include "engine/files/error.h"
#include "engine/files/output_directory.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace stylet::app {

namespace {

/// The span of the session that is drawn, which has something in it.
void check_span(const ReplaySettings& settings, double duration_s) {
  if (settings.from_s < settings.to_s && settings.from_s < duration_s) return;
  throw files::ContentError(fmt::format("--from {:g} --to {:g}: the span must lie within the session, 0 to {:.2f} s",
                                        settings.from_s, settings.to_s, duration_s));
}

}  // namespace

Replay::Replay(const ReplaySettings& settings, Observer& observer)
    : settings_(settings),
      observer_(observer),
      session_(open_recording(settings.recording, settings.scenario, observer)),
      replay_(session_.scene, session_.recording) {
  check_span(settings_, session_.duration_s());
}

Replay::Replay(RecordedSession session, Observer& observer)
    : observer_(observer), session_(std::move(session)), replay_(session_.scene, session_.recording) {}

bool Replay::run() {
  if (settings_.window) {
    view::Display display;
    gpu::Device gpu({.gpu = settings_.gpu, .window_extensions = display.vulkan_extensions()});
    observer_.note(Note::info, desktop::kReplayKeys);
    show_replay(display, gpu, session_.scene, replay_,
                debrief::Playback(settings_.from_s, std::min(settings_.to_s, session_.duration_s()), settings_.speed),
                observer_);
    if (replay_.result().run.haptic.steps < session_.steps.haptic) return false;
  } else {
    replay_.run([&](double share) { show_progress(observer_, "Replaying", share); });
  }
  observer_.task_done();
  return true;
}

ReplayFilm Replay::write_film(const std::filesystem::path& folder) {
  const content::Scene& scene = session_.scene;
  gpu::Device gpu({.gpu = settings_.gpu});
  files::OutputDirectory out(folder);
  debrief::write_force(out, session_.recording, replay_.force());
  const debrief::FilmSettings film{.from_s = settings_.from_s, .to_s = settings_.to_s, .speed = settings_.speed};
  const int frames = debrief::write_film(out, scene, gpu, replay_, replay_.force(), film,
                                         [&](double share) { show_progress(observer_, "Drawing the video", share); });
  const debrief::StillMoment moment =
      debrief::still_moment(session_.recording.events, replay_.frames(), settings_.from_s, settings_.to_s);
  debrief::write_stills(out, scene, gpu, replay_, moment.time_s, replay_.force(), {.film = film});
  out.commit();
  observer_.task_done();
  return {.folder = out.destination(), .frames = frames, .still_moment = std::string(moment.words)};
}

}  // namespace stylet::app
