#include "engine/app/author_window.h"

#include "engine/app/screen.h"
#include "engine/app/validate.h"
#include "engine/author/draft.h"
#include "engine/author/picking.h"
#include "engine/content/probe_placement.h"
#include "engine/desktop/author_panel.h"
#include "engine/files/error.h"
#include "engine/motion/biopsy_motion.h"
#include "engine/motion/stroke_motion.h"
#include "engine/readers/motion.h"
#include "engine/readers/scene_organs.h"
#include "engine/readers/texts_file.h"
#include "engine/render/renderer.h"
#include "engine/scanner/live_scanner.h"
#include "engine/session/frame_publisher.h"
#include "engine/view/orbit.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <future>
#include <optional>
#include <utility>
#include <vector>

namespace stylet::app {
namespace {

using author::SkinPoint;
using desktop::AuthorTool;
using desktop::AuthorWish;

constexpr double kOrbit = 3.0;                              // rad for a drag over the window's height
constexpr double kZoom = 0.9;                               // a notch
constexpr double kDeeper = 0.001, kLarger = 0.001;          // m a notch, a key
constexpr double kLeastRadius = 0.0005, kMostRadius = 0.2;  // m, as the format has it
constexpr double kBeforeSkin = 0.004;                       // m from the tip, as it is shown, to the entry
constexpr float kCover = 0.5F;                              // opacity up to which a tissue is a cover

std::string chosen_language(const AuthorSettings& settings) {
  return settings.language.empty() ? readers::language_of_environment() : settings.language;
}

class AuthorWindow {
public:
  AuthorWindow(const AuthorSettings& settings, Observer& observer)
      : settings_(settings), observer_(observer), draft_(readers::find_scenario(settings.scenario)) {
    std::vector<std::string> warnings;
    scene_ = readers::load_scene_with_organs(
        draft_.path(), [&](const std::string& doing, double share) { show_progress(observer, doing, share); },
        warnings, organs_);
    observer_.task_done();
    loaded_probe_ = scene_.probe.pose;
    loaded_camera_ = scene_.camera;
    if (const auto entry = author::entry_of(scene_.motion, scene_.needle.length, scene_.labels)) {
      loaded_entry_ = entry->point;
    }
    take_draft();
    checked_.warnings = std::move(warnings);
  }

  bool run() {
    std::optional<gpu::Device> made;
    Screen screen;  // goes before its device
    gpu::Device& device = made.emplace(
        gpu::DeviceSettings{.gpu = settings_.gpu, .window_extensions = screen.display().vulkan_extensions()});
    screen.open(device, "Stylet: " + scene_.name);
    const content::Texts texts = readers::find_texts(chosen_language(settings_));
    {
      scanner::LiveScanner scanner(device, scene_, scanner::ScannerConsole(scene_.probe));
      const auto begun = std::chrono::steady_clock::now();
      try {
        while (!left_) {
          frame_.time_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
          frame(screen, device, scanner, texts);
          if (observer_.stop_requested()) keep();
        }
      } catch (...) {  // the graphics device was lost
        renderer_.reset();
        keep();
        throw;
      }
      device.wait_idle();
      renderer_.reset();
    }
    screen.close();
    if (check_.valid()) checked_ = check_.get();
    for (const std::string& problem : checked_.problems) observer_.note(Note::notice, problem);
    return checked_.sound();
  }

private:
  void keep() {
    left_ = true;
    if (!draft_.changed()) return;
    observer_.note(Note::notice, "what was not saved is kept in " + draft_.keep().string());
  }

