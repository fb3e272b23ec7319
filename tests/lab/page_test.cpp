// The instructor's pages: what they say, hostile texts, a browser that opens them.
#include "engine/lab/page/page.h"
#include "engine/lab/statistics/learning_curve.h"
#include "tests/support/shell.h"
#include "tests/support/temporary_folder.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <sstream>
#include <string>
#include <vector>

namespace stylet::lab::page {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

constexpr std::int64_t kDay = 20'500;  // in 2026

course::Course sample_course(const std::string& title = "From phantom to ablation") {
  course::Course course{.name = "c", .title = title, .spacing = {.attempts_a_day = 10, .pause_days = 30}};
  for (const char* name : {"phantom", "biopsy"}) {
    course::Exercise exercise{
        .name = name, .scenario = std::string(name) + ".json", .focus = "elapsed_time", .practice = 2, .days = 2};
    exercise.gate = statistics::learning_gate(exercise.rates, 30, 0.05);
    exercise.monitoring = course::Monitoring{
        .attempts = 50, .false_alarm = 0.2, .limit = statistics::monitoring_limit(exercise.rates, 50, 0.2)};
    exercise.retention = {{.after_days = 28, .attempts = 2}};
    course.exercises.push_back(exercise);
  }
  course.exercises[1].after = {"phantom"};
  return course;
}

/// A trainee whose phantom attempts pass ('1'), fail ('0') or are broken off ('x'), four a day.
TraineeView trainee(const course::Course& course, const std::string& pseudonym, const std::string& phantom,
                    const std::string& name = "") {
  TraineeView view{.person = {.id = pseudonym, .pseudonym = pseudonym, .name = name}};
  view.counted.resize(course.exercises.size());
  view.passed.resize(course.exercises.size());
  view.at_earlier_versions.resize(course.exercises.size());
  std::vector<std::vector<course::Taken>> taken(course.exercises.size());
  for (std::size_t i = 0; i < phantom.size(); ++i) {
    const std::int64_t day = kDay + static_cast<std::int64_t>(i) / 4;
    store::AttemptRecord attempt{.id = fmt::format("00000000-0000-7000-8000-{:012}", i),
                                 .pseudonym = pseudonym,
                                 .scenario = "phantom",
                                 .number = static_cast<int>(i) + 1,
                                 .mode = "graded"};
    attempt.started_ms = day * 86'400'000 + static_cast<std::int64_t>(i) * 600'000;
    attempt.status = phantom[i] == 'x' ? "aborted" : "ended";
    if (phantom[i] != 'x') {
      attempt.passed = phantom[i] == '1';
      attempt.total = phantom[i] == '1' ? 82 : 41;
      if (phantom[i] == '0') attempt.failed_critical = "tumour_content";
    }
    // Slower at first, never quite alike.
    view.metrics[attempt.id] = {
        {.metric = "elapsed_time",
         .value = 60 + 120 * std::exp(-static_cast<double>(i) / 4) + 9 * std::sin(7.0 * static_cast<double>(i))}};
    taken[0].push_back(
        {.day = day, .outcome = attempt.succeeded() ? statistics::Outcome::pass : statistics::Outcome::fail});
    view.counted[0].push_back(attempt);
    view.passed[0].push_back(attempt.succeeded());
    view.attempts.push_back(attempt);
  }
  const std::int64_t today = kDay + static_cast<std::int64_t>(phantom.size()) / 4;
  view.exercises = course::progress(course, taken, today);
  view.due = course::due(view.exercises, today);
  return view;
}

const PageFacts kFacts{.build = "test", .made_ms = kDay * 86'400'000};

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = 0; (at = text.find(part, at)) != std::string::npos; at += part.size()) ++count;
  return count;
}

std::string browser() {
  for (const char* name : {"chromium-headless-shell", "chromium"}) {
    if (std::system(fmt::format("command -v {} >/dev/null", name).c_str()) == 0) return name;
  }
  return {};
}

