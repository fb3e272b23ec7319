// `stylet lab` and `stylet train --trainee`, as a lab uses them.
#include "engine/lab/store/digest.h"
#include "engine/lab/store/lab.h"
#include "tests/readers/small_scenario.h"
#include "tests/stylet/running_command.h"
#include "tests/support/sanitized.h"
#include "tests/support/temporary_folder.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <filesystem>
#include <fstream>
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
        std::pair{"page", "--course NAME --out FOLDER"}, std::pair{"import ada", "say which: `stylet lab import WHO"},
        std::pair{"exclude 12 --why x", "is no attempt"}, std::pair{"shw bob", "shw"}}) {
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

/// A course of the small scenario alone, one attempt a day.
std::string course_text() {
  return R"({"format": "stylet-course", "version": 1, "name": "small", "title": "A small course",
    "spacing": {"attempts_a_day": 1},
    "exercises": [{"name": "balls", "scenario": "scenario.json", "practice": 2,
      "gate": {"acceptable_failure_rate": 0.1, "unacceptable_failure_rate": 0.3, "source": "a test"}}]})";
}

TEST_F(LabCommand, TheExerciseThatIsDueIsOpenedAndItIsSaidWhy) {
  const fs::path course = small_.folder.write("course.json", course_text());
  const std::string who = fmt::format("{} --trainee 'Ada L' --lab {}", course.string(), lab());
  const Outcome next = run("course next " + who);
  EXPECT_EQ(next.exit_code, 0) << next.output;
  EXPECT_THAT(next.output, HasSubstr("Ada L is new in"));
  EXPECT_THAT(next.output, HasSubstr("balls, because: practice (practice, 0 of 2 attempts"));
  const Outcome trained = run(fmt::format(
      "course run {} --device recorded --view headless --no-film --expert none --lockstep --seconds 0.5 --out {}",
      who, (folder_ / "out").string()));
  EXPECT_EQ(trained.exit_code, 0) << trained.output;
  EXPECT_THAT(trained.output, HasSubstr("balls, because: practice"));
  EXPECT_THAT(trained.output, Not(HasSubstr("is new in")));
  {
    lab::store::Lab records({.folder = folder_ / "lab", .build = "test"});
    const auto attempts = records.attempts();
    ASSERT_EQ(attempts.size(), 1u);
    EXPECT_EQ(attempts[0].course, "small");
    EXPECT_EQ(attempts[0].scenario, "scenario");
    // One that counts is enough for today.
    const std::string attempt =
        records.begin({.trainee = records.get("Ada L").id,
                       .scenario = {.sha256 = lab::store::sha256_of_file(small_.path()), .name = "scenario"}});
    records.end(attempt, {.total = 80, .pass_mark = 70, .passed = true});
  }
  const Outcome enough = run("course run " + who);
  EXPECT_EQ(enough.exit_code, 1) << enough.output;
  EXPECT_THAT(enough.output, HasSubstr("Nothing of A small course is due today"));
  EXPECT_THAT(enough.output, HasSubstr("balls: enough for today, 1 attempts"));
  EXPECT_EQ(run("course run nothing_such --trainee ada --lab " + lab()).exit_code, 2);
  EXPECT_THAT(run("course run needle_basics").output, HasSubstr("--trainee"));
}

TEST_F(LabCommand, ARecordingFromElsewhereIsScoredAgainAndRefusedWhereAnythingDiffers) {
  const fs::path out = folder_ / "out";
  ASSERT_EQ(run(fmt::format("train {} --device recorded --view headless --no-film --expert none --lockstep --seconds "
                            "0.5 --out {}",
                            small_.path().string(), out.string()))
                .exit_code,
            0);
  lab::store::Lab({.folder = folder_ / "lab", .build = "test"}).enrolled("ada");
  const std::string import = "import ada --recording " + out.string();
  EXPECT_THAT(act(import + " --graded").output, HasSubstr("a demonstration, which is not graded"));
  // Numbers that somebody has mended by hand, in the last digit that a double has.
  const std::string numbers = read_text(out / "session.json");
  auto changed = nlohmann::json::parse(numbers);
  for (auto& metric : changed["metrics"]) {
    if (metric["value"].is_number_float() && metric["value"] > 0.0) {
      metric["value"] = std::nextafter(metric["value"].get<double>(), 0.0);
      break;
    }
  }
  const auto write = [](const fs::path& file, const std::string& text) {
    std::ofstream(file, std::ios::binary | std::ios::trunc) << text;
  };
  write(out / "session.json", changed.dump());
  const Outcome other = act(import);
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_THAT(other.output, HasSubstr("its metrics is not what the recording gives"));
  write(out / "session.json", numbers);
  // A recording that was cut short.
  const std::string recording = read_text(out / "session.rec");
  write(out / "session.rec", recording.substr(0, recording.size() - 100));
  const Outcome cut = act(import);
  EXPECT_EQ(cut.exit_code, 2);
  EXPECT_THAT(cut.output, HasSubstr("is not whole"));
  write(out / "session.rec", recording);
  EXPECT_THAT(act("show ada").output, Not(HasSubstr("small")));
  const Outcome taken = act(import);
  EXPECT_EQ(taken.exit_code, 0) << taken.output;
  EXPECT_THAT(taken.output, HasSubstr("the same bit for bit, and so are the numbers"));
  EXPECT_THAT(act(import).output, HasSubstr("already, as the attempt"));
  lab::store::Lab records({.folder = folder_ / "lab", .build = "test"});
  const auto attempts = records.attempts();
  ASSERT_EQ(attempts.size(), 1u);
  EXPECT_EQ(attempts[0].mode, "guided");
  EXPECT_EQ(attempts[0].status, "ended");
  std::size_t same = 0;
  const auto said = nlohmann::json::parse(numbers);
  for (const auto& metric : said["metrics"]) {
    for (const lab::store::MetricResult& kept : records.metrics(attempts[0].id)) {
      if (metric["key"] != kept.metric) continue;
      EXPECT_EQ(metric["value"].is_null(), !kept.value.has_value());
      EXPECT_EQ(metric.value("value", nlohmann::json()), kept.value ? nlohmann::json(*kept.value) : nlohmann::json());
      ++same;
    }
  }
  EXPECT_GT(same, 20u);
}

