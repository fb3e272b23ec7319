#include "tools/bench/report.h"

#include "physics/tissue/blas.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <cmath>
#include <fstream>
#include <string_view>
#include <thread>
#include <utility>

namespace stylet::bench {

namespace {

/// Value of the first line "key : value" of a /proc file; empty if there is none.
std::string proc_value(const char* file, std::string_view key) {
  std::ifstream in(file);
  for (std::string line; std::getline(in, line);) {
    const auto colon = line.find(':');
    if (colon == std::string::npos || !std::string_view(line).starts_with(key)) continue;
    const auto start = line.find_first_not_of(" \t", colon + 1);
    return start == std::string::npos ? std::string() : line.substr(start);
  }
  return {};
}

std::string number(double value) {
  if (!std::isfinite(value)) return "not finite";
  const double size = std::abs(value);
  if (size != 0 && (size < 1e-3 || size >= 1e6)) return fmt::format("{:.3e}", value);
  return fmt::format("{:.4g}", value);
}

nlohmann::json finite_or_null(double value) {
  return std::isfinite(value) ? nlohmann::json(value) : nlohmann::json(nullptr);
}

}  // namespace

Measurement at_most(std::string name, double value, std::string unit, double bound, std::optional<double> reference) {
  return {std::move(name), value, std::move(unit), reference, "<= " + number(bound), value <= bound};
}

Measurement at_least(std::string name, double value, std::string unit, double bound,
                     std::optional<double> reference) {
  return {std::move(name), value, std::move(unit), reference, ">= " + number(bound), value >= bound};
}

Measurement within(std::string name, double value, std::string unit, double reference, double tolerance) {
  return {std::move(name),
          value,
          std::move(unit),
          reference,
          fmt::format("{} +- {}", number(reference), number(tolerance)),
          std::abs(value - reference) <= tolerance};
}

Measurement noted(Measurement measurement, std::string note) {
  measurement.note = std::move(note);
  return measurement;
}

void Report::append(const Report& other) {
  measurements.insert(measurements.end(), other.measurements.begin(), other.measurements.end());
  figures.insert(figures.end(), other.figures.begin(), other.figures.end());
}

int Report::missed() const {
  int count = 0;
  for (const Measurement& m : measurements) count += m.met == false ? 1 : 0;
  return count;
}

Machine this_machine(std::string build) {
  Machine machine;
  machine.processor = proc_value("/proc/cpuinfo", "model name");
  if (machine.processor.empty()) machine.processor = "unknown processor";
  machine.cores = static_cast<int>(std::thread::hardware_concurrency());
  const std::string kib = proc_value("/proc/meminfo", "MemTotal");
  machine.memory_gib = kib.empty() ? 0 : std::stod(kib) / (1 << 20);
  machine.build = std::move(build);
  machine.compiler = "g++ " __VERSION__;
  machine.flags = STYLET_BENCH_FLAGS;
  machine.blas = physics::single_threaded_blas().name;
  return machine;
}

std::string to_json(const Report& report) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const Measurement& m : report.measurements) {
    nlohmann::ordered_json entry;
    entry["name"] = m.name;
    entry["value"] = finite_or_null(m.value);
    entry["unit"] = m.unit;
    entry["reference"] = m.reference ? finite_or_null(*m.reference) : nlohmann::json(nullptr);
    entry["target"] = m.target.empty() ? nlohmann::json(nullptr) : nlohmann::json(m.target);
    entry["met"] = m.met ? nlohmann::json(*m.met) : nlohmann::json(nullptr);
    if (!m.note.empty()) entry["note"] = m.note;
    list.push_back(std::move(entry));
  }
  return list.dump(1) + "\n";
}

std::string to_table(const Report& report, const Machine& machine) {
  std::string text =
      fmt::format("machine   {}, {} cores, {:.0f} GiB\n", machine.processor, machine.cores, machine.memory_gib);
  text += fmt::format("build     {}, {}, {}\n", machine.build, machine.compiler, machine.flags);
  text += fmt::format("BLAS      {}\n\n", machine.blas);
  text += fmt::format("{:<52} {:>12} {:<8} {:>11} {:>9} {:>12}\n", "measurement", "value", "unit", "reference",
                      "ours/ref", "target");
  std::string group;
  for (const Measurement& m : report.measurements) {
    const std::string first = m.name.substr(0, m.name.find('.'));
    if (!group.empty() && first != group) text += "\n";
    group = first;
    const bool comparable = m.reference && *m.reference != 0;
    text += fmt::format("{:<52} {:>12} {:<8} {:>11} {:>9} {:>12}{}{}\n", m.name, number(m.value), m.unit,
                        m.reference ? number(*m.reference) : "",
                        comparable ? fmt::format("{:.3f}", m.value / *m.reference) : "", m.target,
                        m.met ? (*m.met ? "  met" : "  MISSED") : "", m.note.empty() ? "" : "  " + m.note);
  }
  int asked = 0;
  for (const Measurement& m : report.measurements) asked += m.met ? 1 : 0;
  text += fmt::format("\n{} of {} targets met, {} missed\n", asked - report.missed(), asked, report.missed());
  return text;
}

}  // namespace stylet::bench
