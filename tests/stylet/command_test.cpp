#include "tests/stylet/command.h"
#include "engine/app/default_stylus.h"
#include "engine/readers/motion.h"
#include "engine/recording/recording.h"
#include "tests/gltf/glb.h"
#include "tests/import/file_bytes.h"
#include "tests/mesh/shapes.h"
#include "tests/readers/small_scenario.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <memory>
#include <numbers>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace stylet {
namespace {

using nlohmann::json;

const fs::path kContent = fs::path(STYLET_SOURCE_DIR) / "content";

class Command : public ::testing::Test {
protected:
  fs::path out() const { return folder_ / "out"; }

  // The default scenario with a change, written where its relative paths still hold.
  fs::path scenario(const std::function<void(json&)>& change) {
    json scenario = json::parse(read_text(kContent / "scenarios" / "liver_biopsy.json"));
    for (const char* key : {"tissues", "needle", "motion"}) scenario[key] = absolute(scenario[key]);
    scenario["probe"]["file"] = absolute(scenario["probe"]["file"]);
    scenario["organs"][0]["file"] = absolute(scenario["organs"][0]["file"]);
    change(scenario);
    const fs::path path = folder_ / "scenario.json";
    std::ofstream(path) << scenario.dump(1);
    return path;
  }

  // A scenario that loads at once, for what holds of any.
  std::string small_scenario() {
    if (!small_) {
      small_.emplace();
      small_->scenario["labels"]["spacing_mm"] = 4;
      small_->write();
    }
    return small_->path().string();
  }

  // The scenario of the demo, as a user names it; the small one under a sanitizer.
  std::string default_scenario() { return support::kSanitized ? small_scenario() : "liver_biopsy"; }

  // A part of the default motion, or as long a one into the small scenario's liver.
  fs::path short_motion(double from_s, double to_s, bool small = support::kSanitized) const {
    content::Motion motion = readers::read_motion(kContent / "motions" / "liver_biopsy.json");
    std::erase_if(motion.stylus,
                  [&](const content::MotionSample& s) { return s.time_s < from_s || s.time_s > to_s; });
    for (content::MotionSample& sample : motion.stylus) {
      sample.time_s -= from_s;
      if (small) sample.pose = {.position = {0.1, 0, 0.2 - 0.02 * sample.time_s}, .orientation = {0, 1, 0, 0}};
    }
    const fs::path path = folder_ / "motion.json";
    readers::write_motion(motion, "short", path);
    return path;
  }

  // One line that says where and what, exit code 2, and no trace of --out.
  void expect_refused(const std::string& arguments, const std::string& where, const std::string& what) {
    const Outcome outcome = run(fmt::format("train {} --view headless --out {}", arguments, out().string()));
    EXPECT_EQ(outcome.exit_code, 2) << outcome.output;
    const auto begin = outcome.output.find("stylet: ");
    ASSERT_NE(begin, std::string::npos) << outcome.output;
    const std::string message = outcome.output.substr(begin);
    EXPECT_EQ(std::count(message.begin(), message.end(), '\n'), 1) << message;
    EXPECT_NE(message.find(where), std::string::npos) << message;
    EXPECT_NE(message.find(what), std::string::npos) << message;
    EXPECT_FALSE(fs::exists(out()));
    for (const auto& entry : fs::directory_iterator(folder_.path())) {
      EXPECT_EQ(entry.path().filename().string().find("partial"), std::string::npos) << entry.path();
    }
  }

  const support::TemporaryFolder folder_;

private:
  std::optional<readers::test::SmallScenario> small_;

