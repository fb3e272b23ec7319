#include "engine/scanner/live_scanner.h"

#include "engine/gpu/commands.h"
#include "engine/scanner/scanner_screen.h"
#include "engine/view/offscreen.h"

#include <algorithm>
#include <chrono>
#include <span>

namespace stylet::scanner {
namespace {

constexpr int kWidth = 640;
constexpr int kHeight = 480;
constexpr double kDiagnosisPeriod = 0.25;  // s
constexpr double kMessageTime = 4;         // s

}  // namespace

LiveScanner::LiveScanner(gpu::Device& device, const content::Scene& scene, const ScannerConsole& console)
    : device_(device),
      scene_(scene),
      console_(console),
      tissues_(scene),
      preset_(console.preset()),
      screen_(device, {.width = kWidth, .height = kHeight, .usage = gpu::kStorageUsage}) {
  make_imager();
}

void LiveScanner::make_imager() {
  preset_ = console_.preset();
  ultrasound::ImagerSettings settings = ultrasound::preset_settings(preset_);
  settings.width = kWidth;
  settings.height = kHeight;
  imager_.reset();
  imager_.emplace(device_, scene_, settings);
  imager_->set_controls(console_.controls());
  imager_->set_acoustics(tissues_.tissues());
}

void LiveScanner::say(const std::string& message, double time_s) {
  touched_ = touched_ || message_ != message;
  message_ = message;
  message_until_s_ = time_s + kMessageTime;
}

void LiveScanner::apply(const Command& command, double time_s) {
  console_.apply(command);
  touched_ = true;
  say(console_.limited(), time_s);
}

void LiveScanner::poll(double time_s) {
  if (tissues_.poll()) {
    imager_->set_acoustics(tissues_.tissues());
    touched_ = true;
    say(tissues_.problem().empty() ? "tissue table read again" : tissues_.problem(), time_s);
  }
  if (watcher_ != nullptr) watcher_->operate(*this, time_s);
  if (time_s >= message_until_s_ && !message_.empty()) {
    message_.clear();
    touched_ = true;
  }
}

double LiveScanner::period_s() const {
  const double own = 1 / ultrasound::image_rate_hz(scene_.probe, imager_->controls().depth);
  return most_share_ > 0 ? std::max(own, cost_s_ / most_share_) : own;
}

void LiveScanner::draw(const state::FrameState& state) {
  const bool first = images_ == 0;  // one that was frozen before has no image to keep
  const bool stands = state.time_s == imaged_s_;
  const bool due = state.time_s >= next_image_s_ || state.time_s < imaged_s_;
  if (!touched_ && (console_.frozen() || stands || !due)) return;
  if (!console_.frozen() || first) make_image(state);
  make_screen(state);
  touched_ = false;
}

void LiveScanner::make_image(const state::FrameState& state) {
  const auto before = std::chrono::steady_clock::now();
  if (preset_ != console_.preset()) {
    device_.wait_idle();
    make_imager();
  }
  imager_->set_controls(console_.controls());
  imager_->image(state);
  // Looking for the cause of a black image may take as long as the image.
  if (state.time_s >= diagnosed_s_ + kDiagnosisPeriod || state.time_s < diagnosed_s_) {
    diagnosed_s_ = state.time_s;
    diagnosis_ = imager_->diagnosis();
  }
  const double cost_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - before).count();
  cost_s_ = images_ > 1 ? cost_s_ + 0.3 * (cost_s - cost_s_) : cost_s;  // the first compiles the shaders
  ++images_;
  imaged_s_ = state.time_s;
  // The rate holds on average; what was missed is not made up for.
  const bool in_time = state.time_s >= next_image_s_ && state.time_s < next_image_s_ + period_s();
  next_image_s_ = (in_time ? next_image_s_ : state.time_s) + period_s();
}

void LiveScanner::make_screen(const state::FrameState& state) {
  note_ = message_.empty() ? diagnosis_ : message_;
  picture::Picture picture = view::read_picture(device_, imager_->image());
  if (watcher_ != nullptr && !console_.frozen()) watcher_->imaged(state, imager_->geometry(), picture);
  draw_scanner_screen(picture,
                      {.probe = scene_.probe.name,
                       .sector = imager_->geometry(),
                       .rate_hz = rate_hz(),
                       .probe_force = state.probe_force,
                       .note = note_},
                      console_, font_);
  gpu::run_now(device_,
               [&](gpu::Commands& commands) { commands.upload(screen_, std::as_bytes(std::span(picture.rgba))); });
}

render::PlaneTexture LiveScanner::in_view() const {
  const ultrasound::SectorGeometry& sector = imager_->geometry();
  return {.image = &imager_->image(), .origin = sector.origin, .metres_per_pixel = sector.metres_per_pixel};
}

}  // namespace stylet::scanner
