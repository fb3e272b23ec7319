#include "tools/stylet/session_window.h"

#include "engine/render/renderer.h"
#include "engine/ultrasound/imager.h"
#include "engine/view/orbit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace stylet::tools {

namespace {

constexpr double kMetresPerHeight = 0.10;  // the mouse across the window's height moves the hub so far
constexpr double kMetresPerNotch = 0.004;  // a notch of the wheel advances the needle so far
constexpr double kRadiansPerHeight = 3.0;  // turning the camera

bool is_set(const char* variable) {
  const char* value = std::getenv(variable);
  return value != nullptr && *value != '\0';
}

}  // namespace

bool has_display() {
  return is_set("DISPLAY") || is_set("WAYLAND_DISPLAY");
}

void show_session(view::Display& display, gpu::Device& device, const content::Scene& scene,
                  const session::LiveSession& session, const SessionWindowSettings& settings) {
  view::Window window(display, device, {.title = fmt::format("Stylet: {}", scene.name)});
  ultrasound::Imager imager(device, scene);
  render::Renderer renderer(device, scene,
                            {.width = settings.stereo ? 400 : 800, .height = 720, .views = settings.stereo ? 2 : 1});
  const ultrasound::SectorGeometry sector = imager.geometry();
  state::FrameState frame = session.frames().make_frame();
  content::Camera camera = scene.camera;
  // One simulation period behind the newest state there is always a later one to interpolate to.
  const double delay_s = 1.5 / scene.rates.simulation_hz;
  while (!session.finished()) {
    const view::Input input = window.poll();
    if (input.close || std::ranges::find(input.keys, 'Q') != input.keys.end()) return;
    if (settings.mouse != nullptr) {
      settings.mouse->move(input.drag_x * kMetresPerHeight, -input.drag_y * kMetresPerHeight);
      settings.mouse->advance(input.advance * kMetresPerNotch);
    }
    camera = view::orbited(camera, input.orbit_x * kRadiansPerHeight, input.orbit_y * kRadiansPerHeight,
                           std::pow(0.9, input.zoom));
    if (std::ranges::find(input.keys, 'R') != input.keys.end()) camera = scene.camera;
    session.frames().sample(session.time_s() - delay_s, frame);
    const gpu::Image& ultrasound = imager.image(frame);
    const gpu::Image& view = renderer.render(
        frame, camera, {.image = &ultrasound, .origin = sector.origin, .metres_per_pixel = sector.metres_per_pixel});
    window.present(view, &ultrasound);
  }
}

}  // namespace stylet::tools
