// Which key asks for what: the table that the window, its help and the README share.
#include "engine/desktop/input_commands.h"
#include "engine/desktop/key_table.h"
#include "engine/desktop/replay_keys.h"
#include "engine/procedures/ablation/heating.h"
#include "engine/procedures/biopsy/biopsy.h"
#include "engine/scanner/scanner_console.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <set>
#include <sstream>
#include <string>

namespace stylet::desktop {
namespace {

using view::Key;

constexpr double kDegree = M_PI / 180;

template <typename Part>
Part asked(const view::Stroke& stroke) {
  const std::optional<Command> command = command_of(stroke);
  EXPECT_TRUE(command && std::holds_alternative<Part>(*command)) << view::key_name(stroke.key);
  return command && std::holds_alternative<Part>(*command) ? std::get<Part>(*command) : Part{};
}

content::ProbeMove probe_move(const view::Stroke& stroke) {
  const auto command = asked<session::ProbeCommand>(stroke);
  EXPECT_TRUE(std::holds_alternative<content::ProbeMove>(command)) << view::key_name(stroke.key);
  return std::get<content::ProbeMove>(command);
}

TEST(Keys, EachKeyHasOneCommand) {
  std::set<Key> seen;
  for (const KeyLine& line : key_table()) {
    for (const KeyBinding& binding : line.keys) {
      EXPECT_TRUE(seen.insert(binding.key).second) << view::key_name(binding.key) << " is bound twice";
      EXPECT_NE(view::key_name(binding.key), "");
      EXPECT_EQ(binding.with_shift.has_value(),
                *line.shifted != '\0' || (line.section == KeySection::scanner && line.repeats))
          << view::key_name(binding.key) << ": the help says whether Shift does something else";
    }
  }
  EXPECT_FALSE(command_of({.key = Key::z}).has_value());
  EXPECT_FALSE(command_of({.key = Key::none}).has_value());
}

TEST(Keys, TurnKnobsUpAndWithShiftDown) {
  scanner::ScannerConsole console{content::Probe{}};
  const ultrasound::ScannerControls first = console.controls();
  for (const Key key : {Key::d, Key::g, Key::f, Key::m, Key::b, Key::v, Key::digit_1, Key::digit_4}) {
    console.apply(asked<scanner::Command>({.key = key, .shift = true}));
    EXPECT_NE(console.controls(), first) << view::key_name(key);
    console.apply(asked<scanner::Command>({.key = key}));
    const ultrasound::ScannerControls& now = console.controls();
    EXPECT_NEAR(now.depth, first.depth, 1e-12);
    EXPECT_NEAR(now.gain_db + now.tgc_db[0] + now.tgc_db[3], 0, 1e-12);
    EXPECT_NEAR(now.focus, first.focus, 1e-12);
    EXPECT_NEAR(now.frequency_hz, first.frequency_hz, 1e-3);
    EXPECT_NEAR(now.dynamic_range_db, first.dynamic_range_db, 1e-12);
    EXPECT_NEAR(now.persistence, first.persistence, 1e-12);
  }
  EXPECT_EQ(console.slider(), 3);
  console.apply(asked<scanner::Command>({.key = Key::g}));
  EXPECT_EQ(console.controls().gain_db, first.gain_db + 2);
  console.apply(asked<scanner::Command>({.key = Key::d, .repeated = true}));
  EXPECT_NEAR(console.controls().depth, first.depth + 0.01, 1e-12);
}

TEST(Keys, MoveTheProbeAndAHeldKeySwitchesNothing) {
  EXPECT_NEAR(probe_move({.key = Key::left}).lateral, -0.002, 1e-12);
  EXPECT_NEAR(probe_move({.key = Key::left, .repeated = true}).lateral, -0.002, 1e-12);
  EXPECT_NEAR(probe_move({.key = Key::up, .shift = true}).tilt, 2 * kDegree, 1e-12);
  EXPECT_NEAR(probe_move({.key = Key::right, .shift = true}).rock, 2 * kDegree, 1e-12);
  EXPECT_NEAR(probe_move({.key = Key::down}).elevation, -0.002, 1e-12);
  EXPECT_NEAR(probe_move({.key = Key::page_down}).press, 0.001, 1e-12);
  EXPECT_NEAR(probe_move({.key = Key::page_up, .shift = true}).twist, -2 * kDegree, 1e-12);
  EXPECT_TRUE(std::holds_alternative<session::ReleaseProbe>(asked<session::ProbeCommand>({.key = Key::home})));
  for (const Key key : {Key::space, Key::p, Key::c, Key::h, Key::q, Key::enter, Key::t, Key::x, Key::tab}) {
    EXPECT_TRUE(command_of({.key = key}).has_value()) << view::key_name(key);
    EXPECT_TRUE(command_of({.key = key, .shift = true}).has_value()) << view::key_name(key);
    EXPECT_FALSE(command_of({.key = key, .repeated = true}).has_value()) << view::key_name(key);
  }
}

TEST(Keys, LeadTheNeedle) {
  const auto move = [](Key key, bool shift = false) {
    return asked<haptic::NeedleMove>({.key = key, .shift = shift});
  };
  EXPECT_NEAR(move(Key::w).advance_m, 0.002, 1e-12);
  EXPECT_NEAR(move(Key::s, true).advance_m, -0.0005, 1e-12);
  EXPECT_NEAR(move(Key::j).right_m, -0.002, 1e-12);
  EXPECT_NEAR(move(Key::i).up_m, 0.002, 1e-12);
  EXPECT_NEAR(move(Key::k, true).tilt_up_rad, -2 * kDegree, 1e-12);
  EXPECT_NEAR(move(Key::l, true).tilt_right_rad, 2 * kDegree, 1e-12);
  EXPECT_NEAR(move(Key::a).twist_rad, 15 * kDegree, 1e-12);
  EXPECT_NEAR(move(Key::e, true).twist_rad, -15 * kDegree, 1e-12);
}

TEST(Pointer, MovesNeedleProbeAndCamera) {
  EXPECT_TRUE(commands_of({}).empty());
  view::Input input{.drag_x = 0.1, .drag_y = 0.2, .orbit_x = 0.5, .advance = 2, .zoom = 1, .slide_x = 0.3};
  std::vector<Command> commands = commands_of(input);
  ASSERT_EQ(commands.size(), 3U);
  const auto& move = std::get<haptic::NeedleMove>(commands[0]);
  EXPECT_NEAR(move.right_m, 0.01, 1e-12);
  EXPECT_NEAR(move.up_m, -0.02, 1e-12);
  EXPECT_NEAR(move.advance_m, 0.004, 1e-12);
  const auto& orbit = std::get<view::Orbit>(std::get<view::CameraCommand>(commands[1]));
  EXPECT_NEAR(orbit.yaw, 1.5, 1e-12);
  EXPECT_NEAR(orbit.zoom, 0.9, 1e-12);
  const auto& slide = std::get<content::ProbeMove>(std::get<session::ProbeCommand>(commands[2]));
  EXPECT_NEAR(slide.lateral, 0.03, 1e-12);
  input.shift = true;
  commands = commands_of(input);
  EXPECT_NEAR(std::get<haptic::NeedleMove>(commands[0]).tilt_right_rad, 0.15, 1e-12);
  EXPECT_EQ(std::get<haptic::NeedleMove>(commands[0]).right_m, 0);
}

TEST(CourseButtons, DoWhatCanBeDoneNow) {
  using training::Action;
  training::FlowState state{.possible = {Action::start}};
  EXPECT_EQ(action_of(CourseButton::next, state), Action::start);
  state.trigger = procedures::biopsy::kFire;
  EXPECT_EQ(action_of(CourseButton::sample, state), procedures::biopsy::kFire);
  EXPECT_EQ(action_of(CourseButton::pause, state), Action::pause);
  EXPECT_EQ(action_of(CourseButton::again, state), Action::reset);
  state.possible = {Action::finish, procedures::ablation::kStart};
  state.trigger = procedures::ablation::kStart;
  state.paused = true;
  EXPECT_EQ(action_of(CourseButton::next, state), Action::finish);
  EXPECT_EQ(action_of(CourseButton::sample, state), procedures::ablation::kStart);
  EXPECT_EQ(action_of(CourseButton::pause, state), Action::resume);
  state.trigger = procedures::ablation::kStop;
  EXPECT_EQ(action_of(CourseButton::sample, state), procedures::ablation::kStop);
  EXPECT_EQ(key_of(CourseButton::next), "Enter");
  EXPECT_EQ(key_of(CourseButton::again), "Backspace");
}

TEST(Keys, TheReadmeHasTheirTable) {
  std::ifstream file(STYLET_SOURCE_DIR "/README.md");
  std::stringstream readme;
  readme << file.rdbuf();
  std::string table;
  for (const std::string& line : key_table_in_markdown()) table += line + "\n";
  EXPECT_NE(readme.str().find("\n" + table), std::string::npos) << "README.md, A session, is to have\n" << table;
}

TEST(Keys, TheHelpNamesEveryOne) {
  std::string help;
  for (const KeySection section : kKeySections) {
    for (const std::string& line : help_lines(section)) help += line + "\n";
  }
  for (const KeyLine& line : key_table()) EXPECT_NE(help.find(line.does), std::string::npos) << line.does;
  for (const char* keys :
       {"Enter  start", "W, S or wheel  in, out; with Shift by half millimetres", "arrows or middle", "1 to 8  TGC",
        "Page Down, Page Up  press", "Ctrl and wheel  nearer"}) {
    EXPECT_NE(help.find(keys), std::string::npos) << keys << "\n" << help;
  }
}

TEST(ReplayKeys, SpacePausesOnceAKeyIsHeld) {
  EXPECT_TRUE(std::holds_alternative<debrief::Pause>(*playback_command_of({.key = Key::space})));
  EXPECT_FALSE(playback_command_of({.key = Key::space, .repeated = true}).has_value());
}

TEST(ReplayKeys, SeekAndChangeTheSpeed) {
  debrief::Playback playback(1, 3, 1);
  const auto press = [&](const view::Stroke& stroke) { playback.apply(playback_command_of(stroke).value()); };
  press({.key = Key::right});
  press({.key = Key::right, .shift = true});
  EXPECT_DOUBLE_EQ(playback.time_s(), 2.1);
  for (int i = 0; i < 5; ++i) press({.key = Key::right, .repeated = true});
  EXPECT_DOUBLE_EQ(playback.time_s(), 3);
  press({.key = Key::left});
  EXPECT_DOUBLE_EQ(playback.time_s(), 2);
  press({.key = Key::home});
  EXPECT_DOUBLE_EQ(playback.time_s(), 1);
  press({.key = Key::end});
  EXPECT_DOUBLE_EQ(playback.time_s(), 3);
  press({.key = Key::minus});
  press({.key = Key::pad_minus});
  EXPECT_DOUBLE_EQ(playback.speed(), 0.25);
  press({.key = Key::equal});
  press({.key = Key::pad_plus});
  EXPECT_DOUBLE_EQ(playback.speed(), 1);
  EXPECT_FALSE(playback_command_of({.key = Key::t}).has_value());
}

}  // namespace
}  // namespace stylet::desktop