  static std::string absolute(const json& relative) {
    return fs::weakly_canonical(kContent / "scenarios" / relative.get<std::string>()).string();
  }
};

TEST_F(Command, HelpAndVersionAreComplete) {
  const Outcome help = run("--help");
  EXPECT_EQ(help.exit_code, 0);
  for (const char* word : {"train", "render", "replay", "import", "validate", "Start here"}) {
    EXPECT_NE(help.output.find(word), std::string::npos) << word;
  }
  const Outcome version = run("--version");
  EXPECT_EQ(version.exit_code, 0);
  for (const char* word : {"commit", "BLAS", "OpenBLAS", "CHOLMOD", "GPL"}) {
    EXPECT_NE(version.output.find(word), std::string::npos) << word;
  }
}

// OpenBLAS takes a processor newer than itself for one of 2004, without AVX; who chooses kernels gets them.
TEST_F(Command, BlasKernelsFitTheProcessor) {
  if (__builtin_cpu_supports("avx2") == 0) GTEST_SKIP() << "a processor without AVX2";
  constexpr const char* kChoice = "OPENBLAS_CORETYPE";
  if (std::getenv(kChoice) != nullptr) GTEST_SKIP() << kChoice << " is set";
  EXPECT_EQ(run("--version").output.find(" Prescott "), std::string::npos);
  setenv(kChoice, "Prescott", 1);
  EXPECT_NE(run("--version").output.find(" Prescott "), std::string::npos);
  unsetenv(kChoice);
}

TEST(DefaultStylus, IsHeldByAPersonWhereThereIsAPicture) {
  using app::ShownIn;
  using haptic::hid::DeviceKind;
  for (const DeviceKind kind : {DeviceKind::kUnusable, DeviceKind::kJoystick, DeviceKind::kPen}) {
    EXPECT_STREQ(app::default_stylus(ShownIn::window, kind), "mouse");
  }
  for (const DeviceKind kind : {DeviceKind::kStylus, DeviceKind::kSpaceMouse}) {
    EXPECT_STREQ(app::default_stylus(ShownIn::window, kind), "hid");
    EXPECT_STREQ(app::default_stylus(ShownIn::headset, kind), "hand");
    EXPECT_STREQ(app::default_stylus(ShownIn::nothing, kind), "recorded");
  }
}

TEST_F(Command, HelpSaysWhatLeadsTheNeedle) {
  const Outcome train = run("train --help");
  std::string text;  // as it is, whatever its width
  for (const char c : train.output)
    if (std::isspace(static_cast<unsigned char>(c)) == 0) text += c;
  EXPECT_NE(text.find("inawindowaHIDstylusorspacemousethatispluggedin,elsemouse;inaheadsethand;headlessrecorded"),
            std::string::npos)
      << train.output;
  EXPECT_NE(train.output.find("--device recorded     the scenario's own motion, as a demonstration\n"),
            std::string::npos);
  const Outcome demo = run("--help", fs::path(STYLET_SOURCE_DIR) / "tools" / "demo.sh");
  EXPECT_EQ(demo.exit_code, 0);
  EXPECT_NE(demo.output.find("tools/demo.sh --device mouse "), std::string::npos) << demo.output;
}

TEST_F(Command, TrainWithoutAScenarioListsThem) {
  const Outcome outcome = run("train");
  EXPECT_EQ(outcome.exit_code, 0);
  EXPECT_NE(outcome.output.find("liver_biopsy"), std::string::npos);
}

TEST_F(Command, RefusesWhatIsNotThere) {
  expect_refused("no_such_scenario", "no_such_scenario", "liver_biopsy");
  expect_refused(scenario([](json& s) { s["motion"] = "gone.json"; }).string(), "gone.json", "");
  const std::string scenario_name = small_scenario();
  expect_refused(scenario_name + " --device recorded:/nowhere/motion.json", "/nowhere/motion.json", "");
  expect_refused(scenario_name + " --device joystick", "joystick", "scripted");
  expect_refused(scenario_name + " --gpu no_such_gpu", "no_such_gpu", "");
  expect_refused(scenario_name + " --coupling spring", "spring", "paper-updated");
  expect_refused(scenario_name + " --haptic-hz 5000", "haptic rate 5000", "4000 Hz");
  expect_refused(scenario_name + " --haptic-hz 1001", "haptic rate 1001", "multiple");
}

TEST_F(Command, RefusesMalformedScenarios) {
  const fs::path broken = folder_ / "broken.json";
  std::ofstream(broken) << "{\n \"format\": \"stylet-scenario\",\n \"version\" 1\n}\n";
  expect_refused(broken.string(), "broken.json:3", "");
  expect_refused(scenario([](json& s) { s["needel"] = s["needle"]; }).string(), "/needel", "needle");
  expect_refused(scenario([](json& s) { s["rates"]["haptic_hz"] = -5; }).string(), "/rates/haptic_hz", "");
  expect_refused(scenario([](json& s) { s["camera"]["eye"][0] = "left"; }).string(), "/camera/eye/0", "number");
  expect_refused(scenario([](json& s) { s["version"] = 99; }).string(), "/version", "");
}

TEST_F(Command, AMalformedScenarioOfTheContentFolderSaysWhereItIsBroken) {
  fs::create_directories(folder_ / "content" / "scenarios");
  folder_.write("content/scenarios/broken.json", "{\n \"format\": \"stylet-scenario\",\n \"version\" 1\n}\n");
  ASSERT_EQ(::setenv("STYLET_CONTENT", (folder_ / "content").c_str(), 1), 0);
  expect_refused("broken", "broken.json:3:", "not valid JSON");
  const Outcome listed = run("train");
  ASSERT_EQ(::unsetenv("STYLET_CONTENT"), 0);
  EXPECT_EQ(listed.exit_code, 0);
  EXPECT_NE(listed.output.find("broken.json:3:"), std::string::npos) << listed.output;
}

TEST_F(Command, UnknownAnnotationsAreRefusedInAScenarioAndWarnElsewhere) {
  gltf::test::Glb glb;
  glb.add("part", mesh::test::icosphere({0, 0, 0}, 0.04, 2), {{"id", "part"}, {"rolle", "boundary"}},
          {{"preset", "liver"}, {"mechanical", {{"young_modulus_pa", 1}}}});
  const fs::path file = folder_.write("part.glb", glb.bytes());
  expect_refused(scenario([&](json& s) { s["organs"][0]["file"] = file.string(); }).string(),
                 "part.glb:/nodes/0/extras/organ/rolle: ", "did you mean \"role\"?");
  for (const std::string& command : {"validate " + file.string(), "import --list " + file.string()}) {
    const Outcome outcome = run(command);
    EXPECT_EQ(outcome.exit_code, 0) << outcome.output;
    for (const char* place : {"/nodes/0/extras/organ/rolle: ", "/materials/0/extras/tissue/mechanical: "}) {
      EXPECT_NE(outcome.output.find("stylet: warning: " + file.string() + ":" + place), std::string::npos)
          << command << '\n'
          << outcome.output;
    }
  }
}

TEST_F(Command, RefusesNonFiniteNumbers) {
  const fs::path path = scenario([](json&) {});
  std::string text = read_text(path);
  const auto at = text.find("\"haptic_hz\": 1000");
  ASSERT_NE(at, std::string::npos);
  text.replace(at, 17, "\"haptic_hz\": 1e999");
  std::ofstream(path) << text;
  expect_refused(path.string(), "scenario.json", "");
}

TEST_F(Command, RefusesOrgansThatAreNone) {
  const fs::path organ = folder_ / "organ.glb";
  std::ofstream(organ, std::ios::binary) << std::string("glTF\2\0\0\0\40\0\0\0 no organ here ", 27);
  expect_refused(scenario([&](json& s) { s["organs"][0]["file"] = organ.string(); }).string(), "organ.glb", "");
  // A gallbladder meshed with cells larger than itself.
  expect_refused(scenario([](json& s) {
                   s["bodies"][1]["name"] = "gallbladder";
                   s["bodies"][1]["mesh"] = {{"cell_mm", 100}};
                   s.erase("contacts");  // of the liver
                 }).string(),
                 "abdomen.glb:/nodes/", "cell size");
}

TEST_F(Command, ValidateNamesEveryProblem) {
  EXPECT_EQ(run("validate " + small_scenario()).exit_code, 0);
  const fs::path path = scenario([](json& s) {
    s["rates"]["haptic_hz"] = -5;
    s["contact_spacing_mm"] = "wide";
  });
  const Outcome outcome = run(fmt::format("validate {}", path.string()));
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_NE(outcome.output.find("/rates/haptic_hz"), std::string::npos) << outcome.output;
  EXPECT_NE(outcome.output.find("/contact_spacing_mm"), std::string::npos) << outcome.output;
}

TEST_F(Command, ValidateChecksEveryFileOfAFolder) {
  const std::vector<std::string> shipped{
      "scenarios/liver_biopsy.json", "organs/abdomen.glb", "organs/abdomen.json",       "tissues.json",
      "needles/18g_150mm.json",      "probes/c5_2.json",   "motions/liver_biopsy.json", "reference/r1.json",
      "imports/ts_abdomen.json"};
  const std::vector<std::string> small{"scenario.json", "organs.glb", "tissues.json", "needle.json", "probe.json"};
  const fs::path whole = support::kSanitized ? fs::path(small_scenario()).parent_path() : kContent;
  const Outcome sound = run("validate " + whole.string());
  EXPECT_EQ(sound.exit_code, 0) << sound.output;
  for (const std::string& file : support::kSanitized ? small : shipped) {
    EXPECT_NE(sound.output.find((whole / file).string() + ": sound\n"), std::string::npos) << file;
  }
  fs::copy_file(kContent / "needles" / "18g_150mm.json", folder_ / "needle.json");
  folder_.write("notes.json", R"({"by": "another program"})");
  json r1 = json::parse(read_text(kContent / "reference" / "r1.json"));
  r1["cube"]["egde"] = 1;
  folder_.write("r1.json", r1.dump());
  folder_.write("cut.rec", "not a recording");
  const Outcome outcome = run("validate " + folder_.path().string());
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_NE(outcome.output.find("needle.json: sound"), std::string::npos) << outcome.output;
  EXPECT_NE(outcome.output.find("r1.json:/cube/egde: "), std::string::npos) << outcome.output;
  EXPECT_NE(outcome.output.find("cut.rec: 1 problem"), std::string::npos) << outcome.output;
  EXPECT_EQ(outcome.output.find("notes.json"), std::string::npos) << outcome.output;
}

TEST_F(Command, InstalledItFindsTheContentBesideIt) {
  const fs::path prefix = folder_ / "prefix";
  const fs::path build = fs::path(STYLET_COMMAND).parent_path().parent_path();
  ASSERT_EQ(std::system(fmt::format("cmake --install '{}' --prefix '{}' >'{}' 2>&1", build.string(), prefix.string(),
                                    (folder_ / "install.log").string())
                            .c_str()),
            0)
      << read_text(folder_ / "install.log");
  const fs::path installed = prefix / "share" / "stylet" / "content" / "scenarios" / "liver_biopsy.json";
  json scenario = json::parse(read_text(installed));
  scenario["title"] = "Beside the binary";
  std::ofstream(installed) << scenario.dump();
  const Outcome listed = run("train", prefix / "bin" / "stylet");
  EXPECT_EQ(listed.exit_code, 0);
  EXPECT_NE(listed.output.find("Beside the binary"), std::string::npos) << listed.output;
  if (support::kSanitized) return;  // the rest is long
  EXPECT_EQ(run("validate " + installed.string(), prefix / "bin" / "stylet").exit_code, 0);
}

TEST_F(Command, ImportLeavesAnOrganInANewFolder) {
  const fs::path ball =
      folder_.write("ball.stl", import::test::binary_stl(mesh::test::icosphere({30, 20, 10}, 40, 3)));  // mm
  const fs::path organs = folder_ / "nested" / "new" / "dir";
  const Outcome outcome = run(fmt::format("import {} --cell 20 --out {}", ball.string(), organs.string()));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_EQ(files_below(folder_ / "nested"),
            (std::set<std::string>{"new/dir/ball/picture.png", "new/dir/ball/report.json", "new/dir/ball/report.txt",
                                   "new/dir/ball/surface.glb", "new/dir/ball/tetrahedra.vtk"}));
  const fs::path made = organs / "ball";
  const json report = json::parse(read_text(made / "report.json"));
  EXPECT_EQ(report["organ"], "ball");
  EXPECT_NEAR(report["solid"]["volume_m3"].get<double>(), 4.0 / 3 * std::numbers::pi * std::pow(0.04, 3), 6e-6);
  EXPECT_TRUE(read_text(made / "surface.glb").starts_with("glTF"));
  EXPECT_TRUE(read_text(made / "tetrahedra.vtk").starts_with("# vtk DataFile"));
  EXPECT_TRUE(read_text(made / "picture.png").starts_with("\x89PNG"));
  EXPECT_TRUE(read_text(made / "report.txt").starts_with("ball\n====\n"));
}

TEST_F(Command, ImportRefusesABrokenFileInOneLine) {
  const std::string sound = import::test::binary_stl(mesh::test::icosphere({0, 0, 0}, 40, 1));
  const fs::path broken = folder_.write("broken.stl", sound.substr(0, sound.size() / 2));
  // Two faces of a tetrahedron: nothing is wrong with the file, and there is no organ in it.
  const fs::path open = folder_.write("open.obj",
                                      "v 0 0 0\nv 10 0 0\nv 0 10 0\nv 0 0 10\n"
                                      "f 1 2 4\nf 1 4 3\n");
  for (const fs::path& file : {broken, open}) {
    const fs::path said = folder_ / "stdout", refused = folder_ / "stderr";
    const Outcome outcome = run(fmt::format("import {} --out {} >{} 2>{}; exit $?", file.string(), out().string(),
                                            said.string(), refused.string()));
    EXPECT_EQ(outcome.exit_code, 2) << file;
    const std::string everything = read_text(refused);
    const auto begin = everything.find("stylet: ");
    ASSERT_NE(begin, std::string::npos) << everything;
    EXPECT_TRUE(begin == 0 || file == open) << "progress before it: " << everything;
    const std::string message = everything.substr(begin);
    EXPECT_EQ(std::count(message.begin(), message.end(), '\n'), 1) << message;
    EXPECT_NE(message.find(file.filename().string()), std::string::npos) << message;
    EXPECT_EQ(read_text(said), "");
    EXPECT_EQ(files_below(folder_.path()), (std::set<std::string>{"broken.stl", "open.obj", "stderr", "stdout"}));
    EXPECT_FALSE(fs::exists(out()));
  }
}

TEST_F(Command, ImportStaysInsideItsFolderWhateverAFileCallsAnOrgan) {
  gltf::test::Glb glb;
  glb.add("part", mesh::test::icosphere({0, 0, 0}, 0.04, 2), {{"id", "../../etc/x y"}});
  const fs::path file = folder_.write("bad.glb", glb.bytes());
  fs::create_directories(folder_ / "a" / "b");  // so that going two folders up ends where it is seen
  const Outcome outcome =
      run(fmt::format("import {} --cell 20 --out {}", file.string(), (folder_ / "a" / "b" / "out").string()));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const std::set<std::string> files = files_below(folder_.path());
  EXPECT_EQ(files.size(), 6u) << outcome.output;
  for (const std::string& made : files) {
    EXPECT_TRUE(made == "bad.glb" || made.starts_with("a/b/out/etc_x_y/")) << made;
  }
}

TEST_F(Command, ImportTakesItsOrgansFromASideFile) {
  gltf::test::Glb glb;
  glb.add("left_ball", mesh::test::icosphere({0, 0, 0}, 0.02, 3));
  glb.add("right_ball", mesh::test::icosphere({-0.1, 0, 0}, 0.02, 3));
  glb.add("left_shell", mesh::test::icosphere({0, 0, 0}, 0.03, 2));
  const fs::path file = folder_.write("balls.glb", glb.bytes());
  const fs::path side = folder_.write("side.json", R"({"format": "stylet-import", "version": 1, "organs": [
      {"id": "many", "parts": ["right*"], "tissue": "kidney_cortex", "deformable": true, "target_nodes": 400},
      {"id": "few", "parts": ["left_ball"], "tissue": "liver", "deformable": true, "cell_mm": 12},
      {"id": "shell", "parts": ["left_shell"], "role": "ignore"}]})");
  const Outcome outcome =
      run(fmt::format("import {} --side {} --out {}", file.string(), side.string(), out().string()));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  EXPECT_FALSE(fs::exists(out() / "shell"));
  const json many = json::parse(read_text(out() / "many" / "report.json"));
  EXPECT_EQ(many["source"]["parts"], json({"right_ball"}));
  EXPECT_NEAR(many["tetrahedra"]["nodes"].get<double>(), 400, 20);
  EXPECT_NE(read_text(out() / "many" / "surface.glb").find("kidney_cortex"), std::string::npos);
  const json few = json::parse(read_text(out() / "few" / "report.json"));
  EXPECT_EQ(few["source"]["parts"], json({"left_ball"}));
  EXPECT_LT(few["tetrahedra"]["nodes"].get<double>(), 200);
}