  /// The scene as the draft has it.
  void take_draft() {
    targets_ = draft_.targets();
    for (author::TargetPlan& target : targets_) {
      if (target.organ.empty()) continue;
      const std::vector<std::size_t> surfaces = surfaces_of(target.organ);
      if (surfaces.empty()) continue;
      const content::Target ball = author::target_of(scene_, surfaces);
      target.centre = ball.centre;
      target.radius = ball.radius;
    }
    forbidden_ = draft_.forbidden();
    forbidden_surfaces_.clear();
    for (const std::string& organ : forbidden_) {
      const auto surfaces = surfaces_of(organ);
      forbidden_surfaces_.insert(forbidden_surfaces_.end(), surfaces.begin(), surfaces.end());
    }
    scene_.probe.pose = draft_.probe().value_or(loaded_probe_);
    entry_ = draft_.entry() ? draft_.entry() : loaded_entry_;
    home_ = draft_.camera().value_or(loaded_camera_);
    chosen_ = targets_.empty() ? 0 : std::min(chosen_, targets_.size() - 1);
    const Eigen::Vector3d focus = targets_.empty() ? Eigen::Vector3d::Zero() : targets_[chosen_].centre;
    if (!targets_.empty()) {
      scene_.targets.resize(1);
      if ((scene_.targets.front().centre - focus).norm() > 1e-9) refocus_ = true;
      scene_.targets.front() = {.name = targets_[chosen_].name, .centre = focus, .radius = targets_[chosen_].radius};
    }
    const double time_s = frame_.time_s;
    frame_ = session::rest_frame(scene_);
    frame_.time_s = time_s;
    if (entry_ && !targets_.empty()) show_needle(*entry_, targets_.front().centre);  // as the motion leads it
    odd_ = author::look_over(scene_, targets_, forbidden_surfaces_, entry_);
  }

  void show_needle(const Eigen::Vector3d& entry, const Eigen::Vector3d& target) {
    const Eigen::Vector3d along = (target - entry).normalized();
    const std::size_t nodes = frame_.needle_positions.size();
    for (std::size_t i = 0; i < nodes; ++i) {
      const double behind = scene_.needle.length * (1 - static_cast<double>(i) / static_cast<double>(nodes - 1));
      frame_.needle_positions[i] = (entry - (kBeforeSkin + behind) * along).cast<float>();
      frame_.needle_orientations[i] =
          Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), along).cast<float>();
    }
  }

  std::vector<std::size_t> surfaces_of(const std::string& organ) const {
    std::vector<std::size_t> surfaces;
    for (std::size_t i = 0; i < organs_.size(); ++i) {
      if (organs_[i] == organ) surfaces.push_back(i);
    }
    return surfaces;
  }

  /// The first organ behind what is only seen as a cover, as skin, fat and muscle are; else the first of those.
  std::optional<author::Chord> organ_under(const author::Ray& ray) const {
    std::optional<author::Chord> cover;
    for (const author::Chord& chord : author::chords(scene_, ray)) {
      const content::Surface& surface = scene_.surfaces[chord.surface];
      const float opacity = scene_.tissues[static_cast<std::size_t>(surface.tissue)].colour[3];
      if (chord.to <= chord.from || surface.role == content::SurfaceRole::visual || opacity == 0) continue;
      if (opacity > kCover) return chord;
      if (!cover) cover = chord;
    }
    return cover;
  }

  void toggle(const std::string& id) {
    std::vector<std::string> list = forbidden_;
    if (const auto at = std::ranges::find(list, id); at != list.end()) {
      list.erase(at);
    } else if (list.size() < content::kMaxForbidden) {
      list.push_back(id);
    } else {
      return say(fmt::format("{} organs are the most that can be forbidden", content::kMaxForbidden));
    }
    draft_.set_forbidden(list);
  }

  void click(const author::Ray& ray, bool shift) {
    const auto skin = author::skin_under(scene_.labels, ray);
    const auto organ = organ_under(ray);
    said_.clear();
    switch (tool_) {
      case AuthorTool::target: {
        if (!organ) return say("There is no organ");
        author::TargetPlan target = chosen_target();
        target.organ = shift ? organs_[organ->surface] : "";
        target.centre = ray.at(0.5 * (organ->from + organ->to));
        target.radius = std::clamp(target.radius, kLeastRadius, kMostRadius);
        draft_.set_target(chosen_, target);
        return say("In " + organs_[organ->surface]);
      }
      case AuthorTool::entry:
        if (!skin) return say("There is no skin that the needle can go through");
        return draft_.set_entry(skin->point);
      case AuthorTool::probe:
        if (!skin) return say("There is no skin for the probe");
        return draft_.set_probe(probe_at(*skin));
      case AuthorTool::forbidden: {
        if (!organ) return say("There is no organ");
        return toggle(organs_[organ->surface]);
      }
    }
  }

