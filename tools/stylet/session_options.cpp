#include "tools/stylet/session_options.h"

#include "engine/app/stylus.h"
#include "engine/link/link_error.h"

#include <fmt/format.h>

#include <charconv>
#include <cmath>
#include <string>
#include <system_error>

namespace stylet::tools {

namespace {

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

}  // namespace

std::string device_help(const std::string& otherwise) {
  return fmt::format("Stylus: {}; default: {}", app::stylus_help(), otherwise);
}

CLI::Validator seconds_above_zero() {
  return {[](std::string& text) {
            double seconds = 0;
            const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), seconds);
            const bool number = error == std::errc{} && end == text.data() + text.size();
            return number && seconds > 0 && std::isfinite(seconds)
                       ? std::string{}
                       : fmt::format("{} is no time; give seconds above 0, such as 30", text);
          },
          "above 0"};
}

void add_scanner_options(CLI::App& command, app::ScannerSettings& settings) {
  command
      .add_option("--us-preset", settings.preset,
                  "Ultrasound: clinical (compounded, textured) or raw (one look, nothing added); default: the "
                  "probe's")
      ->check(CLI::IsMember({"clinical", "raw"}));
  command.add_option("--us-depth-mm", settings.depth_mm, "Depth of the ultrasound image; default: the probe's");
  command.add_option("--us-gain-db", settings.gain_db, "Gain of the ultrasound image; default: the probe's");
}

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

app::SessionLinkSettings link_settings(const LinkOptions& options) {
  app::SessionLinkSettings settings{.image_hz = options.image_hz, .transform_hz = options.transform_hz};
  if (options.serve) settings.listen = listening_endpoint(options);
  if (!options.from.empty()) settings.source = link::parse_endpoint(options.from);
  return settings;
}

}  // namespace stylet::tools