TEST_F(Command, ImportOfAScenarioRefusesOptionsOfSingleOrgans) {
  gltf::test::Glb glb;
  glb.add("ball", mesh::test::icosphere({0, 0, 0}, 0.02, 1));
  const fs::path file = folder_.write("ball.glb", glb.bytes());
  const Outcome outcome = run(fmt::format("import {} --side {} --nodes 500 --gap 2 --out {}", file.string(),
                                          STYLET_SOURCE_DIR "/content/imports/ts_abdomen.json", out().string()));
  EXPECT_EQ(outcome.exit_code, 2) << outcome.output;
  EXPECT_NE(outcome.output.find("--nodes, --gap: not with the scenario"), std::string::npos) << outcome.output;
  EXPECT_FALSE(fs::exists(out()));
}

TEST_F(Command, RenderGivesTheSameFramesTwice) {
  const std::string arguments =
      fmt::format("render {} --size 160x120 --ultrasound-size 160x120 --fps 20 --to 0.1 --out ", default_scenario());
  const Outcome first = run(arguments + out().string());
  ASSERT_EQ(first.exit_code, 0) << first.output;
  const Outcome second = run(arguments + (folder_ / "again").string());
  ASSERT_EQ(second.exit_code, 0) << second.output;
  json one = json::parse(read_text(out() / "manifest.json"));
  const json two = json::parse(read_text(folder_ / "again" / "manifest.json"));
  EXPECT_EQ(one, two);
  ASSERT_EQ(one["frames"].size(), 3u);  // 0, 50 and 100 ms
  for (const json& frame : one["frames"]) {
    EXPECT_TRUE(fs::exists(out() / frame["view"].get<std::string>()));
    EXPECT_TRUE(fs::exists(out() / frame["ultrasound"].get<std::string>()));
  }
  EXPECT_FALSE(one["gpu"].get<std::string>().empty());
}

