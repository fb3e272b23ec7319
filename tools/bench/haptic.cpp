#include "tools/bench/haptic.h"

#include "engine/files/child_process.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace stylet::bench {
namespace {

namespace fs = std::filesystem;

/// Waits for the end of a program.
void run_program(std::vector<std::string> command) {
  files::ChildProcess child(
      {.command = std::move(command), .input = STDIN_FILENO, .output = STDOUT_FILENO, .messages = STDERR_FILENO});
  if (child.wait() != 0) {
    throw std::runtime_error("bench haptic: the session with the mocked stylus did not get to its end");
  }
}

/// What to_json() wrote.
Report read_report(const fs::path& file) {
  std::ifstream in(file);
  Report report;
  for (const nlohmann::json& entry : nlohmann::json::parse(in)) {
    const auto number = [&](const char* key) {
      return entry.at(key).is_null() ? std::optional<double>() : entry.at(key).get<double>();
    };
    Measurement measurement;
    measurement.name = entry.at("name");
    measurement.value = number("value").value_or(std::numeric_limits<double>::quiet_NaN());
    measurement.unit = entry.at("unit");
    measurement.reference = number("reference");
    if (!entry.at("target").is_null()) measurement.target = entry.at("target");
    if (!entry.at("met").is_null()) measurement.met = entry.at("met").get<bool>();
    if (entry.contains("note")) measurement.note = entry.at("note");
    report.add(measurement);
  }
  return report;
}

}  // namespace

Report bench_haptic(const BenchOptions& options) {
  const bool hid = options.device_kind == "hid";
  const char* const name = hid ? "stylet_haptic_session" : "stylet_adapted_session";
  const fs::path program = fs::read_symlink("/proc/self/exe").parent_path() / name;
  if (!fs::exists(program)) {
    throw std::runtime_error(
        fmt::format("bench haptic: {} is not there; it is built with the tests (tools/test.sh, or cmake "
                    "-DBUILD_TESTING=ON and the target {})",
                    program.string(), name));
  }
  std::string folder = (fs::temp_directory_path() / "stylet-bench-XXXXXX").string();
  if (::mkdtemp(folder.data()) == nullptr) throw std::system_error(errno, std::generic_category(), folder);
  const fs::path json = fs::path(folder) / "report.json";
  Report report;
  try {
    const std::string seconds = options.quick ? "2" : "60";
    if (hid) {
      run_program({program.string(), seconds, json.string(), options.out.string()});
    } else {
      run_program({program.string(), options.device_kind, seconds, json.string()});
    }
    report = read_report(json);
  } catch (...) {
    fs::remove_all(folder);
    throw;
  }
  fs::remove_all(folder);
  if (hid && !options.out.empty()) {
    report.figures.push_back({"Latency",
                              "From a pose report of the device until the force that answers it is written.",
                              options.out / "haptic_latency.png"});
  }
  return report;
}

}  // namespace stylet::bench
