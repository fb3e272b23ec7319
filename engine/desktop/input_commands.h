// What mouse and keyboard ask for.
#pragma once

#include "engine/desktop/command.h"
#include "engine/view/input.h"

#include <optional>
#include <vector>

namespace stylet::desktop {

/// Nothing: the key means nothing, or nothing more while it is held.
std::optional<Command> command_of(const view::Stroke& stroke);
/// Of pointer and keys, in the order in which it is to be done.
std::vector<Command> commands_of(const view::Input& input);

}  // namespace stylet::desktop
