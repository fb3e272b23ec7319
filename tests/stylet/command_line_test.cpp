// What a user meets before anything runs: a word misspelt, a value that cannot be, Tab, the manual, the menu of the
// desktop.
#include "tests/readers/small_scenario.h"
#include "tests/stylet/command.h"
#include "tests/support/temporary_folder.h"

#include <gmock/gmock.h>

#include <cstdlib>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace stylet {
namespace {

using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

const std::vector<std::string> kCommands{"train",  "render",  "replay", "debrief", "import", "validate",
                                         "schema", "devices", "bench",  "author",  "lab",    "course"};

Outcome shell(const std::string& command) {
  const auto [exit_code, output] = support::run_in_shell(command);
  return {exit_code, output};
}

bool is_there(const std::string& program) {
  return shell("command -v " + program).exit_code == 0;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

std::set<std::string> set_of(const std::vector<std::string>& words) {
  return {words.begin(), words.end()};
}

/// The long options that `--help` of a command lists.
std::set<std::string> options_in_help(const std::string& command) {
  std::set<std::string> options;
  const std::regex listed("^  (?:-[a-zA-Z],)?(--[a-z][-a-z]*)");
  for (const std::string& line : lines_of(run(command + " --help").output)) {
    std::smatch found;
    if (std::regex_search(line, found, listed)) options.insert(found[1]);
  }
  return options;
}

void expect_refused(const std::string& arguments, const std::string& line) {
  const Outcome outcome = run(arguments);
  EXPECT_EQ(outcome.exit_code, 2) << arguments;
  EXPECT_EQ(outcome.output, line + "\n") << arguments;
}

TEST(CommandLine, AMisspeltWordIsNamedWithTheOneMeant) {
  expect_refused("trian liver_biopsy --device mouse",
                 "stylet: trian: there is no such command; did you mean train? see `stylet --help`");
  expect_refused("xylophone", "stylet: xylophone: there is no such command; see `stylet --help`");
  expect_refused("train tutorial --secnods 3",
                 "stylet: --secnods: there is no such option; did you mean --seconds? see `stylet train --help`");
  expect_refused("render tutorial --otu frames",
                 "stylet: --otu: there is no such option; did you mean --out? see `stylet render --help`");
  expect_refused("schema scenario needle", "stylet: needle: is one word too many; see `stylet schema --help`");
  expect_refused("bench papr", "stylet: there is no bench papr; did you mean paper?");
  EXPECT_THAT(run("train liver_biospy").output, HasSubstr("did you mean liver_biopsy? "));
}

// The scenario named is not there: who complains about it has looked at the scenario first, which takes seconds of
// one that is.
TEST(CommandLine, AnImpossibleStylusIsRefusedBeforeTheScenarioIsRead) {
  for (const char* command : {"train gone.json --view headless ", "render gone.json --out frames "}) {
    for (const auto& [device, said] :
         std::vector<std::pair<std::string, std::string>>{{"mous", "did you mean \"mouse\"?"},
                                                          {"recorded:", "recorded:FILE"},
                                                          {"recorded:/nowhere/motion.json", "/nowhere/motion.json"},
                                                          {"hid:feed:f00d", "--device hid:feed:f00d"},
                                                          {"hid:nonsense", "is not VID:PID"},
                                                          {"mouse", "--device mouse: "},
                                                          {"link", "--device link: "},
                                                          {"hand", "--device hand: "}}) {
      const Outcome outcome = run(command + ("--device " + device));
      EXPECT_EQ(outcome.exit_code, 2) << outcome.output;
      EXPECT_EQ(outcome.lines(), 1) << outcome.output;
      EXPECT_THAT(outcome.output, HasSubstr(said)) << command;
      EXPECT_THAT(outcome.output, Not(HasSubstr("gone.json"))) << command;
    }
  }
}

TEST(CommandLine, ATimeThatIsNoneIsRefusedInAShortLine) {
  for (const char* time : {"0", "-3", "ten", "nan", "inf", "1e999", "3s"}) {
    expect_refused(
        fmt::format("train gone.json --view headless --seconds {}", time),
        fmt::format("stylet: --seconds: {} is no time; give seconds above 0, such as 30; see `stylet train "
                    "--help`",
                    time));
  }
  expect_refused("devices --record hand.json --seconds nan",
                 "stylet: --seconds: nan is no time; give seconds above 0, such as 30; see `stylet devices --help`");
  EXPECT_THAT(run("train gone.json --view headless --seconds 1.5").output, HasSubstr("gone.json"));
}

TEST(CommandLine, AnInterruptedDatasetSaysWhatStays) {
  readers::test::SmallScenario small;
  small.probe["scan_lines"] = 48;
  small.probe["samples"] = 96;
  small.motion["tracks"]["stylus"] = {{0, 0.1, 0.03, 0.22, 0, 1, 0, 0}, {0.4, 0.1, 0.03, 0.17, 0, 1, 0, 0}};
  small.write();
  const fs::path set = small.folder / "set";
  const Outcome ended = shell(fmt::format(
      "ASAN_OPTIONS=detect_leaks=0 '{}' render '{}' --ultrasound --random 1000 --ultrasound-size 96x72 --out '{}' "
      "2>&1 & "
      "render=$!; until [ -e '{}/frame_000001.json' ]; do sleep 0.05; done; kill -INT $render; wait $render",
      STYLET_COMMAND, small.path().string(), set.string(), set.string()));
  EXPECT_EQ(ended.exit_code, 130) << ended.output;
  std::size_t whole = 0;
  for (const std::string& file : files_below(set)) whole += file.starts_with("frame_") ? 1 : 0;
  EXPECT_GE(whole, 2u);
  EXPECT_THAT(ended.output, HasSubstr(fmt::format("stylet: interrupted; {} of 1000 frames are whole and stay in {}; "
                                                  "give the same command again for the rest\n",
                                                  whole, set.string())));
}

/// What `cmake --install` puts beside the command.
class Installed : public ::testing::Test {
protected:
  static void SetUpTestSuite() {
    folder = new support::TemporaryFolder;
    const fs::path build = fs::path(STYLET_COMMAND).parent_path().parent_path();
    log = shell(fmt::format("cmake --install '{}' --prefix '{}' 2>&1", build.string(), prefix().string()));
  }
  static void TearDownTestSuite() { delete folder; }
  void SetUp() override { ASSERT_EQ(log.exit_code, 0) << log.output; }

  static fs::path prefix() { return *folder / "prefix"; }
  static fs::path share() { return prefix() / "share"; }
  static fs::path bash() { return share() / "bash-completion" / "completions" / "stylet"; }
  static fs::path zsh() { return share() / "zsh" / "site-functions" / "_stylet"; }
  static fs::path fish() { return share() / "fish" / "vendor_completions.d" / "stylet.fish"; }
  static fs::path man() { return share() / "man" / "man1" / "stylet.1"; }

  /// What bash offers for the last of the words, as it cuts them itself.
  static std::vector<std::string> offered(const std::string& words) {
    const std::string script = fmt::format(
        "PATH='{}':$PATH; source '{}'; COMP_WORDS=(stylet {}); COMP_CWORD=$((${{#COMP_WORDS[@]}} - 1)); "
        "_stylet stylet \"${{COMP_WORDS[-1]}}\" \"${{COMP_WORDS[-2]}}\"; "
        "[ ${{#COMPREPLY[@]}} = 0 ] || printf '%s\\n' \"${{COMPREPLY[@]}}\"",
        (prefix() / "bin").string(), bash().string(), words);
    const fs::path file = folder->write("complete.sh", script);
    return lines_of(
        shell(fmt::format("ASAN_OPTIONS=detect_leaks=0 bash --norc --noprofile '{}'", file.string())).output);
  }

  static support::TemporaryFolder* folder;
  static Outcome log;
};
support::TemporaryFolder* Installed::folder = nullptr;
Outcome Installed::log;

TEST_F(Installed, BashCompletesCommandsOptionsAndWhatTheyTake) {
  EXPECT_THAT(offered("tr"), ElementsAre("train"));
  EXPECT_EQ(set_of(offered("''")), set_of(kCommands));
  EXPECT_THAT(offered("train li"), ElementsAre("liver_biopsy", "liver_biopsy_fine"));
  EXPECT_EQ(
      set_of(offered("train liver_biopsy --device ''")),
      (std::set<std::string>{"hid", "hid:", "haply", "haply:", "force_dimension", "force_dimension:", "openhaptics",
                             "openhaptics:", "mouse", "hand", "link", "recorded", "recorded:", "scripted"}));
  EXPECT_THAT(offered("train liver_biopsy --device = sc"), ElementsAre("scripted")) << "--device=sc";
  EXPECT_EQ(set_of(offered("train --view ''")), (std::set<std::string>{"auto", "window", "headset", "headless"}));
  EXPECT_THAT(offered("train --coupling paper-f"), ElementsAre("paper-frozen"));
  EXPECT_THAT(offered("train --sec"), ElementsAre("--seconds"));
  EXPECT_THAT(offered("bench mech"), ElementsAre("mechanics"));
  EXPECT_THAT(offered("schema sce"), ElementsAre("scenario"));
  EXPECT_THAT(offered("render --camera 1 2 3 4 5 6 rf"), ElementsAre("rfa"));
  EXPECT_EQ(set_of(offered("completion ''")), (std::set<std::string>{"bash", "zsh", "fish"}))
      << "hidden, and completed all the same";
  // Nothing of ours: bash goes on to files.
  for (const char* files :
       {"replay ''", "train liver_biopsy --device recorded : content", "train --out ''", "nothing ''"}) {
    EXPECT_THAT(offered(files), ElementsAre()) << files;
  }
}

TEST_F(Installed, BashOffersScenariosOfTheFolderChosen) {
  fs::create_directories(*folder / "content" / "scenarios");
  fs::copy_file(share() / "stylet" / "content" / "scenarios" / "tutorial.json",
                *folder / "content" / "scenarios" / "zebra.json", fs::copy_options::overwrite_existing);
  ASSERT_EQ(::setenv("STYLET_CONTENT", (*folder / "content").c_str(), 1), 0);
  const std::vector<std::string> names = offered("train ''");
  ASSERT_EQ(::setenv("STYLET_CONTENT", "/nowhere", 1), 0);
  const std::vector<std::string> none = offered("train ''");
  ASSERT_EQ(::unsetenv("STYLET_CONTENT"), 0);
  EXPECT_EQ(names.size(), 1u);
  EXPECT_THAT(none, ElementsAre()) << "no content is no error here";
}

TEST_F(Installed, BashOffersEveryOptionOfTheHelp) {
  for (const std::string& command : kCommands) {
    const std::vector<std::string> names = offered(command + " --");
    EXPECT_EQ(set_of(names), options_in_help(command)) << command;
  }
}

TEST_F(Installed, OtherShellsCompleteToo) {
  EXPECT_THAT(read_text(zsh()), ::testing::StartsWith("#compdef stylet\n"));
  EXPECT_THAT(read_text(fish()), HasSubstr("complete -c stylet "));
  const std::string path = fmt::format("PATH='{}':$PATH ASAN_OPTIONS=detect_leaks=0", (prefix() / "bin").string());
  if (is_there("zsh")) {
    EXPECT_EQ(shell(fmt::format("zsh -n '{}' 2>&1", zsh().string())).output, "");
  }
  if (is_there("fish")) {
    const Outcome words =
        shell(fmt::format("{} HOME='{}' fish --no-config -c \"source '{}'; complete -C 'stylet train li'\" 2>&1",
                          path, folder->path().string(), fish().string()));
    EXPECT_THAT(words.output, ::testing::StartsWith("liver_biopsy\t"));
  }
}

TEST_F(Installed, TheManPageHasEveryCommandAndOption) {
  std::string source = read_text(man());
  ASSERT_THAT(source, HasSubstr("\n.TH STYLET 1 "));
  // As it is read: without marks of roff.
  const std::string page =
      std::regex_replace(std::regex_replace(source, std::regex(R"(\\f[BIR]|\\&)"), ""), std::regex(R"(\\-)"), "-");
  for (const std::string& command : kCommands) {
    const std::size_t begin = page.find("\n.SS stylet " + command + " ");
    ASSERT_NE(begin, std::string::npos) << command;
    const std::size_t end = page.find("\n.S", begin + 1);
    const std::string section = page.substr(begin, end - begin);
    std::set<std::string> options = options_in_help(command);
    EXPECT_EQ(options.erase("--help"), 1u) << command;  // said once, at the top
    for (const std::string& option : options) EXPECT_THAT(section, HasSubstr("\n.TP\n" + option)) << command;
  }
  for (const char* name : {".SH NAME", ".SH SYNOPSIS", ".SH EXIT STATUS", ".SH ENVIRONMENT", "STYLET_CONTENT"}) {
    EXPECT_THAT(page, HasSubstr(name));
  }
  if (is_there("groff")) {
    const Outcome set = shell(fmt::format("groff -man -Tascii -ww -rLL=80n '{}' 2>&1 >/dev/null", man().string()));
    EXPECT_EQ(set.output, "") << "what groff complains about";
  }
  if (is_there("man")) {
    const Outcome read = shell(fmt::format("MANWIDTH=80 LC_ALL=C man -l '{}' 2>&1 | col -b", man().string()));
    EXPECT_THAT(read.output, HasSubstr("--seconds"));
    EXPECT_THAT(read.output, HasSubstr("stylet - training simulator for needle procedures"));
  }
}

TEST_F(Installed, TheDesktopEntryStartsTheCommandThatIsInstalled) {
  const fs::path entry = share() / "applications" / "stylet.desktop";
  const std::vector<std::string> lines = lines_of(read_text(entry));
  for (const char* line :
       {"[Desktop Entry]", "Type=Application", "Name=Stylet", "Exec=stylet", "Icon=stylet", "Terminal=false"}) {
    EXPECT_THAT(lines, Contains(line));
  }
  EXPECT_TRUE(fs::exists(prefix() / "bin" / "stylet"));
  EXPECT_THAT(read_text(share() / "icons" / "hicolor" / "scalable" / "apps" / "stylet.svg"), HasSubstr("<svg "));
  if (is_there("desktop-file-validate")) {
    EXPECT_EQ(shell(fmt::format("desktop-file-validate '{}' 2>&1", entry.string())).output, "");
  }
}

}  // namespace
}  // namespace stylet