TEST_F(LabCommand, ARecordStoreThatIsAwayKeepsNobodyFromTraining) {
  EXPECT_THAT(act("send").output, HasSubstr("there is no record store"));
  for (const auto& [arguments, says] :
       {std::pair{"connect", "--store URL"},
        std::pair{"connect --store http://lrs.example/xapi --home-page https://a/", "is no address"},
        std::pair{"connect --store https://lrs.example/xapi --home-page https://a", "is no home page"},
        std::pair{"connect --store https://lrs.example/xapi --home-page https://a/ --key /dev/null", "is no file"}}) {
    const Outcome refused = act(arguments);
    EXPECT_EQ(refused.exit_code, 2) << arguments;
    EXPECT_THAT(refused.output, HasSubstr(says));
  }
  // Port 1 of this computer: nobody is there.
  EXPECT_EQ(act("connect --store http://127.0.0.1:1/xapi --home-page https://lab.example/stylet/").exit_code, 0);
  lab::store::Lab({.folder = folder_ / "lab", .build = "test"}).enrolled("ada");
  EXPECT_THAT(act("consent ada").output, HasSubstr("record_store  never asked"));
  EXPECT_EQ(act("consent ada --given").exit_code, 2);
  EXPECT_EQ(act("consent ada --purpose advertising --given").exit_code, 2);
  EXPECT_THAT(act("consent ada --purpose record_store --given").output, HasSubstr("record_store  given 20"));
  const Outcome trained = run(train("--lockstep --seconds 0.5 --trainee ada"));
  EXPECT_EQ(trained.exit_code, 0) << trained.output;
  EXPECT_THAT(trained.output, HasSubstr("wait, the oldest since"));
  const Outcome sent = act("send");
  EXPECT_EQ(sent.exit_code, 1);
  EXPECT_THAT(sent.output, HasSubstr("0 statements delivered; 2 wait"));
  const Outcome elsewhere = act("connect --store http://127.0.0.1:2/xapi --home-page https://lab.example/stylet/");
  EXPECT_EQ(elsewhere.exit_code, 2);
  EXPECT_THAT(elsewhere.output, HasSubstr("--waiting send, or --waiting drop"));
  EXPECT_EQ(act("connect --off").exit_code, 0);
  EXPECT_THAT(act("send").output, HasSubstr("there is no record store"));
}

TEST_F(LabCommand, RetentionIsSaidBeforeItIsDone) {
  EXPECT_THAT(act("retain").output, HasSubstr("say for how long"));
  std::int64_t then = lab::store::system_ms() - std::int64_t{800} * 86'400'000;
  {
    lab::store::Lab records({.folder = folder_ / "lab", .build = "test", .clock = [&then] { return then += 1; }});
    for (const char* name : {"ada", "bob"}) {
      const auto person = records.enrolled(name);
      const std::string attempt =
          records.begin({.trainee = person.id, .scenario = {.sha256 = std::string(64, 'a'), .name = "scenario"}});
      records.end(attempt, {.total = 80, .pass_mark = 70, .passed = true});
    }
    records.enrolled("cleo");
    records.set_consent(records.get("bob").id, lab::store::kResearch, true);
  }
  lab::store::Lab({.folder = folder_ / "lab", .build = "test"})
      .begin({.trainee = lab::store::Lab({.folder = folder_ / "lab"}).get("cleo").id,
              .scenario = {.sha256 = std::string(64, 'a'), .name = "scenario"}});
  EXPECT_THAT(act("retain --days 900").output, HasSubstr("Nobody's records are older than 900 days"));
  const Outcome said = act("retain --days 730");
  EXPECT_EQ(said.exit_code, 1);
  EXPECT_THAT(said.output, testing::ContainsRegex("ada \\(.*1 attempts.*everything would be erased"));
  EXPECT_THAT(said.output, testing::ContainsRegex("bob \\(.*the numbers would stay"));
  EXPECT_THAT(said.output, Not(HasSubstr("cleo")));
  EXPECT_THAT(act("list").output, HasSubstr("2 have not trained for the 730 days"));
  EXPECT_EQ(act("retain --days 1 --yes").exit_code, 2) << "said before it is done";
  EXPECT_THAT(act("list").output, HasSubstr("cleo"));
  const Outcome done = act("retain --yes");
  EXPECT_EQ(done.exit_code, 0);
  const Outcome list = act("list");
  EXPECT_THAT(list.output, Not(HasSubstr("ada")));
  EXPECT_THAT(list.output, Not(HasSubstr("bob")));
  EXPECT_THAT(list.output, HasSubstr("cleo"));
  EXPECT_THAT(list.output, HasSubstr("numbers of 1 who are nobody"));
  EXPECT_EQ(act("export --research").lines(), 2) << "bob's, of nobody";
  EXPECT_EQ(act("retain --off").exit_code, 0);
  EXPECT_EQ(act("retain").exit_code, 2);
}