TEST_F(Command, RenderSetsTheScannerAndSaysWhyAnImageIsBlack) {
  const std::string render = fmt::format("render {} --ultrasound --ultrasound-size 160x120 --to 0 --out {} ",
                                         default_scenario(), out().string());
  const Outcome outcome = run(render + "--us-preset raw --us-depth-mm 120 --us-gain-db -58");
  ASSERT_EQ(outcome.exit_code, 0) << outcome.output;
  const json manifest = json::parse(read_text(out() / "manifest.json"));
  EXPECT_EQ(manifest["scanner"], json::parse(R"({"preset": "raw", "depth_mm": 120.0, "gain_db": -58.0})"));
  EXPECT_NE(manifest["frames"][0].value("note", "").find("the gain is too low (-58 dB)"), std::string::npos);
  const Outcome deep = run(render + "--us-depth-mm 900");
  EXPECT_EQ(deep.exit_code, 2);
  EXPECT_NE(deep.output.find("depth limited to 300 mm"), std::string::npos) << deep.output;
}

TEST_F(Command, RenderRefusesTimesOutsideTheMotion) {
  const std::string render = fmt::format("render {} --device recorded:{} --out {} ", small_scenario(),
                                         short_motion(8, 8.2, true).string(), out().string());
  for (const char* times : {"--to -3", "--to 1000", "--from -1", "--from 0.15 --to 0.1", "--to nan"}) {
    const Outcome outcome = run(render + times);
    EXPECT_EQ(outcome.exit_code, 2) << times << '\n' << outcome.output;
    EXPECT_NE(outcome.output.find("within the motion, 0 to 0.2"), std::string::npos) << times << '\n'
                                                                                     << outcome.output;
    EXPECT_FALSE(fs::exists(out()));
  }
}

