// `stylet lab` and `stylet train --trainee`, as a lab uses them.
#include "engine/lab/store/lab.h"
#include "tests/readers/small_scenario.h"
#include "tests/stylet/running_command.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <chrono>
#include <filesystem>
#include <random>
#include <set>
#include <string>
#include <thread>

namespace stylet {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

class LabCommand : public ::testing::Test {
protected:
  LabCommand() {
    small_.scenario["labels"]["spacing_mm"] = 4;
    small_.motion["tracks"]["stylus"] = nlohmann::json::parse(
        "[[0, 0.1, 0, 0.21, 0, 1, 0, 0], [2, 0.1, 0, 0.16, 0, 1, 0, 0], [60, 0.1, 0, 0.16, 0, 1, 0, 0]]");
    small_.write();
  }
  std::string lab() const { return (folder_ / "lab").string(); }
  Outcome act(const std::string& arguments) const { return run(fmt::format("lab {} --lab {}", arguments, lab())); }
  std::string train(const std::string& more) const {
    return fmt::format("train {} --device recorded --view headless --no-film --expert none --out {} --lab {} {}",
                       small_.path().string(), (folder_ / "out").string(), lab(), more);
  }

  support::TemporaryFolder folder_;
  readers::test::SmallScenario small_;
};

TEST_F(LabCommand, SaysWhatToDoWhereThereIsNothingYetAndWhatIsWrong) {
  const Outcome empty = act("list");
  EXPECT_EQ(empty.exit_code, 0);
  EXPECT_THAT(empty.output, HasSubstr("--trainee NAME` begins"));
  for (const auto& [arguments, says] :
       {std::pair{"show", "stylet lab show WHO"}, std::pair{"show bob", "bob is nobody in"},
        std::pair{"erase", "stylet lab erase WHO"}, std::pair{"exclude 12", "--why REASON"},
        std::pair{"page", "--course NAME --out FOLDER"}, std::pair{"exclude 12 --why x", "is no attempt"},
        std::pair{"shw bob", "shw"}}) {
    const Outcome refused = act(arguments);
    EXPECT_EQ(refused.exit_code, 2) << arguments;
    EXPECT_THAT(refused.output, HasSubstr(says));
    EXPECT_EQ(refused.lines(), 1) << refused.output;
  }
  const Outcome help = run("lab --help");
  EXPECT_EQ(help.exit_code, 0);
  for (const char* taught :
       {"list", "show", "export", "exclude", "erase", "backup", "pseudonym", "a person decides"}) {
    EXPECT_THAT(help.output, HasSubstr(taught));
  }
  EXPECT_THAT(run("validate " STYLET_SOURCE_DIR "/content/courses").output, HasSubstr("gate at 3.52 within 30"));
  EXPECT_THAT(run("train tutorial --course needle_basics").output, HasSubstr("--trainee"));
}

TEST_F(LabCommand, KeepsShowsExportsAndErasesWhatATraineeDid) {
  const Outcome trained = run(train("--lockstep --seconds 0.5 --trainee 'Ada L'"));
  ASSERT_EQ(trained.exit_code, 0) << trained.output;
  EXPECT_THAT(trained.output, HasSubstr("Ada L is new in"));
  EXPECT_EQ(run(train("--lockstep --seconds 0.5 --trainee 'Ada L'")).exit_code, 0);
  const Outcome list = act("list");
  EXPECT_THAT(list.output, HasSubstr("Ada L"));
  const Outcome show = act("show 'Ada L' --course needle_basics");
  EXPECT_EQ(show.exit_code, 0) << show.output;
  EXPECT_THAT(show.output, HasSubstr("guided"));
  EXPECT_THAT(show.output, HasSubstr("phantom     practice, 0 of 3 attempts"));
  EXPECT_THAT(show.output, HasSubstr("Next: phantom; `stylet train tutorial --trainee"));
  const Outcome pages = act("page --course needle_basics --out " + (folder_ / "pages").string());
  EXPECT_EQ(pages.exit_code, 0) << pages.output;
  const std::set<std::string> written = files_below(folder_ / "pages");
  ASSERT_EQ(written.size(), 2u);
  EXPECT_TRUE(written.contains("index.html"));
  for (const std::string& page : written) EXPECT_THAT(read_text(folder_ / "pages" / page), Not(HasSubstr("Ada L")));
  act("page --names --course needle_basics --out " + (folder_ / "pages").string());
  EXPECT_THAT(read_text(folder_ / "pages" / "index.html"), HasSubstr("Ada L"));
  const Outcome csv = act("export");
  EXPECT_EQ(csv.lines(), 3) << csv.output;
  EXPECT_THAT(csv.output, Not(HasSubstr("Ada L")));
  EXPECT_EQ(act("export > /dev/full").exit_code, 2) << "what is not whole is no export";
  EXPECT_EQ(run(train("--trainee ''")).exit_code, 2) << "names nobody";
  const fs::path file = folder_ / "ada.json";
  EXPECT_EQ(act("export 'Ada L' --format json --out " + file.string()).exit_code, 0);
  EXPECT_EQ(fs::status(file).permissions() & (fs::perms::group_all | fs::perms::others_all), fs::perms::none);
  const auto exported = nlohmann::json::parse(read_text(file));
  ASSERT_EQ(exported["attempts"].size(), 2u);
  EXPECT_GT(exported["attempts"][0]["metrics"].size(), 20u);
  const std::string id = exported["attempts"][0]["attempt"];
  EXPECT_EQ(act("exclude " + id.substr(24) + " --why 'a demonstration'").exit_code, 0);
  EXPECT_THAT(act("show 'Ada L'").output, HasSubstr("excluded: a demonstration"));
  EXPECT_EQ(act("backup --out " + (folder_ / "copy").string()).exit_code, 0);
  EXPECT_THAT(run("lab list --lab " + (folder_ / "copy").string()).output, HasSubstr("Ada L"));
  const Outcome asked = act("erase 'Ada L'");
  EXPECT_EQ(asked.exit_code, 1);
  EXPECT_THAT(asked.output, HasSubstr("--yes"));
  EXPECT_THAT(act("list").output, HasSubstr("Ada L"));
  const Outcome erased = act("erase 'Ada L' --yes");
  EXPECT_EQ(erased.exit_code, 0);
  EXPECT_THAT(erased.output, HasSubstr("2 attempts, 2 recordings"));
  EXPECT_THAT(act("list").output, HasSubstr("Nobody is in"));
  act("page --course needle_basics --out " + (folder_ / "pages").string());
  EXPECT_EQ(files_below(folder_ / "pages"), std::set<std::string>{"index.html"}) << "the page goes with the person";
}

TEST_F(LabCommand, AKilledSessionIsOnRecordAsCutOff) {
  const int kills = support::kSanitized ? 1 : 3;
  std::mt19937 random(11);
  for (int k = 0; k < kills; ++k) {
    RunningCommand session(train("--trainee ada"));
    // Its procedure begins by itself; the attempt is on record while it runs.
    const auto under_way = [&] {
      if (!fs::exists(folder_ / "lab" / "running")) return false;
      return !fs::is_empty(folder_ / "lab" / "running");
    };
    for (int i = 0; i < 3000 && !under_way(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(20));
    ASSERT_TRUE(under_way()) << session.output();
    std::this_thread::sleep_for(std::chrono::milliseconds(100 + random() % 400));
    if (k == 0) {
      EXPECT_THAT(act("show ada").output, HasSubstr("under way"));
    }
    session.kill();
    lab::store::Lab records({.folder = folder_ / "lab", .build = "test"});
    const auto attempts = records.attempts();
    ASSERT_EQ(attempts.size(), static_cast<std::size_t>(k) + 1);
    EXPECT_EQ(attempts.back().status, "crashed");
    EXPECT_TRUE(records.metrics(attempts.back().id).empty());
  }
  const std::string shown = act("show ada").output;
  EXPECT_THAT(shown, HasSubstr("cut off"));
  EXPECT_THAT(shown, Not(HasSubstr("failed"))) << "of a demonstration";
}

}  // namespace
}  // namespace stylet
