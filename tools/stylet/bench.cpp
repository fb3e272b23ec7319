// `stylet bench`: measurements of this machine and build, beside published figures and the bounds asked for.
#include "engine/content/scenario.h"
#include "tools/bench/coupling.h"
#include "tools/bench/line_compliance.h"
#include "tools/bench/paper.h"
#include "tools/bench/report.h"
#include "tools/stylet/commands.h"
#include "tools/stylet/version.h"

#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>

namespace stylet::tools {

namespace {

namespace fs = std::filesystem;

struct BenchOptions {
  std::string name;
  std::string json;
  std::string out;
  std::string peer;
  bool quick = false;
  bool full = false;
};

bench::Report run_paper(const BenchOptions& options) {
  return bench::bench_paper({.reference_insertion = content::content_directory() / "reference" / "r1.json",
                             .out = options.out,
                             .quick = options.quick,
                             .full = options.full,
                             .sofa_style_peer = options.peer == "sofa-style"});
}

bench::Report run_line_compliance(const BenchOptions& options) {
  return bench::bench_line_compliance({.reference_insertion = content::content_directory() / "reference" / "r1.json",
                                       .out = options.out,
                                       .quick = options.quick});
}

bench::Report run_coupling(const BenchOptions& options) {
  return bench::bench_coupling({.reference_insertion = content::content_directory() / "reference" / "r1.json",
                                .out = options.out,
                                .quick = options.quick});
}

struct Bench {
  const char* name;
  const char* summary;
  bench::Report (*run)(const BenchOptions&);
};

constexpr std::array kBenches{
    Bench{"paper", "tables and figures of Martin, Zeng, Courtecuisse (IROS 2023) next to ours", run_paper},
    Bench{"coupling", "what the coupling stylet gains: smoothness, meshes, resistance, speed", run_coupling},
    Bench{"line-compliance", "sub-grid compliance against a resolved needle", run_line_compliance},
};

const Bench& find_bench(const std::string& name) {
  std::string names;
  for (const Bench& bench : kBenches) {
    if (name == bench.name) return bench;
    names += names.empty() ? bench.name : fmt::format(", {}", bench.name);
  }
  throw std::runtime_error(fmt::format("there is no bench {}; there are: {}", name, names));
}

void run_bench(const BenchOptions& options) {
  if (options.name.empty()) {
    for (const Bench& bench : kBenches) fmt::print("{:<16} {}\n", bench.name, bench.summary);
    return;
  }
  const Bench& bench = find_bench(options.name);
  // Everything that can be refused is refused before minutes of measuring.
  if (!options.out.empty()) fs::create_directories(options.out);
  std::ofstream json;
  if (!options.json.empty()) {
    json.open(options.json);
    if (!json) throw std::runtime_error(options.json + ": cannot be written; name a file in an existing folder");
  }
  const bench::Machine machine = bench::this_machine(build_name());
  const bench::Report report = bench.run(options);
  fmt::print("{}", bench::to_table(report, machine));
  if (options.json.empty()) return;
  json << bench::to_json(report);
  json.close();
  if (!json) throw std::runtime_error(options.json + ": could not be written whole; is the disk full?");
}

}  // namespace

void add_bench(CLI::App& app, int& /*exit_code*/) {
  CLI::App* command = app.add_subcommand("bench", "Measure, next to published figures and the targets set");
  auto options = std::make_shared<BenchOptions>();
  command->add_option("NAME", options->name, "Which bench; without it they are listed");
  command->add_option("--json", options->json,
                      "Write the numbers as a list of {name, value, unit, reference, target, met}");
  command->add_option("--out", options->out, "Folder for plots (PNG) and data (CSV)");
  command->add_option("--peer", options->peer, "Also do the work as another simulator does: sofa-style")
      ->check(CLI::IsMember({"sofa-style"}));
  command->add_flag("--quick", options->quick, "Short runs and small meshes: a check that it works, not a result");
  command->add_flag("--full", options->full, "Also the largest mesh (50,653 nodes): minutes more");
  command->footer(
      "Prints machine, compiler, flags and commit, then every number. A missed target says MISSED.\n"
      "Leave the machine alone meanwhile: other work shows in the maxima.\n"
      "Exit code 0: measured, whatever came out.");
  command->callback([options] { run_bench(*options); });
}

}  // namespace stylet::tools