  /// Of the organs that have an inside, each once.
  std::vector<std::string> ids() const {
    std::vector<std::string> ids;
    for (std::size_t i = 0; i < organs_.size(); ++i) {
      if (scene_.surfaces[i].role != content::SurfaceRole::visual &&
          std::ranges::find(ids, organs_[i]) == ids.end()) {
        ids.push_back(organs_[i]);
      }
    }
    return ids;
  }

  void say(std::string text) { said_ = std::move(text); }

  author::TargetPlan chosen_target() const {
    return targets_.empty() ? author::TargetPlan{.name = "target"} : targets_[chosen_];
  }

  physics::RigidPose probe_at(const SkinPoint& skin) const {
    const Eigen::Vector3d seen =
        targets_.empty() ? Eigen::Vector3d(skin.point - 0.05 * skin.normal) : targets_[chosen_].centre;
    return content::probe_on_skin(skin.point, skin.normal, seen, entry_.value_or(skin.point));
  }

  void choose(std::size_t target) {
    if (target == chosen_ || target >= targets_.size()) return;
    chosen_ = target;
    take_draft();
  }

  void grow(double by) {
    if (targets_.empty()) return;
    author::TargetPlan target = chosen_target();
    target.organ.clear();
    target.radius = std::clamp(target.radius + by, kLeastRadius, kMostRadius);
    draft_.set_target(chosen_, target);
  }

  content::Motion motion_to(const Eigen::Vector3d& entry) const {
    if (targets_.empty()) throw files::ContentError("no target: the needle's motion leads to one; put it first");
    const author::TargetPlan& target = targets_.front();
    const Eigen::Vector3d way = (target.centre - entry).normalized();
    if (!(std::abs(way.y()) < 0.98)) {
      throw files::ContentError("entry: the needle would run along the body; choose one beside the target");
    }
    const auto& plan = scene_.exercise.plan;
    if (plan && plan->kind != "biopsy") {
      return motion::stay_motion({.entry = entry,
                                  .target = target.centre,
                                  .exposed = plan->working_length,
                                  .needle_length = scene_.needle.length,
                                  .breathing = scene_.breathing});
    }
    return motion::biopsy_motion(motion::demonstration(
        entry, target.centre, std::clamp(target.radius, motion::kLeastAimed, motion::kMostAimed),
        scene_.needle.length));
  }

  /// @return whether it is on disk
  bool save() {
    try {
      draft_.save([&](const Eigen::Vector3d& entry, const std::filesystem::path& path) {
        readers::write_motion(motion_to(entry), scene_.name, path);
      });
      say("Saved");
      if (check_.valid()) check_.wait();
      checked_ = {};
      check_ = std::async(std::launch::async, [path = draft_.path()] { return validate(path, {}); });
      return true;
    } catch (const files::ContentError& error) {
      say(error.what());
      return false;
    }
  }

  void act(AuthorWish wish) {
    switch (wish) {
      case AuthorWish::nothing:
        return;
      case AuthorWish::next_target:
        return choose(targets_.empty() ? 0 : (chosen_ + 1) % targets_.size());
      case AuthorWish::camera:
        return draft_.set_camera(camera_);
      case AuthorWish::undo:
        return draft_.undo();
      case AuthorWish::redo:
        return draft_.redo();
      case AuthorWish::larger:
        return grow(kLarger);
      case AuthorWish::smaller:
        return grow(-kLarger);
      case AuthorWish::save:
        if (save() && leaving_) left_ = true;
        return;
      case AuthorWish::discard:
        left_ = true;
        return;
      case AuthorWish::leave:
        leaving_ = draft_.changed() && !leaving_;
        left_ = !draft_.changed();
        return;
      case AuthorWish::closed:
        return keep();
    }
  }

