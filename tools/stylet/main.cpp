// The `stylet` command.
#include "engine/app/observer.h"
#include "engine/files/json_scan.h"
#include "physics/tissue/blas.h"
#include "tools/stylet/commands.h"
#include "tools/stylet/interrupt.h"
#include "tools/stylet/refusal.h"
#include "tools/stylet/shell.h"
#include "tools/stylet/version.h"

#include <unistd.h>

#include <CLI/CLI.hpp>

#include <cstdio>
#include <cstdlib>
#include <exception>
#include <new>
#include <string>

namespace {

constexpr const char* kDescription =
    "Stylet: an immersive training simulator for needle procedures.\n"
    "A flexible needle, driven by a haptic stylus, goes into a deforming abdomen; it is seen in 3-D and in "
    "ultrasound,\n"
    "and felt at 1 kHz. Research and training software, not a medical device.";

constexpr const char* kFooter =
    "Start here:\n"
    "  stylet                                          on a desktop: choose scenario, stylus and view in a menu\n"
    "  stylet train                                    list the scenarios\n"
    "  stylet train liver_biopsy                       lead the needle yourself; with no display a recorded motion "
    "does\n"
    "  stylet train liver_biopsy --device recorded --out out/demo   watch its recorded motion\n"
    "  stylet devices                                  what stylus is connected, and what it can do\n"
    "  stylet replay out/demo/session.rec              check that the recording replays bit for bit\n"
    "  stylet debrief out/demo --out out/debrief       write the debrief of a session again\n"
    "  stylet render liver_biopsy --out frames         deterministic PNG frames, no display needed\n"
    "  stylet import liver.stl --out organs            a mesh becomes an organ with tetrahedra\n"
    "  stylet author my_content/scenarios/liver_biopsy.json   edit a scenario with the mouse\n"
    "  stylet validate content/scenarios/liver_biopsy.json\n"
    "  stylet schema scenario                          the keys of a scenario\n"
    "  stylet lab list                                 who trained what; `stylet train NAME --trainee WHO` keeps it\n"
    "  stylet course run needle_basics --trainee ada   the exercise that ada is due\n"
    "  stylet bench paper                              the paper's tables and figures next to ours\n"
    "`stylet COMMAND --help` explains a command.";

/// OpenBLAS reads what kernels to take once, while it is loaded.
void restart_with_newer_kernels(char** argv) {
  constexpr const char* kChoice = "OPENBLAS_CORETYPE";
  if (std::getenv(kChoice) != nullptr) return;
  setenv(kChoice, "Haswell", 1);
  execv("/proc/self/exe", argv);  // comes back only where it cannot: right all the same, and slower
}

int run(int argc, char** argv) {
  using namespace stylet;
  if (physics::single_threaded_blas().outdated_kernels) restart_with_newer_kernels(argv);
  CLI::App app(kDescription, "stylet");
  app.footer(kFooter);
  app.require_subcommand(0, 1);
  app.set_version_flag(
      "--version", [] { return tools::version_text(); }, "Versions, libraries, commit and licence");
  if (physics::single_threaded_blas().slow_reference) {
    std::fputs(
        "stylet: BLAS is the slow reference library, factorisations take 15 times longer; install "
        "libopenblas0-pthread\n",
        stderr);
  }
  tools::catch_interrupts();
  int exit_code = tools::kExitYes;
  tools::add_train(app, exit_code);
  tools::add_render(app, exit_code);
  tools::add_replay(app, exit_code);
  tools::add_debrief(app, exit_code);
  tools::add_import(app, exit_code);
  tools::add_author(app, exit_code);
  tools::add_validate(app, exit_code);
  tools::add_schema(app);
  tools::add_course(app, exit_code);
  tools::add_lab(app, exit_code);
  tools::add_devices(app);
  tools::add_bench(app, exit_code);
  tools::add_shell(app);
  if (tools::complete(app, argc, argv)) return tools::kExitYes;
  if (const std::string refused = argc > 1 ? tools::no_command(app, argv[1]) : ""; !refused.empty()) {
    std::fprintf(stderr, "stylet: %s\n", refused.c_str());
    return tools::kExitBadInput;
  }
  try {
    app.parse(argc, argv);
    if (app.get_subcommands().empty()) {
      if (const auto chosen = tools::run_menu()) return *chosen;
      std::fputs(app.help().c_str(), stdout);
    }
  } catch (const CLI::Success& help) {
    return app.exit(help);
  } catch (const CLI::ParseError& error) {
    std::fprintf(stderr, "stylet: %s\n", tools::refusal(app, error).c_str());
    return tools::kExitBadInput;
  } catch (const app::Stopped& end) {
    std::fprintf(stderr, "\nstylet: %s\n", end.what());
    return tools::kExitInterrupted;
  }
  return exit_code;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::bad_alloc&) {
    std::fputs("stylet: out of memory; close other programs or use a smaller scenario\n", stderr);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "stylet: %s\n", stylet::files::one_line(error.what()).c_str());
  }
  return stylet::tools::kExitBadInput;
}