TEST_F(LabCommand, WhoIsEnrolledOnceIsThere) {
  EXPECT_EQ(act("enroll").exit_code, 2);
  const Outcome ada = act("enroll 'Ada Lovelace'");
  EXPECT_EQ(ada.exit_code, 0) << ada.output;
  const std::string pseudonym =
      lab::store::Lab({.folder = folder_ / "lab", .build = "test"}).get("Ada Lovelace").pseudonym;
  EXPECT_THAT(ada.output, HasSubstr(pseudonym));
  EXPECT_THAT(act("list").output, HasSubstr("Ada Lovelace"));
  const Outcome again = act("enroll 'Ada Lovelace'");
  EXPECT_EQ(again.exit_code, 2);
  EXPECT_THAT(again.output, HasSubstr(pseudonym));
}

TEST_F(LabCommand, APinIsDigitsAndIsKeptAsAHash) {
  lab::store::Lab({.folder = folder_ / "lab", .build = "test"}).enrolled("ada");
  const auto piped = [&](const std::string& pin) {
    return support::run_in_shell(
        fmt::format("echo '{}' | {} '{}' lab pin ada --lab {} 2>&1", pin, kTestEnvironment, STYLET_COMMAND, lab()));
  };
  EXPECT_EQ(piped("12a4").exit_code, 2);
  EXPECT_EQ(piped("24681357").exit_code, 0);
  for (const std::string& file : files_below(folder_ / "lab")) {
    EXPECT_THAT(read_text(folder_ / "lab" / file), Not(HasSubstr("24681357"))) << file;
  }
  EXPECT_EQ(act("pin ada --off").exit_code, 0);
  EXPECT_EQ(run("train tutorial --ask-trainee --trainee ada").exit_code, 2);
}

TEST_F(LabCommand, TheServerSaysWhereItIsAndLetsOnlyInstructorsIn) {
  EXPECT_THAT(act("serve").output, HasSubstr("serve --course NAME"));
  EXPECT_THAT(act("serve --course needle_basics").output, HasSubstr("nobody may log in yet"));
  const auto piped = [&](const std::string& password) {
    return support::run_in_shell(fmt::format("echo '{}' | {} '{}' lab instructor ines --lab {} 2>&1", password,
                                             kTestEnvironment, STYLET_COMMAND, lab()));
  };
  EXPECT_EQ(piped("short").exit_code, 2);
  const auto made = piped("right horse battery");
  EXPECT_EQ(made.exit_code, 0) << made.output;
  EXPECT_THAT(made.output, Not(HasSubstr("right horse")));
  for (const std::string& file : files_below(folder_ / "lab")) {
    EXPECT_THAT(read_text(folder_ / "lab" / file), Not(HasSubstr("right horse"))) << file;
  }
  RunningCommand server(fmt::format("lab serve --course needle_basics --port 0 --lab {}", lab()));
  const std::string at = server.wait_for("http://");
  const std::string host = at.substr(0, at.find('/'));
  ASSERT_THAT(host, testing::StartsWith("127.0.0.1:")) << server.output();
  const auto curl = [&](const std::string& arguments) {
    return support::run_in_shell(fmt::format("curl -s -i --max-time 20 {} 2>&1", arguments)).output;
  };
  if (std::system("command -v curl >/dev/null") != 0) GTEST_SKIP() << "no curl";
  EXPECT_THAT(curl("http://" + host + "/"), HasSubstr("401"));
  EXPECT_THAT(curl(fmt::format("-H 'Host: evil.example' http://{}/", host)), HasSubstr("421"));
  EXPECT_THAT(curl(fmt::format("--path-as-is http://{}/../../etc/passwd", host)), Not(HasSubstr("root:")));
  const std::string jar = (folder_ / "jar").string();
  EXPECT_THAT(curl(fmt::format("-c {} -d 'name=ines&password=right+horse+battery' http://{}/login", jar, host)),
              HasSubstr("303"));
  const std::string page = curl(fmt::format("-b {} http://{}/", jar, host));
  EXPECT_THAT(page, HasSubstr("200 OK"));
  EXPECT_THAT(page, HasSubstr("Who stands where"));
  server.interrupt();
  EXPECT_EQ(server.end(), 0);
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