  /// Where a problem of the file lies.
  std::optional<Eigen::Vector3d> place_of(const std::string& pointer) const {
    const auto begins = [&](const char* what) { return pointer.starts_with(what); };
    if (begins("/probe")) return scene_.probe.pose.position;
    if (begins("/motion") && entry_) return *entry_;
    if (begins("/targets") && !targets_.empty()) {
      const std::size_t which = pointer.size() > 9 ? std::strtoul(pointer.c_str() + 9, nullptr, 10) : 0;
      return targets_[std::min(which, targets_.size() - 1)].centre;
    }
    if (begins("/camera")) return home_.look_at;
    return {};
  }

  desktop::AuthorFacts facts() {
    using namespace std::chrono_literals;
    const bool checking = check_.valid() && check_.wait_for(0s) != std::future_status::ready;
    if (check_.valid() && !checking) {
      checked_ = check_.get();
      if (checked_.sound()) say("Saved, and sound");
    }
    desktop::AuthorFacts out{.title = scene_.name,
                             .tool = tool_,
                             .target = chosen_,
                             .organs = ids(),
                             .forbidden = forbidden_,
                             .said = said_,
                             .changed = draft_.changed(),
                             .can_undo = draft_.can_undo(),
                             .can_redo = draft_.can_redo(),
                             .checking = checking,
                             .leaving = leaving_};
    for (const author::TargetPlan& target : targets_) {
      out.targets.push_back(target.name);
      out.marks.push_back({.text = target.name, .at = target.centre, .radius = target.radius});
    }
    if (entry_) out.marks.push_back({.text = "Entry", .at = *entry_});
    for (const author::Oddity& odd : odd_) {
      out.marks.push_back({.text = odd.text, .at = odd.at, .problem = true});
      out.problems.push_back(odd.text);
    }
    for (const auto* lines : {&checked_.problems, &checked_.warnings}) {
      for (const std::string& line : *lines) {
        out.problems.push_back(line);
        if (const auto at = place_of(author::pointer_of(line))) {
          const std::size_t what = line.find(": ");
          out.marks.push_back(
              {.text = what == std::string::npos ? line : line.substr(what + 2), .at = *at, .problem = true});
        }
      }
    }
    return out;
  }

  void pointer(const view::Input& input, const picture::Pane& pane, const scanner::LiveScanner& scanner, int width,
               int height) {
    const author::Ray ray = author::ray_through(camera_, input.pointer_x, input.pointer_y, width, height);
    const bool pressed = input.left && !held_;
    const bool let_go = !input.left && held_;
    held_ = input.left;
    const VkExtent3D extent = scanner.screen().extent();
    const double u = (input.pointer_x - pane.x) / pane.width * extent.width;
    const double v = (input.pointer_y - pane.y) / pane.height * extent.height;
    const bool in_image = u >= 0 && v >= 0 && u < extent.width && v < extent.height;
    if (pressed && in_image && tool_ == AuthorTool::target) {
      const render::PlaneTexture plane = scanner.in_view();
      author::TargetPlan target = chosen_target();
      target.organ.clear();
      const Eigen::Vector2d xz = plane.origin + Eigen::Vector2d(u, v) * plane.metres_per_pixel;
      target.centre = scene_.probe.pose.position + scene_.probe.pose.orientation * Eigen::Vector3d(xz.x(), 0, xz.y());
      draft_.set_target(chosen_, target);
    }
    if (in_image) return;
    if (tool_ == AuthorTool::probe) {  // follows while it is dragged, and is put down where it is let go
      if (input.left) {
        if (const auto skin = author::skin_under(scene_.labels, ray)) {
          scene_.probe.pose = probe_at(*skin);
          frame_.probe_position = scene_.probe.pose.position.cast<float>();
          frame_.probe_orientation = scene_.probe.pose.orientation.cast<float>();
        }
      }
      if (let_go) click(ray, input.shift);
    } else if (pressed) {
      click(ray, input.shift);
    }
    if (input.advance != 0 && tool_ == AuthorTool::target && !targets_.empty()) {
      author::TargetPlan target = chosen_target();
      target.organ.clear();
      target.centre += input.advance * kDeeper * (target.centre - camera_.eye).normalized();
      draft_.set_target(chosen_, target);
    }
  }

