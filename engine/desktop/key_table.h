// Which key makes which command: the one table behind what the window does, the help on its screen and the README.
#pragma once

#include "engine/desktop/command.h"
#include "engine/view/input.h"

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace stylet::desktop {

enum class KeySection : std::uint8_t { session, needle, probe, scanner, panels, view };
inline constexpr std::array kKeySections{KeySection::session, KeySection::needle, KeySection::probe,
                                         KeySection::scanner, KeySection::panels, KeySection::view};

struct KeyBinding {
  view::Key key = view::Key::none;
  Command command;
  std::optional<Command> with_shift{};  ///< nothing: the same
};

/// Keys that belong together.
struct KeyLine {
  KeySection section = KeySection::session;
  std::vector<KeyBinding> keys{};
  const char* pointer = "";  ///< what of the mouse does it too
  const char* does = "";
  const char* shifted = "";  ///< what it does with Shift, where that is something else
  bool repeats = false;      ///< while a key is held
};
std::span<const KeyLine> key_table();

/// As the keyboard calls it: "Enter".
std::string key_of(CourseButton button);
std::string key_of(EndButton button);
std::string key_of_breath();
std::string key_of_sound();
/// A section for the screen: its name, then its keys and what they do.
std::vector<std::string> help_lines(KeySection section);
/// All of it for the README, a line each.
std::vector<std::string> key_table_in_markdown();

}  // namespace stylet::desktop