TEST_F(Command, RenderLeavesNoFrameThatItsManifestDoesNotList) {
  const std::string render =
      fmt::format("render {} --device recorded:{} --size 64x64 --ultrasound-size 64x64 --out {} ", small_scenario(),
                  short_motion(8, 8.1, true).string(), out().string());
  ASSERT_EQ(run(render + "--fps 20").exit_code, 0);  // 0, 50 and 100 ms
  const auto three = files_below(out());
  ASSERT_EQ(three.size(), 7u);
  std::ofstream(out() / "view_notes.png") << "mine";
  ASSERT_EQ(run(render + "--fps 10").exit_code, 0);
  EXPECT_EQ(files_below(out()),
            (std::set<std::string>{"manifest.json", "ultrasound_00000.png", "ultrasound_00001.png", "view_00000.png",
                                   "view_00001.png", "view_notes.png"}));

  // A folder in the place of a frame: refused, and what was there is still whole.
  const std::string manifest = read_text(out() / "manifest.json");
  fs::create_directories(out() / "view_00002.png" / "deep");
  const Outcome blocked = run(render + "--fps 20");
  EXPECT_EQ(blocked.exit_code, 2) << blocked.output;
  EXPECT_NE(blocked.output.find("view_00002.png: cannot write results here"), std::string::npos) << blocked.output;
  EXPECT_EQ(read_text(out() / "manifest.json"), manifest);
  EXPECT_EQ(files_below(out()).size(), 6u);
}

