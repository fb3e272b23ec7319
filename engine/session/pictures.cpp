#include "engine/session/pictures.h"

#include "engine/gpu/commands.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

namespace stylet::session {

namespace {

constexpr Colour kText{226, 232, 236, 255};
constexpr Colour kDim{150, 160, 168, 255};

// Copies the rows of `from` into `to` with its top left corner at (left, top).
void paste(const view::Picture& from, view::Picture& to, int left, int top) {
  const int rows = std::min(from.height, to.height - top);
  const int columns = std::min(from.width, to.width - left);
  for (int y = 0; y < rows; ++y) {
    std::memcpy(to.at(left, top + y), from.at(0, y), 4 * static_cast<std::size_t>(columns));
  }
}

view::Picture picture(gpu::Device& device, const gpu::Image& image, std::uint32_t layer) {
  const auto bytes = gpu::read_back(device, image, layer);
  view::Picture result(static_cast<int>(image.extent().width), static_cast<int>(image.extent().height));
  std::memcpy(result.rgba.data(), bytes.data(), result.rgba.size());
  return result;
}

}  // namespace

Pictures::Pictures(gpu::Device& device, const content::Scene& scene, const PictureSettings& settings)
    : device_(device),
      stereo_(settings.stereo),
      imager_(device, scene,
              {.width = settings.ultrasound_width, .height = settings.ultrasound_height, .seed = settings.seed}),
      renderer_(device, scene,
                {.width = settings.view_width, .height = settings.view_height, .views = settings.stereo ? 2 : 1}) {}

Pictures::Moment Pictures::draw(const state::FrameState& state, const content::Camera& camera) {
  const ultrasound::SectorGeometry sector = imager_.geometry();
  const gpu::Image& ultrasound = imager_.image(state);
  renderer_.render(state, camera,
                   {.image = &ultrasound, .origin = sector.origin, .metres_per_pixel = sector.metres_per_pixel});
  return {.view = read_view(), .ultrasound = picture(device_, ultrasound, 0)};
}

view::Picture Pictures::read_view() const {
  const view::Picture left = picture(device_, renderer_.image(), 0);
  if (!stereo_) return left;
  view::Picture both(2 * left.width, left.height);
  paste(left, both, 0, 0);
  paste(picture(device_, renderer_.image(), 1), both, left.width, 0);
  return both;
}

view::Picture compose_frame(const Pictures::Moment& moment, const state::FrameState& state, const ForceTrace& trace,
                            const Font& font) {
  const auto& [view, ultrasound] = moment;
  view::Picture frame(view.width + ultrasound.width, view.height);
  for (std::size_t i = 3; i < frame.rgba.size(); i += 4) frame.rgba[i] = 255;
  paste(view, frame, 0, 0);
  paste(ultrasound, frame, view.width, 0);
  const int strip_height = view.height - ultrasound.height;
  if (strip_height >= 64) {
    paste(draw_force_depth_strip(trace, state.time_s, font, ultrasound.width, strip_height), frame, view.width,
          ultrasound.height);
  }
  Canvas canvas(frame);
  canvas.text(font, fmt::format("{:5.2f} s", state.time_s), {14, 20}, 17, kText);
  canvas.text(font,
              fmt::format("tip to target {:.0f} mm   in tissue {:.0f} mm   force {:.2f} N",
                          state.target_distance * 1e3F, state.insertion_depth * 1e3F, state.force.norm()),
              {14, static_cast<double>(view.height) - 18}, 15, kDim);
  return frame;
}

}  // namespace stylet::session
