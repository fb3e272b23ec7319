// Commands by name, as other programs send them: "gain" "+2", or the parameters of PLUS: "DepthMm" "=150".
#pragma once

#include "engine/scanner/command.h"
#include "engine/scanner/scanner_console.h"

#include <string>
#include <string_view>
#include <variant>

namespace stylet::scanner {

/// The problem that a name or a value has, in one line without either.
struct NotUnderstood {
  std::string why;
};

/// @param name   depth, focus (mm), gain, range, tgc1 ... tgc8 (dB), frequency (MHz), persistence, preset (clinical,
///               raw, or none for the other), freeze (on, off, or none), reset; of PLUS DepthMm, FrequencyMhz,
///               DynRangeDb, GainPercent of the gain's range, FocusDepthPercent of the depth. Capitals do not matter.
/// @param value  a number; a sign before it turns the knob by so much, "=" before that sets it: "=-6"
std::variant<Command, NotUnderstood> named_command(std::string_view name, std::string_view value,
                                                   const ScannerConsole& console);

}  // namespace stylet::scanner
