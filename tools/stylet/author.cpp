// `stylet author`: a scenario edited with the mouse.
#include "engine/app/author_window.h"
#include "tools/stylet/commands.h"
#include "tools/stylet/terminal.h"

#include <memory>

namespace stylet::tools {

void add_author(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("author", "Edit a scenario with the mouse: target, entry, probe, camera");
  auto settings = std::make_shared<app::AuthorSettings>();
  command->add_option("SCENARIO", settings->scenario, "A scenario's file (edit a copy of a shipped one)")->required();
  command->add_option("--gpu", settings->gpu, "Part of the name of the GPU that draws");
  command->add_option("--language", settings->language, "Of the window: en, de; default: that of the environment");
  command->footer(
      "A window with the patient, the first ultrasound image (live) and a panel:\n"
      "  1  target      click an organ, or a place in the ultrasound image; Shift: the organ itself is the target;\n"
      "                 wheel: deeper along the view; + and -: larger, smaller\n"
      "                 Tab: the next target, where there are several\n"
      "  2  entry       click the skin; the recorded motion is made anew, in a file of its own\n"
      "  3  probe       drag over the skin: its image holds target and entry\n"
      "  4  forbidden   click an organ; once more takes it off the list\n"
      "  C              the camera starts where it is now (right button turns, Ctrl and wheel goes nearer)\n"
      "  Ctrl Z, Ctrl Shift Z  undo, redo      S  save and check      Q  leave\n"
      "Problems are marked where they are: what can be seen at once always, what `stylet validate` says after a "
      "save.\n"
      "Saving changes the values that were edited and no other byte of the file; what another program has changed\n"
      "meanwhile is not written over, and what is not saved when the window is closed is kept beside the file.\n"
      "Example:\n"
      "  cp -r content my_content && stylet author my_content/scenarios/liver_biopsy.json\n"
      "Exit code 0: the scenario is sound; 2: it has problems.");
  command->callback([settings, &exit_code] {
    Terminal terminal;
    exit_code = app::author_scenario(*settings, terminal) ? kExitYes : kExitBadInput;
  });
}

}  // namespace stylet::tools