TEST_F(Command, TrainLeavesACompleteResultThatReplays) {
  const fs::path motion = short_motion(7.9, 8.3);
  const Outcome trained = run(fmt::format("train {} --view headless --expert none --device recorded:{} --out {}",
                                          default_scenario(), motion.string(), out().string()));
  ASSERT_EQ(trained.exit_code, 0) << trained.output;
  for (const char* name : {"view.png", "ultrasound.png", "session.png", "session.mp4", "force.csv", "force.png",
                           "session.rec", "session.json", "debrief.html", "debrief.json", "debrief.csv"}) {
    EXPECT_GT(fs::file_size(out() / name), 500u) << name;
  }
  // However few steps a late machine takes: each is a point.
  const auto steps = recording::read_recording(out() / "session.rec").simulation.size();
  EXPECT_GT(steps, 0U);
  EXPECT_EQ(std::ranges::count(read_text(out() / "path.csv"), '\n'), 1 + static_cast<std::ptrdiff_t>(steps));
  const json session = json::parse(read_text(out() / "session.json"));
  EXPECT_EQ(session["mode"], "threaded");
  EXPECT_TRUE(session["replay"]["identical"]);
  EXPECT_GT(session["replay"]["hashes_compared"], 2);
  EXPECT_NEAR(session["duration_s"].get<double>(), 0.4, 0.05);
  const Outcome replayed = run(fmt::format("replay {}", (out() / "session.rec").string()));
  EXPECT_EQ(replayed.exit_code, 0) << replayed.output;
  EXPECT_NE(replayed.output.find(session["state_hash"].get<std::string>()), std::string::npos);
  EXPECT_GT(session["metrics"].size(), 30U);
  if (!support::kSanitized) {  // the small scenario scores nothing
    EXPECT_GT(session["score"]["criteria"].size(), 10U);
    const std::string total = fmt::format("{:.1f} of 100", session["score"]["total"].get<double>());
    EXPECT_NE(trained.output.find(total), std::string::npos) << total << trained.output;
  }

  // A byte of the recording changed on disk is refused, not replayed.
  std::string bytes = read_text(out() / "session.rec");
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  std::ofstream(folder_ / "damaged.rec", std::ios::binary) << bytes;
  const Outcome damaged = run(fmt::format("replay {}", (folder_ / "damaged.rec").string()));
  EXPECT_EQ(damaged.exit_code, 2) << damaged.output;
  EXPECT_NE(damaged.output.find("byte"), std::string::npos) << damaged.output;
}