TEST(LabPage, ATraineesPageHasEveryAttemptAsAPointAndInTheTable) {
  const course::Course course = sample_course();
  const std::string passes = "0x1101110111111101111111111111110001";
  const TraineeView view = trainee(course, "7Q4M2KX", passes);
  const std::string html = trainee_page(course, view, kFacts);
  // Two are practice; each graded one is on one of the two charts, each that ended on that of the metric.
  EXPECT_EQ(count_of(html, "<circle class=\"point"), passes.size() - 2 + passes.size() - 1);
  EXPECT_EQ(count_of(html, "<tr><th scope=\"row\"><bdi>phantom</bdi></th>"), passes.size());
  EXPECT_THAT(html, HasSubstr("limit 3.52"));
  EXPECT_THAT(html, HasSubstr("who fails 30 % with 0.041"));
  EXPECT_THAT(html, HasSubstr("Failures after the gate (CUSUM)"));
  EXPECT_THAT(html, HasSubstr("failures have mounted up"));
  EXPECT_THAT(html, HasSubstr("Levels off at"));
  EXPECT_THAT(html, Not(HasSubstr("</i></span>"))) << "a key without a word";
  EXPECT_THAT(html, HasSubstr("broken off"));
  EXPECT_THAT(html, HasSubstr("failed: tumour_content"));
  // Few attempts: points and the reason.
  const std::string few = trainee_page(course, trainee(course, "7Q4M2KX", "11101"), kFacts);
  EXPECT_THAT(few, HasSubstr("No fitted curve: 5 attempts are too few"));
  EXPECT_THAT(few, Not(HasSubstr("Levels off")));
  EXPECT_THAT(trainee_page(course, trainee(course, "7Q4M2KX", ""), kFacts), Not(HasSubstr("nan")));
}

TEST(LabPage, TheCohortsPageSaysWhoStandsWhereAndLinksToEachByPseudonym) {
  const course::Course course = sample_course();
  const std::vector<TraineeView> views{trainee(course, "AAAAAA1", "110111111111111111111"),
                                       trainee(course, "BBBBBB2", "11011"), trainee(course, "CCCCCC3", "")};
  const std::string html = cohort_page(course, views, kFacts);
  for (const TraineeView& view : views)
    EXPECT_THAT(html, HasSubstr(fmt::format("href=\"{}.html\"", view.person.pseudonym)));
  EXPECT_THAT(html, HasSubstr("<td class=\"competent\""));
  EXPECT_THAT(html, HasSubstr("4 of 5 passed"));
  EXPECT_THAT(html, HasSubstr("<td class=\"locked\""));
  EXPECT_THAT(html, HasSubstr("<td class=\"practising\""));
  EXPECT_THAT(html, HasSubstr(fmt::format("{} trainees", 3)));
}

const std::string kHostile =
    "</title></style><script>document.title='hacked'</script><img src=x onerror=alert(1)>\" "
    "onmouseover=\"x\xe2\x80\xae";

TEST(LabPage, HostileTextsAreTextAndNothingElse) {
  course::Course course = sample_course(kHostile);
  course.exercises[0].name = kHostile;
  TraineeView view = trainee(course, "7Q4M2KX", "0x110", kHostile);
  for (store::AttemptRecord& attempt : view.attempts) {
    attempt.scenario = kHostile;
    attempt.excluded = kHostile;
    attempt.failed_critical = kHostile;
  }
  for (const std::string& html :
       {trainee_page(course, view, kFacts), cohort_page(course, std::vector{view}, kFacts)}) {
    EXPECT_THAT(html, HasSubstr("default-src 'none'; style-src 'unsafe-inline'\""));
    for (const char* never : {"<script", "<img", "\" onmouseover", "http://", "https://", "url("})
      EXPECT_THAT(html, Not(HasSubstr(never)));
  }
}

TEST(LabPage, WhoMissesABarHasNotPassedAlsoWhereRatesAreTold) {
  const course::Course course = sample_course();
  TraineeView view = trainee(course, "7Q4M2KX", "1111111111");
  std::fill_n(view.passed[0].begin() + 2, 4, false);  // the scenario's marks are reached, a bar is not
  const std::string html = trainee_page(course, view, kFacts);
  EXPECT_THAT(html, HasSubstr("Passed 6 of 10"));
  EXPECT_THAT(html, HasSubstr("between 31 and 83 %")) << "Wilson's of 6 of 10";
  EXPECT_EQ(count_of(html, "a bar of the course is missed"), 8u) << "on both charts";
  EXPECT_THAT(cohort_page(course, std::vector{view}, kFacts), HasSubstr("6 of 10 passed"));
}

