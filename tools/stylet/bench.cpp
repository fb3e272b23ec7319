// `stylet bench`: measurements of this machine and build, beside published figures and the bounds asked for.
#include "engine/app/build_name.h"
#include "engine/files/json_reader.h"
#include "engine/readers/scenario.h"
#include "tools/bench/competence.h"
#include "tools/bench/coupling.h"
#include "tools/bench/haptic.h"
#include "tools/bench/line_compliance.h"
#include "tools/bench/mechanics.h"
#include "tools/bench/paper.h"
#include "tools/bench/report.h"
#include "tools/bench/tissue.h"
#include "tools/bench/ultrasound.h"
#include "tools/bench/view.h"
#include "tools/stylet/commands.h"
#include "tools/stylet/interrupt.h"

#include <fmt/format.h>

#include <unistd.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>

namespace stylet::tools {

namespace {

namespace fs = std::filesystem;

struct Request {
  std::string name;
  std::string json;
  std::string out;
  std::string peer;
  bench::BenchOptions options;
};

struct Bench {
  const char* name;
  const char* summary;
  bench::Report (*run)(const bench::BenchOptions&);
};

constexpr std::array kBenches{
    Bench{"paper", "tables and figures of Martin, Zeng, Courtecuisse (IROS 2023) next to ours", bench::bench_paper},
    Bench{"coupling", "what the coupling stylet gains: smoothness, meshes, resistance, speed", bench::bench_coupling},
    Bench{"mechanics", "the physics outside its comfort: bevels, fast hands, organs, probe, latency, limits",
          bench::bench_mechanics},
    Bench{"tissue", "how right the tissue is, by element, and what that costs", bench::bench_tissue},
    Bench{"line-compliance", "sub-grid compliance against a resolved needle", bench::bench_line_compliance},
    Bench{"haptic", "a session with a mocked stylus: reports lost, latency, limits of the force",
          bench::bench_haptic},
    Bench{"ultrasound", "quality control of the image on a virtual phantom, and its speed", bench::bench_ultrasound},
    Bench{"competence", "sequential tests and fits of the skills lab: exact, published, simulated trainees",
          bench::bench_competence},
    Bench{"view", "what a picture of a session costs: window, stereo, ultrasound, pass by pass", bench::bench_view},
};

const Bench& find_bench(const std::string& name) {
  std::set<std::string> names;
  for (const Bench& bench : kBenches) {
    if (name == bench.name) return bench;
    names.insert(bench.name);
  }
  const std::string close = files::nearest(name, names);
  throw std::runtime_error(fmt::format(
      "there is no bench {}; {}", name,
      close.empty() ? fmt::format("there are: {}", fmt::join(names, ", ")) : fmt::format("did you mean {}?", close)));
}

void run_bench(Request request) {
  if (request.name.empty()) {
    for (const Bench& bench : kBenches) fmt::print("{:<16} {}\n", bench.name, bench.summary);
    return;
  }
  const Bench& bench = find_bench(request.name);
  // Everything that can be refused is refused before minutes of measuring.
  if (!request.out.empty()) fs::create_directories(request.out);
  if (!request.json.empty()) {
    const fs::path file = fs::absolute(request.json);
    const fs::path written = fs::exists(file) ? file : file.parent_path();
    if (fs::is_directory(file) || ::access(written.c_str(), W_OK) != 0) {
      throw std::runtime_error(request.json + ": cannot be written; name a file in an existing folder");
    }
  }
  const bench::Machine machine = bench::this_machine(app::build_name());
  request.options.reference_insertion = readers::content_directory() / "reference" / "r1.json";
  request.options.out = request.out;
  request.options.sofa_style_peer = request.peer == "sofa-style";
  let_interrupts_kill();  // minutes of measuring without a place to ask; plots and numbers are written at their end
  const bench::Report report = bench.run(request.options);
  fmt::print("{}", bench::to_table(report, machine));
  if (!request.out.empty() && !report.figures.empty()) {
    const fs::path page = fs::path(request.out) / "report.html";
    bench::write_page(page, fmt::format("stylet bench {}", request.name), report, machine);
    fmt::print("page      {}\n", page.string());
  }
  if (request.json.empty()) return;
  std::ofstream json(request.json);
  json << bench::to_json(report);
  json.close();
  if (!json) throw std::runtime_error(request.json + ": could not be written whole; is the disk full?");
}

}  // namespace

void add_bench(CLI::App& app, int& /*exit_code*/) {
  CLI::App* command = app.add_subcommand("bench", "Measure, next to published figures and the targets set");
  auto request = std::make_shared<Request>();
  std::string names;
  for (const Bench& bench : kBenches) names += names.empty() ? bench.name : fmt::format(",{}", bench.name);
  command->add_option("NAME", request->name, "Which bench; without it they are listed")->type_name("{" + names + "}");
  command->add_option("--json", request->json,
                      "Write the numbers as a list of {name, value, unit, reference, target, met}");
  command->add_option("--out", request->out, "Folder for plots (PNG), data (CSV) and, of ultrasound, a report page");
  command->add_option("--peer", request->peer, "Also do the work as another simulator does: sofa-style")
      ->check(CLI::IsMember({"sofa-style"}));
  auto* kind = command
                   ->add_option("--device-kind", request->options.device_kind,
                                "Of haptic: which kind of mocked device leads the session")
                   ->check(CLI::IsMember({"hid", "haply", "force_dimension", "openhaptics"}))
                   ->capture_default_str();
  command->add_option("--part", request->options.part,
                      "Of coupling, mechanics, tissue: one part alone; '?' lists them");
  command->add_flag("--quick", request->options.quick,
                    "Short runs and small meshes: a check that it works, not a result");
  command->add_flag("--full", request->options.full, "Also the largest mesh (50,653 nodes): minutes more");
  command->footer(
      "Prints machine, compiler, flags and commit, then every number. A missed target says MISSED.\n"
      "Leave the machine alone meanwhile: other work shows in the maxima.\n"
      "Exit code 0: measured, whatever came out.");
  command->callback([request, kind] {
    if (!kind->empty() && request->name != "haptic")
      throw CLI::ValidationError("--device-kind", "is of the bench haptic alone");
    constexpr std::array kOfParts{"coupling", "mechanics", "tissue"};
    if (!request->options.part.empty() && std::ranges::find(kOfParts, request->name) == kOfParts.end())
      throw CLI::ValidationError("--part", "is of the benches coupling, mechanics and tissue");
    run_bench(*request);
  });
}

}  // namespace stylet::tools
