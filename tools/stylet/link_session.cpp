#include "tools/stylet/link_session.h"

#include "engine/link/link_error.h"
#include "engine/link/scanner_request.h"
#include "engine/scanner/named_command.h"
#include "engine/tracking/tracked_transforms.h"
#include "tools/stylet/session_options.h"

#include <fmt/format.h>

#include <charconv>
#include <chrono>
#include <cstdio>
#include <thread>

namespace stylet::tools {
namespace {

constexpr auto kPause = std::chrono::milliseconds(10);

link::Endpoint listening_endpoint(const LinkOptions& options) {
  link::Endpoint endpoint{.host = options.address};
  if (options.port.empty() || options.port.front().empty()) return endpoint;
  const std::string& text = options.port.front();
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), endpoint.port);
  if (error != std::errc{} || end != text.data() + text.size()) {
    throw link::LinkError(fmt::format("--link {}: is no port; give a number up to 65535, 0 for any free one", text));
  }
  return endpoint;
}

link::LinkSettings link_settings(const LinkOptions& options) {
  link::LinkSettings settings{.transform_hz = options.transform_hz};
  if (options.serve) settings.listen = listening_endpoint(options);
  if (!options.from.empty()) settings.source = link::parse_endpoint(options.from);
  return settings;
}

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

void add_link_options(CLI::App& command, LinkOptions& options) {
  command
      .add_option_function<std::vector<std::string>>(
          "--link",
          [&options](const std::vector<std::string>& values) {
            options.serve = true;
            options.port = values;
          },
          "Let OpenIGTLink clients (3D Slicer, PLUS) see the session and move its probe; port, default 18944")
      ->expected(0, 1)
      ->type_name("[PORT]");
  command.add_option("--link-address", options.address, "Address to listen on; 0.0.0.0 lets the whole network in")
      ->capture_default_str();
  command.add_option("--link-from", options.from,
                     "HOST:PORT of an OpenIGTLink server (PLUS: 18944, 3D Slicer as server) whose ProbeToReference "
                     "and NeedleToReference are taken in");
  command.add_option("--link-image-hz", options.image_hz, "Most images a second for the clients")
      ->check(CLI::Range(0.1, 60.0))
      ->capture_default_str();
  command.add_option("--link-transform-hz", options.transform_hz, "Transforms a second for the clients")
      ->check(CLI::Range(1.0, 1000.0))
      ->capture_default_str();
}

LinkSession::LinkSession(const LinkOptions& options, const content::Scene& scene, const session::LiveSession& live,
                         const link::LinkInputs& inputs)
    : scene_(scene),
      live_(live),
      image_hz_(options.image_hz),
      address_(options.address),
      frame_(live.frames().make_frame()) {
  if (options.wanted()) link_.emplace(live.frames(), inputs, link_settings(options));
}

void LinkSession::start() {
  if (!link_) return;
  link_->start(live_.time_s());
  if (link_->port() == 0) return;
  fmt::print("OpenIGTLink: clients connect to {}\n", link::to_string({.host = address_, .port = link_->port()}));
  std::fflush(stdout);
}

void LinkSession::imaged(const state::FrameState& state, const ultrasound::SectorGeometry& sector,
                         const picture::Picture& bare) {
  const link::Clock::time_point now = link::Clock::now();
  if (!link_ || link_->clients() == 0 || now < next_image_) return;
  next_image_ = now + std::chrono::duration_cast<link::Clock::duration>(std::chrono::duration<double>(1 / image_hz_));
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

void LinkSession::pass_time(gpu::Device* device, const content::HeatedZone* zone) {
  if (!link_ || link_->clients() == 0 || device == nullptr) return std::this_thread::sleep_for(kPause);
  if (!scanner_) {
    scanner_.emplace(*device, scene_, scanner::ScannerConsole(scene_.probe));
    scanner_->watch(this);
  }
  // As in the window: a little behind, where there is a later state to interpolate to.
  const double time_s = live_.time_s();
  live_.frames().sample(time_s - 1.5 / scene_.rates.simulation_hz, frame_);
  scanner_->poll(time_s);
  scanner_->draw(frame_, zone);
  std::this_thread::sleep_until(next_image_);
}

std::vector<std::string> LinkSession::stop() {
  drop_scanner();
  return link_ ? link::summary(link_->stop()) : std::vector<std::string>{};
}

}  // namespace stylet::tools