TEST(LabPage, TheCurveIsOfLogarithmsWithTheIntervalOfFewPoints) {
  const course::Course course = sample_course();
  TraineeView view = trainee(course, "7Q4M2KX", "1111111111");
  // Falling to 60 s by a curve of logarithms, each value 5 % off by turns.
  for (std::size_t i = 0; i < 10; ++i) {
    const double fall = std::exp(-static_cast<double>(i) / 2);
    view.metrics[view.attempts[i].id] = {
        {.metric = "elapsed_time", .value = 60 * std::exp(1.2 * fall) * (i % 2 == 0 ? 1.05 : 1 / 1.05)}};
  }
  const std::string html = trainee_page(course, view, kFacts);
  EXPECT_THAT(html, HasSubstr("fitted to logarithms"));
  const std::size_t at = html.find("Levels off at ");
  ASSERT_NE(at, std::string::npos);
  double plateau = 0;
  double low = 0;
  double high = 0;
  ASSERT_EQ(std::sscanf(html.c_str() + at, "Levels off at %lf s (95 %%: %lf to %lf)", &plateau, &low, &high), 3);
  EXPECT_NEAR(plateau, 60, 3);
  EXPECT_LT(low, 60);
  EXPECT_GT(high, 60);
  EXPECT_NEAR(plateau / low, high / plateau, 0.03) << "as far below as above, of logarithms";
  // Ten points less three parameters: 2.365 standard errors, not 1.96.
  std::vector<double> logarithms;
  for (const store::AttemptRecord& attempt : view.attempts) {
    logarithms.push_back(std::log(view.metrics[attempt.id][0].value.value_or(1)));
  }
  const auto fit = statistics::fit_shape(statistics::CurveShape::exponential, logarithms, {.low = 3, .high = 7});
  EXPECT_NEAR(std::log(high / plateau) / fit.standard_error(0), 2.365, 0.15);
}

/// In a frame so wide, what a script beside it sees of the page.
struct Seen {
  double overflow = 0;  ///< of the page's width, px
  std::string ground{};
  std::string ink{};
  int focusable = 0;
  int scrolling = 0;    ///< parts that scroll sideways
  int unreachable = 0;  ///< of those, by keys
};

Seen seen(const std::string& html, int width, bool dark) {
  const support::TemporaryFolder folder;
  folder.write("page.html", html);
  const auto frame = folder.write("frame.html", fmt::format(R"(<!DOCTYPE html><body style="margin:0">
<iframe id="f" src="page.html" style="width:{}px;height:800px;border:0"></iframe><pre id="out"></pre><script>
addEventListener("load", () => {{
  const d = document.getElementById("f").contentDocument, w = d.defaultView, style = w.getComputedStyle(d.body);
  const scrolling = [...d.querySelectorAll("*")].filter(e => e.scrollWidth > e.clientWidth + 1 &&
    ["auto", "scroll"].includes(w.getComputedStyle(e).overflowX));
  document.getElementById("out").textContent = "seen: " + [d.documentElement.scrollWidth - d.documentElement.clientWidth,
    style.backgroundColor.replace(/ /g, ""), style.color.replace(/ /g, ""),
    [...d.querySelectorAll("a[href], [tabindex='0'], summary")].length, scrolling.length,
    scrolling.filter(e => e.tabIndex < 0).length].join(" ") + " .";
}});
</script></body>)",
                                                            width));
  const std::string command = fmt::format(
      "HOME={0} timeout 60 {1} --headless --no-sandbox --disable-gpu --disable-dev-shm-usage --no-first-run "
      "--disable-background-networking --host-resolver-rules='MAP * ~NOTFOUND' --user-data-dir={0}/user "
      "--allow-file-access-from-files --window-size=1400,1000 --blink-settings=preferredColorScheme={3} "
      "--virtual-time-budget=3000 --dump-dom 'file://{2}' 2>/dev/null",
      folder.path().string(), browser(), frame.string(), dark ? 0 : 1);
  const std::string document = support::run_in_shell(command).output;
  Seen result;
  std::istringstream words(document.substr(std::min(document.find("seen: "), document.size())));
  std::string word;
  words >> word >> result.overflow >> result.ground >> result.ink >> result.focusable >> result.scrolling >>
      result.unreachable;
  EXPECT_TRUE(words) << document.substr(0, 2000);
  return result;
}

TEST(LabPage, FitsAPhoneIsReadableInTheDarkAndReachedByKeys) {
  if (browser().empty()) GTEST_SKIP() << "no chromium-headless-shell, no chromium";
  const course::Course course = sample_course();
  const TraineeView view = trainee(course, "7Q4M2KX", "0x1101110111111101111111111111110001", "Ada");
  for (const std::string& html :
       {trainee_page(course, view, kFacts), cohort_page(course, std::vector{view}, kFacts)}) {
    const Seen phone = seen(html, 360, false);
    EXPECT_LE(phone.overflow, 0) << "what is wide scrolls by itself";
    EXPECT_GT(phone.scrolling, 0);
    EXPECT_EQ(phone.unreachable, 0);
    EXPECT_GE(phone.focusable, 2);
    EXPECT_EQ(phone.ground, "rgb(246,247,248)");
    const Seen dark = seen(html, 1200, true);
    EXPECT_LE(dark.overflow, 0);
    EXPECT_EQ(dark.ground, "rgb(20,25,30)");
    EXPECT_EQ(dark.ink, "rgb(228,234,238)");
  }
}

