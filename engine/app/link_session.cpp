#include "engine/app/link_session.h"

#include "engine/link/link_error.h"
#include "engine/link/scanner_request.h"
#include "engine/scanner/named_command.h"
#include "engine/tracking/tracked_transforms.h"

#include <chrono>
#include <thread>

namespace stylet::app {
namespace {
constexpr auto kPause = std::chrono::milliseconds(10);

/// All of it, or nothing where a part is not understood. @return its words: what was limited, or what is wrong
link::CommandDesk::Answer carry_out(const link::CommandDesk::Request& request, scanner::LiveScanner& scanner,
                                    double time_s) {
  const link::ScannerRequest asked = link::read_scanner_request(request.text);
  if (!asked.problem.empty()) return {request.number, false, asked.problem};
  for (const link::Setting& setting : asked.settings) {
    const auto command = scanner::named_command(setting.name, setting.value, scanner.console());
    if (const auto* problem = std::get_if<scanner::NotUnderstood>(&command))
      return {request.number, false, problem->why};
  }
  std::string words;
  for (const link::Setting& setting : asked.settings) {
    scanner.apply(std::get<scanner::Command>(scanner::named_command(setting.name, setting.value, scanner.console())),
                  time_s);
    const std::string& limited = scanner.console().limited();
    words += (words.empty() || limited.empty() ? "" : ", ") + limited;
  }
  return {request.number, true, words.empty() ? "done" : words};
}

}  // namespace

LinkSession::LinkSession(const SessionLinkSettings& settings, const content::Scene& scene,
                         const session::LiveSession& live, const link::LinkInputs& inputs)
    : scene_(scene), live_(live), settings_(settings), frame_(live.frames().make_frame()) {
  if (!settings.wanted()) return;
  link_.emplace(live.frames(), inputs,
                link::LinkSettings{
                    .listen = settings.listen, .source = settings.source, .transform_hz = settings.transform_hz});
}

void LinkSession::start(Observer& observer) {
  if (!link_) return;
  link_->start(live_.time_s());
  if (link_->port() == 0) return;
  observer.note(Note::info, "OpenIGTLink: clients connect to " +
                                link::to_string({.host = settings_.listen->host, .port = link_->port()}));
}

void LinkSession::imaged(const state::FrameState& state, const ultrasound::SectorGeometry& sector,
                         const picture::Picture& bare) {
  const link::Clock::time_point now = link::Clock::now();
  if (!link_ || link_->clients() == 0 || now < next_image_) return;
  next_image_ =
      now + std::chrono::duration_cast<link::Clock::duration>(std::chrono::duration<double>(1 / settings_.image_hz));
  image_.time_s = state.time_s;
  image_.width = bare.width;
  image_.height = bare.height;
  image_.pixels.resize(bare.rgba.size() / 4);
  for (std::size_t pixel = 0; pixel < image_.pixels.size(); ++pixel) image_.pixels[pixel] = bare.rgba[4 * pixel];
  image_.reference_from_image =
      tracking::ras_pose(state.probe_position, state.probe_orientation) * tracking::image_to_probe(sector);
  link_->show(image_);
}

void LinkSession::operate(scanner::LiveScanner& scanner, double time_s) {
  if (!link_) return;
  while (const auto request = link_->commands().next())
    link_->commands().answer(carry_out(*request, scanner, time_s));
}

void LinkSession::pass_time(gpu::Device* device, const training::TrainingSession& course) {
  if (link_ && device == nullptr) link_->commands().set_attended(false);
  if (!link_ || link_->clients() == 0 || device == nullptr) return std::this_thread::sleep_for(kPause);
  if (!scanner_) {
    scanner_.emplace(*device, scene_, scanner::ScannerConsole(scene_.probe));
    scanner_->watch(this);
  }
  // As in the window: a little behind, where there is a later state to interpolate to.
  const double time_s = live_.time_s();
  live_.frames().sample(time_s - 1.5 / scene_.rates.simulation_hz, frame_);
  scanner_->poll(time_s);
  course.show(frame_);
  scanner_->draw(frame_);
  std::this_thread::sleep_until(next_image_);
}

std::vector<std::string> LinkSession::stop() {
  drop_scanner();
  return link_ ? link::summary(link_->stop()) : std::vector<std::string>{};
}

}  // namespace stylet::app