  void fit_renderer(gpu::Device& device, int width, int height) {
    if (renderer_ && renderer_->settings().width == width && renderer_->settings().height == height && !refocus_) {
      return;
    }
    refocus_ = false;
    device.wait_idle();
    renderer_.reset();
    renderer_.emplace(
        device, scene_,
        render::RenderSettings{.width = width, .height = height, .antialias = !device.identity().is_lavapipe()});
  }

  void frame(Screen& screen, gpu::Device& device, scanner::LiveScanner& scanner, const content::Texts& texts) {
    view::Overlay& overlay = screen.overlay();
    view::Input input = screen.window().poll();
    const int width = screen.window().width(), height = screen.window().height();
    overlay.begin(view::overlay_frame(input, width, height));
    if (screen.window().minimised()) return screen.window().idle();
    if (!looked_) camera_ = home_;
    looked_ = true;
    const VkExtent3D extent = scanner.screen().extent();
    const picture::Pane corner{
        .x = width - width * 2 / 5, .y = height - height * 2 / 5, .width = width * 2 / 5, .height = height * 2 / 5};
    const picture::Pane pane =
        picture::fitted(corner, static_cast<int>(extent.width), static_cast<int>(extent.height));
    const std::string text = draft_.text();
    const auto entry = draft_.entry();
    act(desktop::author_keys(input, leaving_, tool_));
    if (!overlay.wants_pointer()) {
      pointer(input, pane, scanner, width, height);
      if (input.orbit_x != 0 || input.orbit_y != 0 || input.zoom != 0) {
        camera_ = view::orbited(camera_, input.orbit_x * kOrbit, input.orbit_y * kOrbit, std::pow(kZoom, input.zoom));
      }
    }
    const desktop::AuthorFacts shown = facts();
    const desktop::AuthorChoice choice = desktop::draw_author(shown, camera_, width, height, texts);
    act(choice.wish);
    if (!choice.toggled.empty()) toggle(choice.toggled);
    tool_ = choice.tool;
    choose(choice.target);
    if (draft_.text() != text || draft_.entry() != entry) take_draft();
    if (!draft_.changed()) leaving_ = false;
    fit_renderer(device, width, height);
    scanner.poll(frame_.time_s);
    scanner.draw(frame_);
    renderer_->render(frame_, camera_,
                      {.plane = scanner.in_view(), .screen = &scanner.screen(), .see_through = seen()});
    screen.window().present(renderer_->image(), {scanner.screen(), pane}, overlay);
  }

  /// Skin where it is worked on, organs where they are.
  render::SeeThrough seen() const {
    const bool organs = tool_ == AuthorTool::target || tool_ == AuthorTool::forbidden;
    return organs ? render::SeeThrough::glass : render::SeeThrough::closed;
  }

  AuthorSettings settings_;
  Observer& observer_;
  author::Draft draft_;
  content::Scene scene_;
  std::vector<std::string> organs_;  ///< of the scene's surfaces
  physics::RigidPose loaded_probe_;
  content::Camera loaded_camera_;
  std::optional<Eigen::Vector3d> loaded_entry_;
  std::vector<author::TargetPlan> targets_;
  std::vector<std::string> forbidden_;
  std::vector<std::size_t> forbidden_surfaces_;
  std::optional<Eigen::Vector3d> entry_;
  std::vector<author::Oddity> odd_;
  content::Camera home_, camera_;
  state::FrameState frame_;
  std::optional<render::Renderer> renderer_;
  AuthorTool tool_ = AuthorTool::target;
  std::size_t chosen_ = 0;  ///< of targets_, that is edited
  std::string said_;
  Verdict checked_;
  std::future<Verdict> check_;
  bool held_ = false, leaving_ = false, left_ = false, refocus_ = false, looked_ = false;
};

}  // namespace

bool author_scenario(const AuthorSettings& settings, Observer& observer) {
  return AuthorWindow(settings, observer).run();
}

}  // namespace stylet::app
