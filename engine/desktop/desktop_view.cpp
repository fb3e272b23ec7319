#include "engine/desktop/desktop_view.h"

#include "engine/desktop/course_keys.h"
#include "engine/desktop/needle_keys.h"
#include "engine/view/orbit.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace stylet::desktop {
namespace {

constexpr double kOrbitPerHeight = 3.0;  // turning the camera
constexpr double kResizedAfter = 0.25;   // s that a new size stays before the renderer takes it

constexpr std::array kScales{1.0, 0.75, 0.5};
constexpr double kSlowFrame = 0.050;  // s: below 20 frames a second
constexpr double kQuickFrame = 0.012;
constexpr double kSlowFor = 1;  // s of slow frames on end
constexpr double kQuickFor = 2;

render::SeeThrough see_through(PatientView view) {
  switch (view) {
    case PatientView::closed:
      return render::SeeThrough::closed;
    case PatientView::window:
      return render::SeeThrough::window;
    case PatientView::see_through:
      return render::SeeThrough::glass;
  }
  return render::SeeThrough::window;
}

}  // namespace

double RenderScale::after(double frame_s) {
  slow_s_ = frame_s > kSlowFrame ? slow_s_ + frame_s : 0;
  quick_s_ = frame_s < kQuickFrame ? quick_s_ + frame_s : 0;
  const auto at = std::ranges::find(kScales, scale_);
  if (slow_s_ >= kSlowFor && at + 1 != kScales.end()) {
    scale_ = *(at + 1);
    slow_s_ = 0;
  } else if (quick_s_ >= kQuickFor && at != kScales.begin()) {
    scale_ = *(at - 1);
    quick_s_ = 0;
  }
  return scale_;
}

DesktopView::DesktopView(gpu::Device& device, const content::Scene& scene, session::LiveSession& session,
                         const DesktopSettings& settings)
    : device_(device),
      scene_(scene),
      session_(session),
      settings_(settings),
      scanner_(device, scene, settings.arrangement.scanner),
      watch_(scene),
      panels_(settings.arrangement.panels),
      frame_(session.frames().make_frame()),
      camera_(settings.arrangement.camera.value_or(scene.camera)) {
  scanner_.watch(settings.images);
}

bool DesktopView::handle(const view::Input& input) {
  if (input.close || std::ranges::find(input.keys, 'Q') != input.keys.end()) return false;
  if (settings_.course != nullptr) {
    for (const training::Action action : course_actions(input, settings_.course->state())) pressed_.push_back(action);
    const training::FlowState& state = settings_.course->poll(session_, pressed_);
    pressed_.clear();
    if (state.stage == training::Stage::debrief || settings_.course->reset_asked_for()) return false;
  }
  if (settings_.mouse != nullptr) {
    lead_by_pointer(*settings_.mouse, input);
    for (const view::Input::Stroke& stroke : input.strokes) lead_by_key(*settings_.mouse, stroke);
  }
  for (const int key : input.keys) panels_.press(key);
  scanner_.handle(input, settings_.probe, session_.time_s());
  camera_ = view::orbited(camera_, input.orbit_x * kOrbitPerHeight, input.orbit_y * kOrbitPerHeight,
                          std::pow(0.9, input.zoom));
  if (std::ranges::find(input.keys, 'R') != input.keys.end()) camera_ = scene_.camera;
  return true;
}

void DesktopView::fit_renderer(int width, int height, double dt_s) {
  const double scale = renderer_ ? scale_.after(dt_s) : 1.0;
  const int views = settings_.stereo ? 2 : 1;
  const auto pixels = [&](int size) { return std::max(static_cast<int>(std::lround(size * scale)), 16); };
  const int wanted_width = pixels(width / views), wanted_height = pixels(height);
  const bool fits =
      renderer_ && renderer_->settings().width == wanted_width && renderer_->settings().height == wanted_height;
  fits_for_s_ = fits ? 0 : fits_for_s_ + dt_s;
  if (fits || (renderer_ && fits_for_s_ < kResizedAfter)) return;
  fits_for_s_ = 0;
  device_.wait_idle();
  renderer_.reset();
  renderer_.emplace(device_, scene_,
                    render::RenderSettings{.width = wanted_width,
                                           .height = wanted_height,
                                           .views = views,
                                           .antialias = !device_.identity().is_lavapipe()});
}

void DesktopView::draw(int width, int height, double dt_s) {
  fit_renderer(std::max(width, 1), std::max(height, 1), dt_s);
  // One simulation period behind the newest state there is always a later one to interpolate to.
  session_.frames().sample(session_.time_s() - 1.5 / scene_.rates.simulation_hz, frame_);
  watch_.look(frame_);
  if (settings_.course != nullptr) settings_.course->show(frame_);
  scanner_.draw(frame_);
  renderer_->render(frame_, camera_,
                    {.plane = scanner_.in_view(),
                     .screen = &scanner_.screen(),
                     .see_through = see_through(panels_.patient_view()),
                     .latch_needle = [&](render::NeedlePose pose) {
                       session_.newest_needle().show(pose.positions, pose.orientations);
                     }});

  DesktopFacts facts{.session = panels::facts_of(scene_, settings_.course), .device = settings_.device};
  if (settings_.mouse != nullptr) facts.needle_help = needle_help_lines();
  std::vector<CourseChoice> choices;
  if (settings_.course != nullptr) choices = course_choices(settings_.course->state());
  for (const CourseChoice& choice : choices) facts.choices.push_back({.label = choice.label, .key = choice.key});
  watch_.fill(facts.session);
  const auto chosen = panels_.draw(facts, scanner_.console(), width, height,
                                   picture::PaneLayout::over_scene(width, height).ultrasound);
  if (chosen && *chosen < choices.size()) pressed_.push_back(choices[*chosen].action);
}

}  // namespace stylet::desktop
