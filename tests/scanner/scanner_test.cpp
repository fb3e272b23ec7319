// The scanner of a running session: commands, screen, and a tissue table that is edited meanwhile.
#include "engine/gpu/device.h"
#include "engine/readers/tissue_watch.h"
#include "engine/scanner/live_scanner.h"
#include "engine/scanner/named_command.h"
#include "engine/scanner/scanner_screen.h"
#include "engine/view/offscreen.h"
#include "tests/support/temporary_folder.h"
#include "tests/ultrasound/phantom.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <string>

namespace stylet::scanner {
namespace {

TEST(ScannerConsole, CommandsTurnKnobsToAValueAndByOne) {
  ScannerConsole console{content::Probe{}};
  const ultrasound::ScannerControls first = console.controls();
  EXPECT_EQ(first.persistence, 0.3) << "the preset's";
  console.apply(SetDepth{0.12});
  console.apply(SetGain{-6});
  console.apply(SetGain{2, true});
  console.apply(SetFocus{0.01, true});
  console.apply(SetFrequency{3e6});
  console.apply(SetDynamicRange{-5, true});
  console.apply(SetPersistence{0.5});
  console.apply(SetTgc{3, 4});
  console.apply(SetTgc{3, -1, true});
  const ultrasound::ScannerControls& now = console.controls();
  EXPECT_EQ(now.depth, 0.12);
  EXPECT_EQ(now.gain_db, -4);
  EXPECT_NEAR(now.focus, first.focus + 0.01, 1e-12);
  EXPECT_EQ(now.frequency_hz, 3e6);
  EXPECT_EQ(now.dynamic_range_db, first.dynamic_range_db - 5);
  EXPECT_EQ(now.persistence, 0.5);
  EXPECT_EQ(now.tgc_db[3], 3);
  EXPECT_EQ(console.slider(), 3);
  EXPECT_EQ(console.limited(), "");
  console.apply(LevelTgc{});
  EXPECT_EQ(now.tgc_db[3], 0);
  console.apply(Reset{});
  EXPECT_EQ(console.controls(), first);
}

TEST(ScannerConsole, SaysWhatAKnobCannotDo) {
  ScannerConsole console{content::Probe{}};
  for (int i = 0; i < 6; ++i) {
    console.apply(SetFrequency{kFrequencyStep, true});
    EXPECT_EQ(console.limited(), "");
  }
  console.apply(SetFrequency{kFrequencyStep, true});
  EXPECT_EQ(console.limited(), "frequency limited to 5 MHz");
}

TEST(ScannerConsole, SwitchesGoToAStateOrToTheOther) {
  ScannerConsole console{content::Probe{}};
  console.apply(Freeze{});
  EXPECT_TRUE(console.frozen());
  console.apply(Freeze{true});
  EXPECT_TRUE(console.frozen());
  console.apply(Freeze{});
  EXPECT_FALSE(console.frozen());
  console.apply(SetPreset{});
  EXPECT_EQ(console.preset(), ultrasound::Preset::raw);
  EXPECT_EQ(console.controls().persistence, 0);
  console.apply(SetPreset{ultrasound::Preset::clinical});
  EXPECT_EQ(console.preset(), ultrasound::Preset::clinical);
}

/// Console and the words for it of one command by name. @return "" where it was understood
std::string apply_named(ScannerConsole& console, const char* name, const char* value) {
  const auto command = named_command(name, value, console);
  if (const auto* problem = std::get_if<NotUnderstood>(&command)) return problem->why;
  console.apply(std::get<Command>(command));
  return "";
}

TEST(NamedCommand, SetsAndTurnsKnobsInTheUnitsOfPeople) {
  ScannerConsole console{content::Probe{}};
  const ultrasound::ScannerControls& now = console.controls();
  EXPECT_EQ(apply_named(console, "gain", "+2"), "");
  EXPECT_EQ(apply_named(console, "gain", "+2"), "");
  EXPECT_EQ(now.gain_db, 4);
  EXPECT_EQ(apply_named(console, "gain", "-1"), "");
  EXPECT_EQ(now.gain_db, 3);
  EXPECT_EQ(apply_named(console, "gain", "=-6"), "");
  EXPECT_EQ(now.gain_db, -6);
  EXPECT_EQ(apply_named(console, "Depth", "150"), "");
  EXPECT_NEAR(now.depth, 0.150, 1e-12);
  EXPECT_EQ(apply_named(console, "focus", "-10"), "");
  EXPECT_NEAR(now.focus, content::Probe{}.focus - 0.010, 1e-12);
  EXPECT_EQ(apply_named(console, "frequency", "3"), "");
  EXPECT_NEAR(now.frequency_hz, 3e6, 1e-6);
  EXPECT_EQ(apply_named(console, "range", "70"), "");
  EXPECT_EQ(now.dynamic_range_db, 70);
  EXPECT_EQ(apply_named(console, "persistence", "0.5"), "");
  EXPECT_EQ(now.persistence, 0.5);
  EXPECT_EQ(apply_named(console, "tgc8", "+4"), "");
  EXPECT_EQ(now.tgc_db[7], 4);
  EXPECT_EQ(apply_named(console, "freeze", "on"), "");
  EXPECT_TRUE(console.frozen());
  EXPECT_EQ(apply_named(console, "preset", "raw"), "");
  EXPECT_EQ(console.preset(), ultrasound::Preset::raw);
  EXPECT_EQ(apply_named(console, "reset", ""), "");
  EXPECT_FALSE(console.frozen());
  EXPECT_EQ(now.gain_db, 0);
}

TEST(NamedCommand, UnderstandsTheParametersOfPlus) {
  ScannerConsole console{content::Probe{}};
  const ultrasound::ScannerControls& now = console.controls();
  EXPECT_EQ(apply_named(console, "DepthMm", "=120"), "");
  EXPECT_NEAR(now.depth, 0.120, 1e-12);
  EXPECT_EQ(apply_named(console, "GainPercent", "=50"), "");
  EXPECT_NEAR(now.gain_db, 0, 1e-12) << "the middle of -60 ... 60 dB";
  EXPECT_EQ(apply_named(console, "GainPercent", "=55"), "");
  EXPECT_NEAR(now.gain_db, 6, 1e-12);
  EXPECT_EQ(apply_named(console, "FocusDepthPercent", "=50"), "");
  EXPECT_NEAR(now.focus, 0.060, 1e-12);
  EXPECT_EQ(apply_named(console, "FrequencyMhz", "=2.5"), "");
  EXPECT_NEAR(now.frequency_hz, 2.5e6, 1e-6);
  EXPECT_EQ(apply_named(console, "DynRangeDb", "=55"), "");
  EXPECT_EQ(now.dynamic_range_db, 55);
}

TEST(NamedCommand, SaysWhatItDoesNotUnderstandInOneLine) {
  ScannerConsole console{content::Probe{}};
  const ultrasound::ScannerControls first = console.controls();
  for (const auto& [name, value] : {std::pair{"volume", "3"}, std::pair{"tgc9", "1"}, std::pair{"tgc", "1"},
                                    std::pair{"", ""}, std::pair{"preset", "loud"}, std::pair{"reset", "1"}}) {
    EXPECT_NE(apply_named(console, name, value).find("the scanner has depth, gain"), std::string::npos) << name;
  }
  for (const char* value : {"", "+", "much", "1e999", "nan", "inf", "2 dB"}) {
    EXPECT_NE(apply_named(console, "gain", value).find("a number"), std::string::npos) << value;
  }
  EXPECT_EQ(console.controls(), first);
}

content::Scene small_patient() {
  content::Scene scene = test::tour_phantom();
  scene.probe.scan_lines = 48;
  scene.probe.samples = 128;
  return scene;
}

TEST(LiveScanner, FollowsItsKnobsAndFreezes) {
  gpu::Device device;
  const content::Scene scene = small_patient();
  LiveScanner scanner(device, scene, ScannerConsole(scene.probe));
  state::FrameState state = test::tour_state(scene);
  const auto screen = [&] {
    scanner.draw(state);
    return view::read_picture(device, scanner.screen()).rgba;
  };
  const auto first = screen();
  const double scale = scanner.in_view().metres_per_pixel;
  for (int i = 0; i < 5; ++i) scanner.apply(SetDepth{-kDepthStep, true}, 0);
  const auto shallow = screen();
  EXPECT_NE(shallow, first);
  EXPECT_LT(scanner.in_view().metres_per_pixel, 0.8 * scale);
  scanner.apply(Freeze{}, 0);
  state.probe_position.x() += 0.01F;
  const auto frozen = screen();
  EXPECT_EQ(screen(), frozen);
  scanner.apply(SetPreset{}, 0);
  scanner.apply(Freeze{}, 0);
  EXPECT_NE(screen(), frozen);
  EXPECT_EQ(scanner.console().preset(), ultrasound::Preset::raw);
}

TEST(LiveScanner, MakesImagesAtTheRateOfItsLinesAndDepth) {
  gpu::Device device;
  content::Scene scene = small_patient();
  scene.probe.scan_lines = 160;
  scene.probe.depth = 0.16;
  LiveScanner scanner(device, scene, ScannerConsole(scene.probe));
  state::FrameState state = test::tour_state(scene);
  const auto images_in_a_second = [&](double pictures_hz) {
    const std::uint64_t before = scanner.images();
    const double from_s = state.time_s;
    for (int i = 1; i <= pictures_hz; ++i) {
      state.time_s = from_s + i / pictures_hz;
      scanner.draw(state);
    }
    return static_cast<double>(scanner.images() - before);
  };
  scanner.draw(state);
  // An echo from 16 cm takes 208 us; 160 lines, 30 us between them: 26.3 images a second.
  EXPECT_NEAR(images_in_a_second(100), 26.3, 1);
  EXPECT_NEAR(images_in_a_second(60), 26.3, 1);
  EXPECT_EQ(images_in_a_second(10), 10) << "no picture shows more than one";
  for (int i = 0; i < 40 && scanner.console().controls().depth > 0.0801; ++i) {
    scanner.apply(SetDepth{-kDepthStep, true}, 0);
  }
  scanner.draw(state);
  EXPECT_NEAR(images_in_a_second(100), 46.6, 1) << "of 8 cm the echoes are back sooner";
}

TEST(LiveScanner, WhileTimeStandsNothingIsMadeAgainButWhatAKnobChanges) {
  gpu::Device device;
  const content::Scene scene = small_patient();
  LiveScanner scanner(device, scene, ScannerConsole(scene.probe));
  const state::FrameState state = test::tour_state(scene);
  for (int i = 0; i < 5; ++i) scanner.draw(state);
  EXPECT_EQ(scanner.images(), 1U);
  const auto before = view::read_picture(device, scanner.screen()).rgba;
  scanner.apply(SetGain{6, true}, 0);
  for (int i = 0; i < 5; ++i) scanner.draw(state);
  EXPECT_EQ(scanner.images(), 2U);
  EXPECT_NE(view::read_picture(device, scanner.screen()).rgba, before);
}

TEST(LiveScanner, LaysACoreBesideTheImageAtOnceFrozenOrNot) {
  gpu::Device device;
  const content::Scene scene = small_patient();
  LiveScanner scanner(device, scene, ScannerConsole(scene.probe));
  state::FrameState state = test::tour_state(scene);
  const auto screen = [&] {
    scanner.draw(state);
    return view::read_picture(device, scanner.screen()).rgba;
  };
  const auto bare = screen();
  state.cores = {{.to = {0, 0, 0.017F}, .fired_s = -9, .pieces = {{.to = 1, .tissue = 1}}}};
  const auto with_core = screen();
  EXPECT_NE(with_core, bare);
  EXPECT_EQ(scanner.images(), 1U) << "the image is the one before";
  scanner.apply(Freeze{}, 0);
  const auto frozen = screen();
  state.cores.push_back(state.cores.back());
  EXPECT_NE(screen(), frozen);
  state.cores.pop_back();
  EXPECT_EQ(screen(), frozen) << "a film goes back in time";
}

TEST(LiveScanner, SaysWhyItIsBlackAndWhatItCannotDo) {
  gpu::Device device;
  const content::Scene scene = small_patient();
  LiveScanner scanner(device, scene, ScannerConsole(scene.probe));
  state::FrameState state = test::tour_state(scene);
  scanner.draw(state);
  EXPECT_EQ(scanner.note(), "");
  state.time_s = 1;
  state.probe_position.z() = -0.1F;
  scanner.draw(state);
  EXPECT_NE(scanner.note().find("from the skin; move it onto the skin"), std::string::npos) << scanner.note();
  const picture::Picture with = view::read_picture(device, scanner.screen());
  int amber = 0;  // the note's letters
  for (int x = 0; x < with.width; ++x) {
    for (int y = with.height - 24; y < with.height; ++y) {
      amber += with.at(x, y)[0] > 150 && with.at(x, y)[2] < 0.6 * with.at(x, y)[0] ? 1 : 0;
    }
  }
  if (!figures::Font::load().empty()) {
    EXPECT_GT(amber, 100);
  }
  for (int i = 0; i < 30; ++i) scanner.apply(SetDepth{kDepthStep, true}, 2);
  scanner.draw(state);
  EXPECT_EQ(scanner.note(), "depth limited to 300 mm");
}

class TissueTable : public ::testing::Test {
protected:
  void SetUp() override {
    scene_ = small_patient();
    write("liver", -40, "");
    scene_.tissue_table = folder_ / "tissues.json";
    scene_.tissues[1].name = "liver";
  }
  /// A table of one tissue and the outside. @param more  after its last key
  void write(const std::string& name, double backscatter_db, const std::string& more) {
    const auto row = [](double db, const std::string& after) {
      return R"({"mechanics": {"young_modulus_pa": 5000, "poisson_ratio": 0.4, "density_kg_per_m3": 1000},
        "needle": {"puncture_force_n": 1, "friction_n_per_m": 1},
        "acoustics": {"impedance_rayl": 1650000, "speed_of_sound_m_per_s": 1570, "attenuation_db_per_cm_mhz": 0.5,
        "texture_db": 0, "backscatter_db": )" +
             std::to_string(db) + "}" + after + "}";
    };
    folder_.write("tissues.json", R"({"format": "stylet-tissues", "version": 1, "tissues": {"outside": )" +
                                      row(-90, "") + ", \"" + name + "\": " + row(backscatter_db, more) + "}}");
    // File systems count time in steps that are long for a test.
    written_ += std::chrono::seconds(2);
    std::filesystem::last_write_time(folder_ / "tissues.json", written_);
  }

