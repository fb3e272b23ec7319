#include "engine/debrief/film.h"

#include "engine/session/pictures.h"
#include "engine/session/video.h"
#include "engine/view/panes.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace stylet::debrief {

namespace {

session::PictureSettings panes_of(const FilmSettings& film, const gpu::Device& device) {
  const view::PaneLayout layout = view::PaneLayout::of(film.width, film.height, true);
  return {.view_width = film.stereo ? layout.scene.width / 2 : layout.scene.width,
          .view_height = layout.scene.height,
          .ultrasound_width = layout.ultrasound.width,
          .ultrasound_height = layout.ultrasound.height,
          .stereo = film.stereo,
          .multisample = !device.identity().is_lavapipe()};
}

}  // namespace

int write_film(const session::OutputDirectory& out, const content::Scene& scene, gpu::Device& device,
               SessionReplay& replay, const session::ForceTrace& force, const FilmSettings& settings,
               const session::RunProgress& progress) {
  const FrameHistory& frames = replay.frames();
  const session::Font font = session::Font::load();
  session::Pictures pictures(device, scene, panes_of(settings, device));
  // A frame takes a software rasteriser most of a second.
  const int frames_per_second = settings.frames_per_second / (device.identity().is_lavapipe() ? 2 : 1);
  session::VideoWriter video(
      out.staged("session.mp4"),
      {.width = settings.width, .height = settings.height, .frames_per_second = frames_per_second});
  state::FrameState frame = frames.make_frame();
  const double from_s = std::max(settings.from_s, frames.begin_s());
  const double span_s = std::max(0.0, std::min(settings.to_s, frames.end_s()) - from_s);
  const double step_s = settings.speed / frames_per_second;
  const auto count = static_cast<int>(std::floor(span_s / step_s + 1e-9)) + 1;
  for (int i = 0; i < count; ++i) {
    if (progress) progress(static_cast<double>(i) / count);
    frames.sample(from_s + i * step_s, frame);
    view::Picture picture = session::compose_frame(pictures.draw(frame, scene.camera, replay.zone_at(frame.time_s)),
                                                   frame, force, font, settings.width, settings.height);
    if (settings.speed != 1) {
      session::Canvas(picture).text(font, fmt::format("{:g} x speed", settings.speed), {110, 20}, 17,
                                    {226, 232, 236, 255});
    }
    video.add_frame(picture.rgba);
  }
  video.finish();
  return video.frames();
}

void write_stills(const session::OutputDirectory& out, const content::Scene& scene, gpu::Device& device,
                  SessionReplay& replay, double time_s, const session::ForceTrace& force,
                  const StillSettings& settings) {
  const FilmSettings& film = settings.film;
  state::FrameState moment = replay.frames().make_frame();
  replay.frames().sample(time_s, moment);
  const content::HeatedZone* zone = replay.zone_at(time_s);
  session::Pictures panes(device, scene, panes_of(film, device));
  view::write_png(out.staged("session.png"),
                  session::compose_frame(panes.draw(moment, scene.camera, zone), moment, force, session::Font::load(),
                                         film.width, film.height));
  session::Pictures stills(device, scene,
                           {.view_width = settings.view_width,
                            .view_height = settings.view_height,
                            .ultrasound_width = 960,
                            .ultrasound_height = 720,
                            .stereo = film.stereo});
  const session::Pictures::Moment pictures = stills.draw(moment, scene.camera, zone);
  view::write_png(out.staged("view.png"), pictures.view);
  view::write_png(out.staged("ultrasound.png"), pictures.ultrasound);
}

}  // namespace stylet::debrief
