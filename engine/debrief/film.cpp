#include "engine/debrief/film.h"

#include "engine/figures/video.h"
#include "engine/picture/panes.h"
#include "engine/stills/pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

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

}  // namespace

int write_film(const files::OutputDirectory& out, const content::Scene& scene, gpu::Device& device,
               SessionReplay& replay, const figures::ForceTrace& force, const FilmSettings& settings,
               const session::RunProgress& progress) {
  const FrameHistory& frames = replay.frames();
  const figures::Font font = figures::Font::load();
  stills::Pictures pictures(device, scene, panes_of(settings, device));
  // A frame takes a software rasteriser most of a second.
  const int frames_per_second = settings.frames_per_second / (device.identity().is_lavapipe() ? 2 : 1);
  figures::VideoWriter video(
      out.staged("session.mp4"),
      {.width = settings.width, .height = settings.height, .frames_per_second = frames_per_second});
  state::FrameState frame = frames.make_frame();
  const double from_s = std::max(settings.from_s, frames.begin_s());
  const double span_s = std::max(0.0, std::min(settings.to_s, frames.end_s()) - from_s);
  const double step_s = settings.speed / frames_per_second;
  const auto count = static_cast<int>(std::floor(span_s / step_s + 1e-9)) + 1;
  for (int i = 0; i < count; ++i) {
    if (progress) progress(static_cast<double>(i) / count);
    replay.frame_at(from_s + i * step_s, frame);
    picture::Picture picture = stills::compose_frame(pictures.draw(frame, scene.camera), frame, force, font,
                                                     settings.width, settings.height);
    if (settings.speed != 1) {
      figures::Canvas(picture).text(font, fmt::format("{:g} x speed", settings.speed), {110, 20}, 17,
                                    {226, 232, 236, 255});
    }
    video.add_frame(picture.rgba);
  }
  video.finish();
  return video.frames();
}

void write_stills(const files::OutputDirectory& out, const content::Scene& scene, gpu::Device& device,
                  SessionReplay& replay, double time_s, const figures::ForceTrace& force,
                  const StillSettings& settings) {
  const FilmSettings& film = settings.film;
  state::FrameState moment = replay.frames().make_frame();
  replay.frame_at(time_s, moment);
  stills::Pictures panes(device, scene, panes_of(film, device));
  picture::write_png(out.staged("session.png"),
                     stills::compose_frame(panes.draw(moment, scene.camera), moment, force, figures::Font::load(),
                                           film.width, film.height));
  stills::Pictures stills(device, scene,
                          {.view_width = settings.view_width,
                           .view_height = settings.view_height,
                           .ultrasound_width = 960,
                           .ultrasound_height = 720,
                           .stereo = film.stereo});
  const stills::Pictures::Moment pictures = stills.draw(moment, scene.camera);
  picture::write_png(out.staged("view.png"), pictures.view);
  picture::write_png(out.staged("ultrasound.png"), pictures.ultrasound);
}

}  // namespace stylet::debrief
