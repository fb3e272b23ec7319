#include "engine/scanner/named_command.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <cmath>
#include <optional>

namespace stylet::scanner {
namespace {

constexpr const char* kNames =
    "the scanner has depth, gain, focus, frequency, range, persistence, tgc1 to tgc8, preset, freeze and reset; of "
    "PLUS DepthMm, GainPercent, FocusDepthPercent, FrequencyMhz and DynRangeDb";

struct Number {
  double value = 0;
  bool relative = false;
};

std::optional<Number> number_of(std::string_view text) {
  Number number;
  const bool absolute = text.starts_with('=');
  if (absolute) text.remove_prefix(1);
  const bool plus = text.starts_with('+');
  number.relative = !absolute && (plus || text.starts_with('-'));
  if (plus) text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number.value);
  if (error != std::errc{} || end != text.data() + text.size() || !std::isfinite(number.value)) return std::nullopt;
  return number;
}

/// A knob in a unit that people read: in SI it is at `scale` times that and `offset`.
struct NamedKnob {
  std::string_view name;
  double scale;
  double offset;
  Command (*set)(double si, bool relative);
};

template <typename Set>
constexpr auto kSet = [](double si, bool relative) -> Command {
  return Set{si, relative};
};

std::optional<Command> knob(std::string_view name, const Number& number, const ScannerConsole& console) {
  const ultrasound::ControlLimits::Range gain = ultrasound::ControlLimits::of(console.probe()).gain_db;
  const std::array knobs{
      NamedKnob{"depth", 1e-3, 0, kSet<SetDepth>},
      NamedKnob{"depthmm", 1e-3, 0, kSet<SetDepth>},
      NamedKnob{"gain", 1, 0, kSet<SetGain>},
      NamedKnob{"gainpercent", 0.01 * (gain.max - gain.min), gain.min, kSet<SetGain>},
      NamedKnob{"focus", 1e-3, 0, kSet<SetFocus>},
      NamedKnob{"focusdepthpercent", 0.01 * console.controls().depth, 0, kSet<SetFocus>},
      NamedKnob{"frequency", 1e6, 0, kSet<SetFrequency>},
      NamedKnob{"frequencymhz", 1e6, 0, kSet<SetFrequency>},
      NamedKnob{"range", 1, 0, kSet<SetDynamicRange>},
      NamedKnob{"dynrangedb", 1, 0, kSet<SetDynamicRange>},
      NamedKnob{"persistence", 1, 0, kSet<SetPersistence>},
  };
  for (const NamedKnob& knob : knobs) {
    if (knob.name != name) continue;
    return knob.set(knob.scale * number.value + (number.relative ? 0 : knob.offset), number.relative);
  }
  if (name.size() == 4 && name.starts_with("tgc") && name[3] >= '1' && name[3] < '1' + ultrasound::kTgcSliders) {
    return SetTgc{name[3] - '1', number.value, number.relative};
  }
  return std::nullopt;
}

std::optional<Command> switched(std::string_view name, std::string_view value) {
  if (value.starts_with('=')) value.remove_prefix(1);
  if (name == "preset" && value.empty()) return SetPreset{};
  if (name == "preset" && value == "clinical") return SetPreset{ultrasound::Preset::clinical};
  if (name == "preset" && value == "raw") return SetPreset{ultrasound::Preset::raw};
  if (name == "freeze" && value.empty()) return Freeze{};
  if (name == "freeze" && (value == "on" || value == "off")) return Freeze{value == "on"};
  if (name == "reset" && value.empty()) return Reset{};
  return std::nullopt;
}

std::string lower_case(std::string_view text) {
  std::string lower(text);
  std::ranges::transform(lower, lower.begin(), [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return lower;
}

}  // namespace

std::variant<Command, NotUnderstood> named_command(std::string_view name, std::string_view value,
                                                   const ScannerConsole& console) {
  const std::string lower = lower_case(name);
  if (const auto command = switched(lower, lower_case(value))) return *command;
  const std::optional<Number> number = number_of(value);
  const auto command = knob(lower, number.value_or(Number{}), console);
  if (!command) return NotUnderstood{kNames};
  if (!number) return NotUnderstood{"a knob wants a number, such as 12, +2 or =-6"};
  return *command;
}

}  // namespace stylet::scanner
