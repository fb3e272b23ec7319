#include "engine/stills/pictures.h"

#include "engine/picture/panes.h"
#include "engine/picture/smooth_edges.h"
#include "engine/scanner/core_strips.h"
#include "engine/scanner/scanner_screen.h"
#include "engine/ultrasound/presets.h"
#include "engine/view/offscreen.h"

#include <fmt/format.h>

#include <string>

namespace stylet::stills {

namespace {

constexpr figures::Colour kText{226, 232, 236, 255};
constexpr figures::Colour kDim{150, 160, 168, 255};

ultrasound::ImagerSettings imager_settings(const content::Probe& probe, const PictureSettings& settings) {
  ultrasound::ImagerSettings imager = ultrasound::still_settings(probe);
  imager.width = settings.ultrasound_width;
  imager.height = settings.ultrasound_height;
  imager.seed = settings.seed;
  return imager;
}

}  // namespace

std::string distance_in_words(const state::FrameState& state) {
  const state::TargetState* target = state.nearest_target();
  return target != nullptr ? fmt::format("tip to target {:.0f} mm   ", target->distance * 1e3F) : "";
}

Pictures::Pictures(gpu::Device& device, const content::Scene& scene, const PictureSettings& settings)
    : device_(device),
      stereo_(settings.stereo),
      multisample_(settings.multisample),
      notes_(settings.notes),
      imager_(device, scene, imager_settings(scene.probe, settings)),
      renderer_(device, scene,
                {.width = settings.view_width,
                 .height = settings.view_height,
                 .views = settings.stereo ? 2 : 1,
                 .antialias = settings.multisample,
                 .room = settings.room}) {}

Pictures::Moment Pictures::draw(const state::FrameState& state, const content::Camera& camera) {
  const ultrasound::SectorGeometry sector = imager_.geometry();
  const gpu::Image& ultrasound = imager_.image(state);
  renderer_.render(
      state, camera,
      {.plane = {.image = &ultrasound, .origin = sector.origin, .metres_per_pixel = sector.metres_per_pixel},
       .screen = &ultrasound});
  Moment moment{.view = read_view(), .ultrasound = view::read_picture(device_, ultrasound)};
  note_ = imager_.diagnosis();
  if (notes_) scanner::draw_note(moment.ultrasound, note_, font_);
  return moment;
}

picture::Picture Pictures::read_view() const {
  const auto eye = [&](std::uint32_t layer) {
    picture::Picture picture = view::read_picture(device_, renderer_.image(), layer);
    if (!multisample_) picture::smooth_edges(picture);
    return picture;
  };
  picture::Picture left = eye(0);
  if (!stereo_) return left;
  const picture::Picture right = eye(1);
  picture::Picture both(2 * left.width, left.height);
  picture::draw_fitted(both, {0, 0, left.width, left.height}, left);
  picture::draw_fitted(both, {left.width, 0, right.width, right.height}, right);
  return both;
}

render::ViewLabels Pictures::view_labels() {
  render::ViewLabels left = renderer_.read_labels(0);
  if (!stereo_) return left;
  const render::ViewLabels right = renderer_.read_labels(1);
  const auto width = static_cast<std::size_t>(renderer_.settings().width);
  render::ViewLabels both;
  for (std::size_t row = 0; row < left.labels.size(); row += width) {
    for (const render::ViewLabels* eye : std::initializer_list<const render::ViewLabels*>{&left, &right}) {
      const auto first = static_cast<std::ptrdiff_t>(row);
      const auto end = static_cast<std::ptrdiff_t>(row + width);
      both.labels.insert(both.labels.end(), eye->labels.begin() + first, eye->labels.begin() + end);
      both.depth.insert(both.depth.end(), eye->depth.begin() + first, eye->depth.begin() + end);
    }
  }
  return both;
}

picture::Picture compose_frame(const Pictures::Moment& moment, const state::FrameState& state,
                               const content::Scene& scene, const figures::ForceTrace& trace,
                               const figures::Font& font, int width, int height) {
  const picture::Pane plot = picture::PaneLayout::of(width, height, true).plot;
  picture::Picture ultrasound = moment.ultrasound;
  scanner::draw_core_strips(ultrasound, state.cores, scene, nullptr, font);
  picture::Picture frame =
      picture::compose(width, height, moment.view, ultrasound,
                       figures::draw_force_depth_strip(trace, state.time_s, font, plot.width, plot.height));
  figures::Canvas canvas(frame);
  canvas.text(font, fmt::format("{:5.2f} s", state.time_s), {14, 20}, 17, kText);
  std::string figures = fmt::format("{}in tissue {:.0f} mm   force {:.2f} N", distance_in_words(state),
                                    state.insertion_depth * 1e3F, state.force.norm());
  if (state.probe_area > 0) {
    figures += fmt::format("   probe {:.1f} N on {:.0f} cm²", state.probe_force, state.probe_area * 1e4F);
  }
  canvas.text(font, figures, {14, static_cast<double>(height) - 18}, 15, kDim);
  return frame;
}

}  // namespace stylet::stills
