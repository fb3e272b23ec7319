#include "engine/debrief/film.h"

#include "engine/figures/video.h"
#include "engine/picture/panes.h"
#include "engine/sound/mixer.h"
#include "engine/sound/waveform.h"
#include "engine/stills/pictures.h"
#include "engine/training/ear.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace stylet::debrief {

namespace {

stills::PictureSettings panes_of(const FilmSettings& film, const gpu::Device& device) {
  const picture::PaneLayout layout = picture::PaneLayout::of(film.width, film.height, true);
  return {.view_width = film.stereo ? layout.scene.width / 2 : layout.scene.width,
          .view_height = layout.scene.height,
          .ultrasound_width = layout.ultrasound.width,
          .ultrasound_height = layout.ultrasound.height,
          .stereo = film.stereo,
          .multisample = !device.identity().is_lavapipe()};
}

/// A frame takes a software rasteriser most of a second.
int frames_per_second(const FilmSettings& film, const gpu::Device& device) {
  return film.frames_per_second / (device.identity().is_lavapipe() ? 2 : 1);
}

constexpr const char* kFile = "session.mp4";

/// Of the film, its first frame from_s and its last to_s; none of one that is slower or faster than the session was.
std::vector<float> sound_of(const content::Scene& scene, const training::Trace& trace, const DebriefFilm& film) {
  if (film.speed != 1) return {};
  return sound::track(training::cues_of(scene, trace), film.from_s, film.to_s);
}

}  // namespace

DebriefFilm film_of(const FrameHistory& frames, const FilmSettings& settings) {
  const double from_s = std::max(settings.from_s, frames.begin_s());
  return {.file = kFile,
          .from_s = from_s,
          .to_s = std::max(from_s, std::min(settings.to_s, frames.end_s())),
          .speed = settings.speed};
}

Film::Film(const files::OutputDirectory& out, const content::Scene& scene, gpu::Device& device, Footage& footage,
           const figures::ForceTrace& force, const FilmSettings& settings)
    : scene_(scene),
      footage_(footage),
      force_(force),
      settings_(settings),
      font_(figures::Font::load()),
      pictures_(device, scene, panes_of(settings, device)),
      sound_(sound_of(scene, footage.trace(), film_of(footage.frames(), settings))),
      video_(out.staged(kFile), {.width = settings.width,
                                 .height = settings.height,
                                 .frames_per_second = frames_per_second(settings, device),
                                 .sound = sound_,
                                 .samples_per_second = sound::kRate}),
      frame_(footage.frames().make_frame()) {
  const FrameHistory& frames = footage.frames();
  const DebriefFilm film = film_of(frames, settings);
  from_s_ = film.from_s;
  step_s_ = settings.speed / frames_per_second(settings, device);
  count_ = static_cast<int>(std::floor((film.to_s - film.from_s) / step_s_ + 1e-9)) + 1;
}

bool Film::draw_next() {
  if (next_ < count_) {
    footage_.frame_at(from_s_ + next_ * step_s_, frame_);
    picture::Picture picture = stills::compose_frame(pictures_.draw(frame_, scene_.camera), frame_, scene_, force_,
                                                     font_, settings_.width, settings_.height);
    if (settings_.speed != 1) {
      figures::Canvas(picture).text(font_, fmt::format("{:g} x speed", settings_.speed), {110, 20}, 17,
                                    {226, 232, 236, 255});
    }
    video_.add_frame(picture.rgba);
    if (++next_ == count_) video_.finish();
  }
  return next_ < count_;
}

int write_film(const files::OutputDirectory& out, const content::Scene& scene, gpu::Device& device, Footage& footage,
               const figures::ForceTrace& force, const FilmSettings& settings, const session::RunProgress& progress) {
  int frames = 0;
  out.named_in_place([&] {
    Film film(out, scene, device, footage, force, settings);
    do {
      if (progress) progress(film.share());
    } while (film.draw_next());
    frames = film.frames();
  });
  return frames;
}

void write_stills(const files::OutputDirectory& out, const content::Scene& scene, gpu::Device& device,
                  Footage& footage, double time_s, const figures::ForceTrace& force, const StillSettings& settings) {
  const FilmSettings& film = settings.film;
  state::FrameState moment = footage.frames().make_frame();
  footage.frame_at(time_s, moment);
  stills::Pictures panes(device, scene, panes_of(film, device));
  const picture::Picture both = stills::compose_frame(panes.draw(moment, scene.camera), moment, scene, force,
                                                      figures::Font::load(), film.width, film.height);
  stills::Pictures stills(device, scene,
                          {.view_width = settings.view_width,
                           .view_height = settings.view_height,
                           .ultrasound_width = 960,
                           .ultrasound_height = 720,
                           .stereo = film.stereo});
  const stills::Pictures::Moment pictures = stills.draw(moment, scene.camera);
  out.named_in_place([&] {
    picture::write_png(out.staged("session.png"), both);
    picture::write_png(out.staged("view.png"), pictures.view);
    picture::write_png(out.staged("ultrasound.png"), pictures.ultrasound);
  });
}

}  // namespace stylet::debrief