TEST(LabPage, IsPrinted) {
  if (browser().empty()) GTEST_SKIP() << "no chromium-headless-shell, no chromium";
  const support::TemporaryFolder folder;
  const course::Course course = sample_course();
  const auto page = folder.write(
      "page.html", trainee_page(course, trainee(course, "7Q4M2KX", "0x1101110111111101111111111111110001"), kFacts));
  support::run_in_shell(fmt::format(
      "HOME={0} timeout 60 {1} --headless --no-sandbox --disable-gpu --disable-dev-shm-usage --no-first-run "
      "--disable-background-networking --host-resolver-rules='MAP * ~NOTFOUND' --user-data-dir={0}/user "
      "--no-pdf-header-footer --print-to-pdf={0}/page.pdf 'file://{2}' 2>/dev/null",
      folder.path().string(), browser(), page.string()));
  std::ifstream file(folder / "page.pdf", std::ios::binary);
  const std::string pdf{std::istreambuf_iterator<char>(file), {}};
  EXPECT_EQ(pdf.substr(0, 5), "%PDF-");
  const std::size_t pages = count_of(pdf, "/Type /Page") - count_of(pdf, "/Type /Pages");
  EXPECT_GE(pages, 1u);
  EXPECT_LE(pages, 4u) << "charts and 36 attempts";
}

TEST(LabPage, TenThousandAttemptsOfAHundredTraineesFitInAPage) {
  const course::Course course = sample_course();
  std::vector<TraineeView> views;
  for (int i = 0; i < 100; ++i) views.push_back(trainee(course, fmt::format("A{:05}0", i), "1101"));
  EXPECT_LT(cohort_page(course, views, kFacts).size(), 3u << 20);
  std::string many;
  for (int i = 0; i < 1000; ++i) many += i % 9 == 0 ? '0' : '1';
  EXPECT_LT(trainee_page(course, trainee(course, "7Q4M2KX", many), kFacts).size(), 3u << 20);
}

TEST(LabPage, OpensInABrowserWithoutAWordOnItsConsole) {
  if (browser().empty()) GTEST_SKIP() << "no chromium-headless-shell, no chromium";
  const support::TemporaryFolder folder;
  const course::Course course = sample_course(kHostile);
  const TraineeView view = trainee(course, "7Q4M2KX", "0x1101110111111101111111111111110001", kHostile);
  const auto open = [&](const std::string& html) {
    const auto page = folder.write("page.html", html);
    const std::string command = fmt::format(
        "HOME={0} timeout 60 {1} --headless --no-sandbox --disable-gpu --disable-dev-shm-usage --no-first-run "
        "--disable-background-networking --host-resolver-rules='MAP * ~NOTFOUND' --user-data-dir={0}/user "
        "--enable-logging=stderr --virtual-time-budget=2000 --dump-dom 'file://{2}' 2>{0}/console",
        folder.path().string(), browser(), page.string());
    const std::string document = support::run_in_shell(command).output;
    std::ifstream console(folder / "console");
    for (std::string line; std::getline(console, line);) EXPECT_EQ(line.find("CONSOLE"), std::string::npos) << line;
    return document;
  };
  for (const std::string& html :
       {trainee_page(course, view, kFacts), cohort_page(course, std::vector{view}, kFacts)}) {
    const std::string document = open(html);
    EXPECT_THAT(document, HasSubstr("7Q4M2KX"));
    EXPECT_THAT(document, Not(HasSubstr("<title>hacked")));
    EXPECT_EQ(count_of(document, "<script"), 0u);
    EXPECT_EQ(count_of(document, "<circle"), count_of(html, "<circle")) << "every point is drawn";
  }
  if (const char* keep = std::getenv("STYLET_KEEP_PAGES")) {  // to be looked at
    const course::Course shown = sample_course();
    const std::vector<TraineeView> views{trainee(shown, "7Q4M2KX", "0x1101110111111101111111111111110001", "Ada"),
                                         trainee(shown, "AAAAAA1", "110111111111111111111"),
                                         trainee(shown, "BBBBBB2", "11011"), trainee(shown, "CCCCCC3", "")};
    std::ofstream(std::string(keep) + "/index.html") << cohort_page(shown, views, kFacts);
    for (const TraineeView& each : views)
      std::ofstream(fmt::format("{}/{}.html", keep, each.person.pseudonym)) << trainee_page(shown, each, kFacts);
  }
}

}  // namespace
}  // namespace stylet::lab::page