  support::TemporaryFolder folder_;
  content::Scene scene_;
  std::filesystem::file_time_type written_ = std::filesystem::file_time_type::clock::now();
  readers::TissueWatch::Clock::time_point now_{};
};

TEST_F(TissueTable, IsReadAgainWhenItIsWrittenAndNotBefore) {
  readers::TissueWatch watch(scene_);
  const double young = scene_.tissues[1].mechanics.young_modulus;
  EXPECT_FALSE(watch.poll(now_));
  write("liver", -12, "");
  EXPECT_FALSE(watch.poll(now_ + std::chrono::milliseconds(900))) << "at most once a second";
  EXPECT_TRUE(watch.poll(now_ + std::chrono::seconds(1)));
  EXPECT_EQ(watch.problem(), "");
  EXPECT_EQ(watch.tissues()[1].acoustics.backscatter_db, -12);
  EXPECT_EQ(watch.tissues()[1].mechanics.young_modulus, young) << "mechanics stay";
  EXPECT_FALSE(watch.poll(now_ + std::chrono::seconds(3)));
}

TEST_F(TissueTable, WithAMistakeKeepsWhatWasAndSaysWhere) {
  readers::TissueWatch watch(scene_);
  write("liver", -12, "");
  watch.poll(now_ += std::chrono::seconds(2));
  write("liver", 6, R"(, "colour": "red")");
  EXPECT_TRUE(watch.poll(now_ += std::chrono::seconds(2)));
  EXPECT_NE(watch.problem().find("tissues.json:/tissues/liver/colour"), std::string::npos) << watch.problem();
  EXPECT_EQ(watch.problem().find('\n'), std::string::npos);
  EXPECT_EQ(watch.tissues()[1].acoustics.backscatter_db, -12);
  folder_.write("tissues.json", "{ half a fi");
  std::filesystem::last_write_time(folder_ / "tissues.json", written_ += std::chrono::seconds(2));
  EXPECT_TRUE(watch.poll(now_ += std::chrono::seconds(2)));
  EXPECT_NE(watch.problem().find("tissues.json"), std::string::npos);
  write("liver", 6, "");
  EXPECT_TRUE(watch.poll(now_ += std::chrono::seconds(2)));
  EXPECT_EQ(watch.problem(), "");
  EXPECT_EQ(watch.tissues()[1].acoustics.backscatter_db, 6);
}

TEST_F(TissueTable, AScannerFrozenFromTheStartHasAnImage) {
  gpu::Device device;
  ScannerConsole console(scene_.probe);
  console.apply(Freeze{});
  ASSERT_TRUE(console.frozen());
  LiveScanner scanner(device, scene_, console);
  const state::FrameState state = test::tour_state(scene_);
  scanner.draw(state);
  double sum = 0;
  for (const std::uint8_t value : view::read_picture(device, *scanner.in_view().image).rgba) sum += value;
  const auto pixels = static_cast<double>(scanner.in_view().image->settings().width) *
                      static_cast<double>(scanner.in_view().image->settings().height);
  EXPECT_GT(sum, 260 * pixels) << "brighter than black, whose alpha is 255";
}

TEST_F(TissueTable, ShowsInTheLiveImage) {
  gpu::Device device;
  LiveScanner scanner(device, scene_, ScannerConsole(scene_.probe));
  const state::FrameState state = test::tour_state(scene_);
  const auto brightness = [&] {
    scanner.draw(state);
    double sum = 0;
    for (const std::uint8_t value : view::read_picture(device, *scanner.in_view().image).rgba) sum += value;
    return sum;
  };
  const double before = brightness();
  write("liver", -40, "");
  scanner.poll(0);
  EXPECT_LT(brightness(), 0.95 * before);
  EXPECT_EQ(scanner.note(), "tissue table read again");
}

}  // namespace
}  // namespace stylet::scanner
