#include "engine/desktop/key_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <numbers>

namespace stylet::desktop {
namespace {

using content::ProbeMove;
using haptic::NeedleMove;
using view::Key;

// One press of a key that moves needle or probe; those of knobs are the scanner's.
constexpr double kAdvance = 0.002;  // m
constexpr double kFine = 0.0005;
constexpr double kSideways = 0.002;
constexpr double kSlide = 0.002;
constexpr double kPress = 0.001;
constexpr double kTurn = 2 * std::numbers::pi / 180;
constexpr double kTwist = 15 * std::numbers::pi / 180;

constexpr std::size_t kHelpWidth = 64;  // characters

KeyBinding lead(Key key, const NeedleMove& plain, const NeedleMove& with_shift) {
  return {key, plain, with_shift};
}

KeyBinding slide(Key key, const ProbeMove& plain, const ProbeMove& with_shift) {
  return {key, session::ProbeCommand(plain), session::ProbeCommand(with_shift)};
}

/// Up, with Shift down.
KeyBinding knob(Key key, const scanner::Command& up, const scanner::Command& down) {
  return {key, up, down};
}

std::vector<KeyBinding> tgc_sliders() {
  std::vector<KeyBinding> keys;
  for (int i = 0; i < ultrasound::kTgcSliders; ++i) {
    keys.push_back(knob(Key::digit_1 + i, scanner::SetTgc{i, scanner::kTgcStep, true},
                        scanner::SetTgc{i, -scanner::kTgcStep, true}));
  }
  return keys;
}

KeyBinding press(Key key, const scanner::Command& command) {
  return {key, command};
}

void add_session(std::vector<KeyLine>& table) {
  const auto section = KeySection::session;
  table.insert(table.end(), {{section, {{Key::enter, CourseButton::next}}, "", "start, finish"},
                             {section, {{Key::t, CourseButton::sample}}, "", "fire, heat or draw"},
                             {section, {{Key::f8, HoldBreath{}}}, "", "patient holds the breath, breathes on"},
                             {section, {{Key::f7, ToggleSound{}}}, "", "sound off, on"},
                             {section, {{Key::x, CourseButton::pause}}, "", "pause, go on"},
                             {section, {{Key::backspace, CourseButton::again}}, "", "try again"},
                             {section, {{Key::q, EndSession{}}}, "", "end of the session"},
                             {section, {{Key::o, EndButton::debrief}}, "", "afterwards open the debrief"},
                             {section, {{Key::n, EndButton::next}}, "", "next scenario"},
                             {section, {{Key::f9, EndButton::film}}, "", "make a film"}});
}

void add_needle(std::vector<KeyLine>& table) {
  const auto section = KeySection::needle;
  table.push_back({.section = section,
                   .keys = {lead(Key::w, {.advance_m = kAdvance}, {.advance_m = kFine}),
                            lead(Key::s, {.advance_m = -kAdvance}, {.advance_m = -kFine})},
                   .pointer = "wheel",
                   .does = "in, out",
                   .shifted = "by half millimetres",
                   .repeats = true});
  table.push_back({.section = section,
                   .keys = {lead(Key::i, {.up_m = kSideways}, {.tilt_up_rad = kTurn}),
                            lead(Key::j, {.right_m = -kSideways}, {.tilt_right_rad = -kTurn}),
                            lead(Key::k, {.up_m = -kSideways}, {.tilt_up_rad = -kTurn}),
                            lead(Key::l, {.right_m = kSideways}, {.tilt_right_rad = kTurn})},
                   .pointer = "left button",
                   .does = "sideways",
                   .shifted = "tilt",
                   .repeats = true});
  table.push_back({.section = section,
                   .keys = {{Key::a, NeedleMove{.twist_rad = kTwist}}, {Key::e, NeedleMove{.twist_rad = -kTwist}}},
                   .does = "turn the bevel",
                   .repeats = true});
}

void add_probe(std::vector<KeyLine>& table) {
  const auto section = KeySection::probe;
  table.push_back({.section = section,
                   .keys = {slide(Key::left, {.lateral = -kSlide}, {.rock = -kTurn}),
                            slide(Key::right, {.lateral = kSlide}, {.rock = kTurn}),
                            slide(Key::up, {.elevation = kSlide}, {.tilt = kTurn}),
                            slide(Key::down, {.elevation = -kSlide}, {.tilt = -kTurn})},
                   .pointer = "middle button",
                   .does = "slide",
                   .shifted = "rock, tilt",
                   .repeats = true});
  table.push_back({.section = section,
                   .keys = {slide(Key::page_down, {.press = kPress}, {.twist = kTurn}),
                            slide(Key::page_up, {.press = -kPress}, {.twist = -kTurn})},
                   .does = "press, lift",
                   .shifted = "turn",
                   .repeats = true});
  table.push_back({.section = section,
                   .keys = {{Key::home, session::ProbeCommand(session::ReleaseProbe{})}},
                   .does = "back to where it was at first"});
}

void add_scanner(std::vector<KeyLine>& table) {
  using namespace scanner;
  const auto add = [&](std::vector<KeyBinding> keys, const char* does) {
    table.push_back({.section = KeySection::scanner, .keys = std::move(keys), .does = does, .repeats = true});
  };
  add({knob(Key::d, SetDepth{kDepthStep, true}, SetDepth{-kDepthStep, true})}, "depth");
  add({knob(Key::g, SetGain{kGainStep, true}, SetGain{-kGainStep, true})}, "gain");
  add({knob(Key::f, SetFocus{kFocusStep, true}, SetFocus{-kFocusStep, true})}, "focus");
  add({knob(Key::m, SetFrequency{kFrequencyStep, true}, SetFrequency{-kFrequencyStep, true})}, "frequency");
  add({knob(Key::b, SetDynamicRange{kDynamicRangeStep, true}, SetDynamicRange{-kDynamicRangeStep, true})},
      "dynamic range");
  add({knob(Key::v, SetPersistence{kPersistenceStep, true}, SetPersistence{-kPersistenceStep, true})}, "persistence");
  add(tgc_sliders(), "TGC sliders, nearest first");
  const auto add_switch = [&](Key key, const scanner::Command& command, const char* does) {
    table.push_back({.section = KeySection::scanner, .keys = {press(key, command)}, .does = does});
  };
  add_switch(Key::digit_0, LevelTgc{}, "TGC level");
  add_switch(Key::p, SetPreset{}, "preset clinical / raw");
  add_switch(Key::space, Freeze{}, "freeze");
  add_switch(Key::c, Reset{}, "knobs as at first");
  table.push_back({.section = KeySection::scanner, .pointer = "left button on its image", .does = "measure"});
  table.push_back({.section = KeySection::scanner,
                   .keys = {{Key::u, scanner::Command(RemoveMeasure{}), scanner::Command(RemoveMeasure{true})}},
                   .does = "take the last measure away",
                   .shifted = "all"});
  add_switch(Key::f12, SaveImage{}, "save the image");
}

void add_panels(std::vector<KeyLine>& table) {
  const auto section = KeySection::panels;
  table.insert(table.end(),
               {{section, {{Key::tab, PanelCommand::toggle_all}}, "", "all of them"},
                {section, {{Key::f2, PanelCommand::toggle_force}}, "", "force"},
                {section, {{Key::f3, PanelCommand::toggle_scanner}}, "", "scanner's knobs"},
                {section, {{Key::f4, PanelCommand::toggle_instructor}}, "", "instructor"},
                {section, {{Key::f5, PanelCommand::next_patient_view}}, "", "patient closed, opened, transparent"},
                {section, {{Key::f6, PanelCommand::toggle_figures}}, "", "frames a second, delays"},
                {section, {{Key::f10, PanelCommand::other_hand}}, "", "left-handed: mirrored"},
                {section, {{Key::h, PanelCommand::toggle_help}}, "", "keys"}});
}

void add_view(std::vector<KeyLine>& table) {
  const auto section = KeySection::view;
  table.insert(table.end(), {{section, {}, "right button", "turn"},
                             {section, {}, "Ctrl and wheel", "nearer"},
                             {section, {{Key::r, view::CameraCommand(view::ResetCamera{})}}, "", "put it back"}});
}

std::vector<KeyLine> make_table() {
  std::vector<KeyLine> table;
  add_session(table);
  add_needle(table);
  add_probe(table);
  add_scanner(table);
  add_panels(table);
  add_view(table);
  return table;
}

const char* name(KeySection section) {
  switch (section) {
    case KeySection::session:
      return "Session";
    case KeySection::needle:
      return "Needle";
    case KeySection::probe:
      return "Probe on the skin";
    case KeySection::scanner:
      return "Scanner, with Shift less";
    case KeySection::panels:
      return "Panels";
    case KeySection::view:
      return "3-D view";
  }
  return "";
}

/// "W, S or wheel", "1 to 8", "arrows".
std::string keys_of(const KeyLine& line) {
  std::string text;
  if (line.keys.size() == ultrasound::kTgcSliders) {
    text = view::key_name(line.keys.front().key) + " to " + view::key_name(line.keys.back().key);
  } else if (!line.keys.empty() && line.keys.front().key == Key::left) {
    text = "arrows";
  } else {
    for (const KeyBinding& binding : line.keys) text += (text.empty() ? "" : ", ") + view::key_name(binding.key);
  }
  const std::string pointer = line.pointer;
  return text + (text.empty() || pointer.empty() ? "" : " or ") + pointer;
}

std::string what(const KeyLine& line) {
  const std::string shifted = line.shifted;
  return line.does + (shifted.empty() ? "" : "; with Shift " + shifted);
}

}  // namespace

std::span<const KeyLine> key_table() {
  static const std::vector<KeyLine> table = make_table();
  return table;
}

namespace {

template <typename Button>
std::string key_of_button(Button button) {
  for (const KeyLine& line : key_table()) {
    for (const KeyBinding& binding : line.keys) {
      if (const auto* bound = std::get_if<Button>(&binding.command); bound != nullptr && *bound == button) {
        return view::key_name(binding.key);
      }
    }
  }
  return "";
}

}  // namespace

std::string key_of(CourseButton button) {
  return key_of_button(button);
}

std::string key_of(EndButton button) {
  return button == EndButton::leave ? "Q" : key_of_button(button);
}

std::string key_of_breath() {
  return view::key_name(Key::f8);
}

std::string key_of_sound() {
  return view::key_name(Key::f7);
}

std::vector<std::string> help_lines(KeySection section) {
  std::vector<std::string> lines{name(section)};
  for (const KeyLine& line : key_table()) {
    if (line.section != section) continue;
    const std::string entry = fmt::format("{}  {}", keys_of(line), what(line));
    const bool fits = lines.size() > 1 && lines.back().size() + entry.size() + 5 <= kHelpWidth;
    if (fits) {
      lines.back() += "     " + entry;
    } else {
      lines.push_back(entry);
    }
  }
  return lines;
}

std::vector<std::string> key_table_in_markdown() {
  std::vector<std::string> rows{"| | keys |", "|---|---|"};
  for (const KeySection section : kKeySections) {
    std::string entries;
    for (const KeyLine& line : key_table()) {
      if (line.section != section) continue;
      entries += fmt::format("{}**{}** {}", entries.empty() ? "" : " · ", keys_of(line), what(line));
    }
    rows.push_back(fmt::format("| {} | {} |", name(section), entries));
  }
  return rows;
}

}  // namespace stylet::desktop