TEST_F(Command, AnInterruptEndsABench) {
  const Outcome ended = run(
      fmt::format("bench paper 2>{0} & bench=$!; until [ -s {0} ]; do sleep 0.1; done; kill -INT $bench; wait $bench",
                  (folder_ / "started").string()));
  EXPECT_EQ(ended.exit_code, 130) << ended.output;
}

TEST_F(Command, AnInterruptEndsTheSessionAndKeepsIt) {
  const fs::path motion = short_motion(7.9, 14.6, true);
  const std::string scenario_name = small_scenario();
  const auto entries = [&] {
    return std::distance(fs::directory_iterator(folder_.path()), fs::directory_iterator{});
  };
  const auto before = entries();
  // Three seconds to film: on a busy machine the second interrupt still comes while they are drawn. Before the notice
  // it would be one more of the first.
  const Outcome ended = run(
      fmt::format("train {0} --view headless --expert none --device recorded:{1} --out {2} >{3} 2>&1 & "
                  "session=$!; until ls {2}/unfinished-*-$session.rec; do sleep 0.1; done; sleep 3; "
                  "kill -INT $session; until grep -q 'ended early' {3} || ! kill -0 $session; do sleep 0.1; done; "
                  "kill -INT $session; wait $session; ended=$?; cat {3}; rm {3}; exit $ended",
                  scenario_name, motion.string(), out().string(), (folder_ / "said").string()));
  EXPECT_EQ(ended.exit_code, 130) << ended.output;
  EXPECT_NE(ended.output.find("session ended early"), std::string::npos) << ended.output;
  const json session = json::parse(read_text(out() / "session.json"));
  EXPECT_LT(session["duration_s"].get<double>(), 9);
  EXPECT_TRUE(fs::exists(out() / "force.csv"));
  EXPECT_FALSE(fs::exists(out() / "session.mp4"));
  EXPECT_EQ(run(fmt::format("replay {}", (out() / "session.rec").string())).exit_code, 0);
  EXPECT_EQ(entries(), before + 1) << "the results and nothing else";
}

}  // namespace
}  // namespace stylet
