#include "engine/scanner/live_scanner.h"

#include "engine/picture/png_bytes.h"
#include "engine/scanner/core_strips.h"
#include "engine/scanner/scanner_screen.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <span>

namespace stylet::scanner {
namespace {

constexpr int kWidth = 640;
constexpr int kHeight = 480;
constexpr double kDiagnosisPeriod = 0.25;  // s
constexpr double kMessageTime = 4;         // s
constexpr double kDrag = 5;                // pixels of the screen that make a drag of a click

}  // namespace

LiveScanner::LiveScanner(gpu::Device& device, const content::Scene& scene, const ScannerConsole& console)
    : device_(device),
      scene_(scene),
      console_(console),
      tissues_(scene),
      preset_(console.preset()),
      screen_(device, {.width = kWidth,
                       .height = kHeight,
                       .format = VK_FORMAT_R8G8B8A8_SRGB,
                       .usage = gpu::kTextureUsage | VK_IMAGE_USAGE_TRANSFER_SRC_BIT}),
      commands_(device),
      upload_(device),
      read_back_(device, VkDeviceSize{4} * kWidth * kHeight, 0, gpu::Memory::readback),
      bare_(kWidth, kHeight) {
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
  if (const auto* at = std::get_if<Point>(&command)) return point(*at);
  if (std::holds_alternative<SaveImage>(command)) return save_image(time_s);
  if (const auto* remove = std::get_if<RemoveMeasure>(&command)) {
    remove->all ? calipers_.clear() : calipers_.remove_last();
    marked_ = true;
    return;
  }
  const bool frozen = console_.frozen();
  console_.apply(command);
  if (frozen && !console_.frozen()) calipers_.clear();  // what they measured is not there any more
  touched_ = true;
  say(console_.limited(), time_s);
}

void LiveScanner::point(const Point& point) {
  if (images_ == 0) return;
  const ultrasound::SectorGeometry& sector = imager_->geometry();
  const Eigen::Vector2d uv(std::clamp(point.x, 0.0, 1.0) * kWidth - 0.5,
                           std::clamp(point.y, 0.0, 1.0) * kHeight - 0.5);
  const Eigen::Vector2d at = sector.position(uv);
  marked_ = marked_ || point.act != Point::Act::move || calipers_.under_way();
  switch (point.act) {
    case Point::Act::press:
      return calipers_.press(at);
    case Point::Act::move:
      return calipers_.move(at);
    case Point::Act::release:
      return calipers_.release(at, kDrag * sector.metres_per_pixel);
  }
}

void LiveScanner::save_image(double time_s) {
  if (saved_ == nullptr || images_ == 0) return say("no image can be saved now", time_s);
  if (saved_->size() >= kMostSavedImages) {
    return say(fmt::format("{} images are saved, no more are", kMostSavedImages), time_s);
  }
  picture::Picture picture = bare_;
  compose(picture, "");
  saved_->push_back({.png = picture::png_bytes(picture),
                     .time_s = imaged_s_,
                     .depth = imager_->controls().depth,
                     .metres_per_pixel = imager_->geometry().metres_per_pixel,
                     .distances = calipers_.distances()});
  say(fmt::format("image saved as {}", saved_image_name(saved_->size())), time_s);
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
  take_cores(state.cores);
  const bool first = images_ == 0;  // one that was frozen before has no image to keep
  const bool stands = state.time_s == imaged_s_;
  const bool due = state.time_s >= next_image_s_ || state.time_s < imaged_s_;
  const bool wanted = touched_ || (due && !stands);
  const bool imaging = first || (!console_.frozen() && wanted);
  if (imaging) make_image(state);
  if (!imaging && !touched_ && !marked_) return;
  touched_ = marked_ = false;
  if (imaging && watcher_ != nullptr && !console_.frozen()) watcher_->imaged(state, imager_->geometry(), bare_);
  show();
}

void LiveScanner::take_cores(std::span<const state::CoreTrack> cores) {
  const auto when = &state::CoreTrack::fired_s;
  if (std::ranges::equal(cores, cores_, {}, when, when)) return;
  cores_.assign(cores.begin(), cores.end());
  marked_ = true;
}

void LiveScanner::make_image(const state::FrameState& state) {
  const auto before = std::chrono::steady_clock::now();
  if (preset_ != console_.preset()) {
    device_.wait_idle();
    make_imager();
  }
  imager_->set_controls(console_.controls());
  commands_.begin();
  imager_->record(commands_, state);
  commands_.copy(imager_->image(), read_back_);
  commands_.transition(read_back_, gpu::kHostRead);
  device_.wait(commands_.submit());
  std::ranges::copy(read_back_.mapped_as<std::uint8_t>(), bare_.rgba.begin());
  // Looking for the cause of a black image may take as long as the image.
  if (state.time_s >= diagnosed_s_ + kDiagnosisPeriod || state.time_s < diagnosed_s_) {
    diagnosed_s_ = state.time_s;
    diagnosis_ = imager_->diagnosis();
  }
  const double cost_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - before).count();
  cost_s_ = images_ > 1 ? cost_s_ + 0.3 * (cost_s - cost_s_) : cost_s;  // the first compiles the shaders
  ++images_;
  imaged_s_ = state.time_s;
  probe_force_ = state.probe_force;
  // The rate holds on average; what was missed is not made up for.
  const bool in_time = state.time_s >= next_image_s_ && state.time_s < next_image_s_ + period_s();
  next_image_s_ = (in_time ? next_image_s_ : state.time_s) + period_s();
}

void LiveScanner::show() {
  note_ = message_.empty() ? diagnosis_ : message_;
  picture::Picture picture = bare_;
  compose(picture, texts_ != nullptr ? texts_->of(note_) : note_);
  draw_core_strips(picture, cores_, scene_, texts_, font_);
  upload_.begin();
  upload_.upload(screen_, std::as_bytes(std::span(picture.rgba)));
  upload_.submit();  // whoever uses it next on the queue has it
  ++screens_;
}

void LiveScanner::compose(picture::Picture& bare, const std::string& note) const {
  draw_scanner_screen(bare,
                      {.probe = scene_.probe.name,
                       .sector = imager_->geometry(),
                       .rate_hz = rate_hz(),
                       .probe_force = probe_force_,
                       .note = note,
                       .depth = imager_->controls().depth,
                       .focus = imager_->controls().focus,
                       .measures = calipers_.measures()},
                      console_, font_);
}

render::PlaneTexture LiveScanner::in_view() const {
  const ultrasound::SectorGeometry& sector = imager_->geometry();
  return {.image = &imager_->image(), .origin = sector.origin, .metres_per_pixel = sector.metres_per_pixel};
}

}  // namespace stylet::scanner
