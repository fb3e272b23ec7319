#include "tools/stylet/session_window.h"

#include "engine/render/renderer.h"
#include "engine/session/force_trace.h"
#include "engine/session/live_scanner.h"
#include "engine/view/orbit.h"
#include "tools/stylet/course_keys.h"
#include "tools/stylet/interrupt.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

namespace stylet::tools {

namespace {

constexpr double kMetresPerHeight = 0.10;  // the mouse across the window's height moves the hub so far
constexpr double kMetresPerNotch = 0.004;  // a notch of the wheel advances the needle so far
constexpr double kRadiansPerHeight = 3.0;  // turning the camera

constexpr std::size_t kCurvePoints = 20'000;  // of the live force curve
constexpr double kCurvePeriod = 0.1;          // s between its pictures
constexpr int kSmallestCurve = 60;            // pixels; a smaller pane shows nothing one could read

/// The force curve of the running session, as coarse as the window sees it.
class LiveCurve {
public:
  /// Takes in a frame. @return the curve so far as a picture of that size, drawn anew now and then
  const view::Picture& picture(const state::FrameState& frame, const view::Pane& pane) {
    const bool resized = picture_.width != pane.width || picture_.height != pane.height;
    if (frame.time_s > last_s_ && !frame.needle_orientations.empty()) {
      last_s_ = frame.time_s;
      const Eigen::Vector3f axis = frame.needle_orientations.front() * Eigen::Vector3f::UnitZ();
      trace_.add(frame.time_s, frame.needle_positions.front().cast<double>(), axis.cast<double>(),
                 frame.insertion_depth, frame.force.cast<double>());
    }
    if (pane.width < kSmallestCurve || pane.height < kSmallestCurve) return picture_;
    if (resized || last_s_ >= drawn_s_ + kCurvePeriod) {
      drawn_s_ = last_s_;
      picture_ = session::draw_force_depth_strip(trace_, last_s_, font_, pane.width, pane.height);
    }
    return picture_;
  }

private:
  session::Font font_ = session::Font::load();
  session::ForceTrace trace_{kCurvePoints};
  view::Picture picture_;
  double last_s_ = -1;
  double drawn_s_ = -1;
};

bool is_set(const char* variable) {
  const char* value = std::getenv(variable);
  return value != nullptr && *value != '\0';
}

}  // namespace

bool has_display() {
  return is_set("DISPLAY") || is_set("WAYLAND_DISPLAY");
}

void show_session(view::Display& display, gpu::Device& device, const content::Scene& scene,
                  session::LiveSession& session, const SessionWindowSettings& settings) {
  view::Window window(display, device, {.title = fmt::format("Stylet: {}", scene.name)});
  session::LiveScanner scanner(device, scene, settings.scanner);
  scanner.watch(settings.images);
  render::Renderer renderer(device, scene,
                            {.width = settings.stereo ? 400 : 800, .height = 720, .views = settings.stereo ? 2 : 1});
  state::FrameState frame = session.frames().make_frame();
  content::Camera camera = scene.camera;
  LiveCurve curve;
  // One simulation period behind the newest state there is always a later one to interpolate to.
  const double delay_s = 1.5 / scene.rates.simulation_hz;
  StylusWatch watch(settings.hid);
  while (!session.finished() && !interrupted()) {
    watch.look();
    const view::Input input = window.poll();
    if (input.close || std::ranges::find(input.keys, 'Q') != input.keys.end()) return;
    if (settings.course != nullptr) {
      const training::FlowState& state =
          settings.course->poll(session, course_actions(input, settings.course->state()));
      if (state.stage == training::Stage::debrief || settings.course->reset_asked_for()) return;
    }
    if (settings.mouse != nullptr) {
      settings.mouse->move(input.drag_x * kMetresPerHeight, -input.drag_y * kMetresPerHeight);
      settings.mouse->advance(input.advance * kMetresPerNotch);
    }
    scanner.handle(input, settings.probe, session.time_s());
    camera = view::orbited(camera, input.orbit_x * kRadiansPerHeight, input.orbit_y * kRadiansPerHeight,
                           std::pow(0.9, input.zoom));
    if (std::ranges::find(input.keys, 'R') != input.keys.end()) camera = scene.camera;
    session.frames().sample(session.time_s() - delay_s, frame);
    scanner.draw(frame);
    const gpu::Image& view = renderer.render(frame, camera, {.plane = scanner.in_view()});
    const view::Pane plot = view::PaneLayout::of(window.width(), window.height(), true).plot;
    window.present(view, &scanner.screen(), &curve.picture(frame, plot));
  }
}

}  // namespace stylet::tools
