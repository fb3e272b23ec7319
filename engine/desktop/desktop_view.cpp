#include "engine/desktop/desktop_view.h"

#include "engine/desktop/framing.h"
#include "engine/desktop/input_commands.h"
#include "engine/desktop/key_table.h"
#include "engine/desktop/screen_move.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <utility>

namespace stylet::desktop {
namespace {

constexpr float kHubLength = 0.03F;     // m
constexpr double kResizedAfter = 0.25;  // s that a new size stays before the renderer takes it

// A step changes the pixels by a third at most, and the time of a frame by less: a larger picture is not slow at
// once.
constexpr std::array kScales{1.0, 0.85, 0.7, 0.6, 0.5};
constexpr double kSlowFrame = 0.085;  // s, on average; ten frames a second are wanted, and then sharp ones
constexpr double kQuickFrame = 0.050;
constexpr double kLookedAt = 1;  // s
constexpr int kQuickLooks = 2;   // on end

// m that surfaces may be off by where a processor draws: half a pixel of a window of 720. Each triangle costs it as
// much as some pixels.
constexpr double kError = 0.4e-3;

constexpr const char* kFrozenHint = "left button: measure from here to there     F12: save the image     Space: live";

// Of the time, for ultrasound images where a processor draws both.
constexpr double kUltrasoundShare = 0.4;

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

/// "14.2 frames/s of 1280 x 720, needle 61 ms old, ultrasound 9.8 images/s, 85 ms old"
std::string words(const session::RecentPictures& recent, const render::RenderSettings& drawn) {
  return fmt::format("{:.1f} frames/s of {} x {}, needle {:.0f} ms old     ultrasound {:.1f} images/s, {:.0f} ms old",
                     recent.frames_per_second, drawn.width * drawn.views, drawn.height, 1e3 * recent.needle_age_s,
                     recent.images_per_second, 1e3 * recent.ultrasound_age_s);
}

/// Pixels of the scene, drawn for a frame of that size, that lie wholly under a pane: by some less on each side where
/// the scene is enlarged, as a pixel of the frame is then made of its neighbors (view/composition: along an edge).
VkRect2D under(const picture::Pane& pane, int width, int height, const render::RenderSettings& drawn) {
  const int margin = drawn.width == width && drawn.height == height ? 0 : 7;
  const double x = static_cast<double>(drawn.width) / width, y = static_cast<double>(drawn.height) / height;
  const int left = static_cast<int>(std::ceil(pane.x * x)) + margin;
  const int top = static_cast<int>(std::ceil(pane.y * y)) + margin;
  const int right = static_cast<int>(std::floor((pane.x + pane.width) * x)) - margin;
  const int bottom = static_cast<int>(std::floor((pane.y + pane.height) * y)) - margin;
  if (left < 0 || top < 0 || right <= left || bottom <= top || right > drawn.width || bottom > drawn.height)
    return {};
  return {{left, top}, {static_cast<std::uint32_t>(right - left), static_cast<std::uint32_t>(bottom - top)}};
}

}  // namespace

double RenderScale::after(double frame_s) {
  seconds_ += frame_s;
  ++frames_;
  if (seconds_ < kLookedAt) return scale_;
  const double mean_s = seconds_ / frames_;
  seconds_ = 0;
  frames_ = 0;
  quick_looks_ = mean_s < kQuickFrame ? quick_looks_ + 1 : 0;
  const auto at = std::ranges::find(kScales, scale_);
  if (mean_s > kSlowFrame && at + 1 != kScales.end()) {
    scale_ = *(at + 1);
  } else if (quick_looks_ >= kQuickLooks && at != kScales.begin()) {
    scale_ = *(at - 1);
    quick_looks_ = 0;
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
      camera_(settings.arrangement.camera.value_or(scene.camera)),
      home_(settings.arrangement.home) {
  if (settings.breath != nullptr) breath_.emplace(*settings.breath);
  scanner_.watch(settings.images);
  scanner_.keep_images(settings.saved);
  scanner_.speak(settings.texts);
  // Of a session in lockstep the same images come on every machine.
  if (device.identity().type == VK_PHYSICAL_DEVICE_TYPE_CPU && !session.lockstep())
    scanner_.limit_share(kUltrasoundShare);
  // It takes a second or two, in which the scene is drawn as it is.
  if (device.identity().is_lavapipe() && !settings.stereo) {
    thinned_ = std::async(session.lockstep() ? std::launch::deferred : std::launch::async,
                          [&scene] { return render::geometry_of(scene, {.detail = {.error = kError}}); });
  }
}

view::Input DesktopView::point_at_image(view::Input input) {
  using Act = scanner::Point::Act;
  const picture::Pane& pane = image_place_;
  const auto on_image = [&](double x, double y) {
    return x >= pane.x && y >= pane.y && x < pane.x + pane.width && y < pane.y + pane.height;
  };
  const auto point = [&](Act act, double x, double y) {
    const scanner::Point at{act, (x - pane.x) / std::max(pane.width, 1), (y - pane.y) / std::max(pane.height, 1)};
    scanner_.apply(at, session_.time_s());
  };
  bool taken = pointing_;
  for (const view::Press& press : input.presses) {
    if (press.down && on_image(press.x, press.y)) {
      pointing_ = taken = true;
      point(Act::press, press.x, press.y);
    } else if (!press.down && pointing_) {
      pointing_ = false;
      point(Act::release, press.x, press.y);
    }
  }
  if (scanner_.calipers().under_way()) point(Act::move, input.pointer_x, input.pointer_y);
  if (!input.left) pointing_ = false;  // let go where nobody saw it
  if (taken) input.drag_x = input.drag_y = 0;
  return input;
}

bool DesktopView::handle(const view::Input& input) {
  const std::vector<Command> commands = commands_of(point_at_image(input));
  const auto ends = [](const Command& command) { return std::holds_alternative<EndSession>(command); };
  if (std::ranges::any_of(commands, ends)) return false;
  if (settings_.course != nullptr) {
    for (const Command& command : commands) {
      if (const auto* button = std::get_if<CourseButton>(&command)) {
        actions_.push_back(action_of(*button, settings_.course->state()));
      }
    }
    const training::FlowState& state = settings_.course->poll(session_, actions_);
    actions_.clear();
    if (state.stage == training::Stage::debrief || settings_.course->reset_asked_for()) return false;
  }
  for (const Command& command : commands) apply(command);
  if (breath_) breath_->look(session_);
  scanner_.poll(session_.time_s());
  return true;
}

void DesktopView::end(panels::Ending ending) {
  ending_ = std::move(ending);
  scanner_.watch(nullptr);        // nobody watches what does not change
  scanner_.keep_images(nullptr);  // the results are complete
}

std::optional<EndWish> DesktopView::handle_at_end(const view::Input& input, const std::string& next) {
  next_ = next;
  std::optional<EndWish> wish = std::exchange(asked_at_end_, std::nullopt);
  for (const Command& command : commands_of(point_at_image(input))) {
    if (std::holds_alternative<EndSession>(command)) wish = EndButton::leave;
    if (const auto* button = std::get_if<EndButton>(&command)) wish = *button;
    const auto* course = std::get_if<CourseButton>(&command);
    if (course != nullptr && *course == CourseButton::again) wish = *course;
    // Needle and probe stay where the session left them.
    if (std::holds_alternative<PanelCommand>(command) || std::holds_alternative<view::CameraCommand>(command) ||
        std::holds_alternative<scanner::Command>(command) || std::holds_alternative<ToggleSound>(command)) {
      apply(command);
    }
  }
  scanner_.poll(session_.time_s());
  if (wish && *wish == EndWish(EndButton::next) && next.empty()) wish.reset();
  return wish;
}

std::vector<Choice> DesktopView::end_choices() {
  std::vector<Choice> choices;
  end_wishes_.clear();
  const auto said = [&](const std::string& text) {
    return settings_.texts != nullptr ? settings_.texts->of(text) : text;
  };
  const auto offer = [&](const EndWish& wish, const std::string& key, const std::string& label) {
    end_wishes_.push_back(wish);
    choices.push_back({.label = label, .key = key});
  };
  offer(CourseButton::again, key_of(CourseButton::again), "Try again");
  if (!next_.empty()) offer(EndButton::next, key_of(EndButton::next), said("Next") + ": " + said(next_));
  offer(EndButton::debrief, key_of(EndButton::debrief), "Debrief");
  offer(EndButton::film, key_of(EndButton::film), "Film");
  offer(EndButton::leave, key_of(EndButton::leave), "Leave");
  return choices;
}

void DesktopView::apply(const Command& command) {
  if (const auto* move = std::get_if<haptic::NeedleMove>(&command); move != nullptr && settings_.mouse != nullptr) {
    settings_.mouse->lead(as_on_screen(*move, settings_.mouse->motion(), camera_));
  }
  if (const auto* probe = std::get_if<session::ProbeCommand>(&command);
      probe != nullptr && settings_.probe != nullptr) {
    const bool done = settings_.probe->apply(*probe, session_.time_s());
    scanner_.say(done ? "" : "no skin there for the probe", session_.time_s());
  }
  if (std::holds_alternative<HoldBreath>(command) && breath_) breath_->ask();
  if (std::holds_alternative<ToggleSound>(command) && settings_.speaker != nullptr) {
    settings_.speaker->mute(!settings_.speaker->muted());
  }
  if (const auto* knob = std::get_if<scanner::Command>(&command)) turn(*knob);
  if (const auto* panels = std::get_if<PanelCommand>(&command)) {
    panels_.apply(*panels);
    if (*panels == PanelCommand::other_hand && home_) {  // what the needle was beside now lies on it
      if (camera_.eye == home_->eye && camera_.look_at == home_->look_at) camera_ = scene_.camera;
      home_.reset();
    }
  }
  if (const auto* camera = std::get_if<view::CameraCommand>(&command)) {
    camera_ = view::after(*camera, camera_, home_.value_or(scene_.camera));
  }
}

void DesktopView::turn(const scanner::Command& command) {
  const bool frozen = scanner_.console().frozen();
  scanner_.apply(command, session_.time_s());
  if (!frozen && scanner_.console().frozen()) scanner_.say(kFrozenHint, session_.time_s());
}

bool DesktopView::thinned() {
  if (!thinned_.valid()) return true;
  if (!renderer_ || thinned_.wait_for(std::chrono::seconds(0)) == std::future_status::timeout) return false;
  device_.wait_idle();
  const render::RenderSettings settings = renderer_->settings();
  renderer_.reset();
  renderer_.emplace(device_, scene_, settings, thinned_.get());
  return true;
}

void DesktopView::fit_renderer(int width, int height, double dt_s) {
  thinned();
  const double scale = renderer_ ? scale_.after(dt_s) : 1.0;
  const int views = settings_.stereo ? 2 : 1;
  const auto pixels = [&](int size) { return std::max(static_cast<int>(std::lround(size * scale)), 16); };
  const int wanted_width = pixels(width / views), wanted_height = pixels(height);
  const bool fits =
      renderer_ && renderer_->settings().width == wanted_width && renderer_->settings().height == wanted_height;
  fits_for_s_ = fits ? 0 : fits_for_s_ + dt_s;
  if (fits || (renderer_ && fits_for_s_ < kResizedAfter)) return;
  fits_for_s_ = 0;
  if (renderer_) return renderer_->resize(wanted_width, wanted_height);
  renderer_.emplace(device_, scene_,
                    render::RenderSettings{.width = wanted_width,
                                           .height = wanted_height,
                                           .views = views,
                                           .antialias = !device_.identity().is_lavapipe()});
}

void DesktopView::frame_needle(int width, int height) {
  const DesktopFacts facts;  // before the start all but the briefing is as it will be
  const Layout layout = panels_.layout(facts, width, height);
  const bool untouched = camera_.eye == scene_.camera.eye && camera_.look_at == scene_.camera.look_at;
  std::vector<Eigen::Vector3f> needle = frame_.needle_positions;
  if (!needle.empty() && !frame_.needle_orientations.empty()) {  // what the hand holds lies behind the first node
    const Eigen::Vector3f axis = frame_.needle_orientations.front() * Eigen::Vector3f::UnitZ();
    needle.insert(needle.begin(), needle.front() - kHubLength * axis);
  }
  home_ = framed(scene_.camera, needle, layout, width, height);
  if (untouched) camera_ = *home_;
}

void DesktopView::draw(int width, int height, double dt_s) {
  fit_renderer(std::max(width, 1), std::max(height, 1), dt_s);
  // One simulation period behind the newest state there is always a later one to interpolate to.
  const bool known =
      session_.frames().sample(session_.time_s() - 1.5 / scene_.rates.simulation_hz, frame_).provenance !=
      state::Provenance::none;
  if (known && !home_ && !settings_.stereo) frame_needle(width, height);
  watch_.look(frame_);
  if (settings_.course != nullptr) settings_.course->show(frame_);
  const std::uint64_t images = scanner_.images();
  scanner_.draw(frame_);
  imaged_ = scanner_.images() != images;
  DesktopFacts facts{.session = panels::facts_of(scene_, settings_.course),
                     .device = settings_.device,
                     .led_by_keys = settings_.mouse != nullptr};
  if (settings_.pictures != nullptr) facts.pictures = words(settings_.pictures->recent(), renderer_->settings());
  if (settings_.speaker != nullptr && settings_.speaker->muted()) facts.sound = "sound is off";
  if (!ending_ && breath_) facts.session.breath = breath_->in_words(session_.time_s());
  std::vector<CourseChoice> choices;
  std::optional<std::size_t> breath_choice;
  if (ending_) {
    facts.choices = end_choices();
  } else if (settings_.course != nullptr) {
    choices = course_choices(settings_.course->state());
    for (const CourseChoice& choice : choices) {
      facts.choices.push_back({.label = choice.label, .key = key_of(choice.button)});
    }
    if (breath_ && settings_.course->state().stage != training::Stage::briefing) {
      breath_choice = facts.choices.size();
      const std::string& button = settings_.breath_button;
      facts.choices.push_back({.label = breath_->breathes() ? "Hold breath" : "Breathe on",
                               .key = key_of_breath() + (button.empty() ? "" : ", " + button)});
    }
  }
  watch_.fill(facts.session);
  std::optional<panels::Ending> shown = ending_;
  if (settings_.texts != nullptr) {
    facts.texts = settings_.texts;
    panels::translate(facts.session, *settings_.texts);
    if (shown) panels::translate(*shown, *settings_.texts);
    for (Choice& choice : facts.choices) choice.label = settings_.texts->of(choice.label);
    facts.pictures = settings_.texts->of(facts.pictures);
    facts.sound = settings_.texts->of(facts.sound);
  }
  if (shown) facts.ending = &*shown;
  scanner_place_ = panels_.layout(facts, width, height).ultrasound;
  const VkExtent3D screen = scanner_.screen().extent();
  const picture::Pane pane = image_place_ =
      picture::fitted(scanner_place_, static_cast<int>(screen.width), static_cast<int>(screen.height));
  renderer_->render(frame_, camera_,
                    {.plane = scanner_.in_view(),
                     .screen = &scanner_.screen(),
                     .see_through = see_through(panels_.patient_view()),
                     .hidden = under(pane, width, height, renderer_->settings()),
                     .pictures = scanner_.screens(),
                     .latch_needle = [&](render::NeedlePose pose) {
                       session_.newest_needle().show(pose.positions, pose.orientations);
                     }});

  const PanelInput asked = panels_.draw(facts, scanner_.console(), width, height);
  if (asked.choice && ending_ && *asked.choice < end_wishes_.size()) asked_at_end_ = end_wishes_[*asked.choice];
  if (asked.choice && *asked.choice < choices.size()) actions_.push_back(choices[*asked.choice].action);
  if (asked.choice && asked.choice == breath_choice) breath_->ask();
  for (const scanner::Command& command : asked.scanner) turn(command);
}

void DesktopView::shown(double clock_s) {
  if (settings_.pictures == nullptr) return;
  session::ShownPicture picture{.clock_s = clock_s, .images = scanner_.images(), .scale = scale_.now()};
  if (!session_.lockstep() && !session_.paused()) {
    picture.needle_age_s = session_.time_s() - session_.newest_needle().shown_s();
    if (!scanner_.console().frozen()) picture.ultrasound_age_s = session_.time_s() - scanner_.imaged_s();
  }
  settings_.pictures->shown(picture);
}

std::vector<gpu::Timestamps::Span> DesktopView::pass_times() const {
  std::vector<gpu::Timestamps::Span> times;
  if (imaged_) {
    for (const gpu::Timestamps::Span& pass : scanner_.pass_times()) {
      times.push_back({"ultrasound " + pass.name, pass.seconds});
    }
  }
  for (const gpu::Timestamps::Span& pass : renderer_->stage_times()) {
    times.push_back({"view " + pass.name, pass.seconds});
  }
  return times;
}

}  // namespace stylet::desktop
