// The debrief as a page: what it shows, what it must not do, and that a real browser shows it.
#include "engine/debrief/page.h"

#include "engine/debrief/debrief_files.h"
#include "tests/debrief/sample_debrief.h"
#include "tests/support/sanitized.h"
#include "tests/support/shell.h"
#include "tests/support/temporary_folder.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <regex>
#include <string>

namespace stylet::debrief {
namespace {

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

/// data-value of each element with data-key.
std::map<std::string, std::string> shown_values(const std::string& html) {
  std::map<std::string, std::string> values;
  const std::regex cell(R"re(data-key="([a-z_]+)" data-value="([^"]*)")re");
  for (auto it = std::sregex_iterator(html.begin(), html.end(), cell); it != std::sregex_iterator(); ++it) {
    values[(*it)[1]] = (*it)[2];
  }
  return values;
}

TEST(DebriefPage, ShowsTheNumbersOfTheJsonWithoutScripts) {
  const DebriefData data = tests::sample_debrief();
  const std::string html = debrief_page(data);
  const auto json = nlohmann::json::parse(to_json(data).dump());
  const auto values = shown_values(html);
  for (const auto& metric : json["metrics"]) {
    const std::string key = metric["key"];
    if (metric["value"].is_null()) {
      EXPECT_FALSE(values.contains(key));
      continue;
    }
    ASSERT_TRUE(values.contains(key)) << key;
    EXPECT_EQ(std::stod(values.at(key)), metric["value"].get<double>()) << key;
  }
  EXPECT_EQ(json["score"]["total"], 81.25);
  EXPECT_NE(html.find("id=\"total\" data-value=\"81.25\""), std::string::npos);
  EXPECT_NE(html.find("not measured"), std::string::npos);
  EXPECT_NE(html.find("Passed"), std::string::npos);
  EXPECT_EQ(count_of(html, "<polyline"), 8u) << "two, four and four lines, less those without an expert";
}

TEST(DebriefPage, SaysWhenTheHandFeltLessThanTheForcesShown) {
  DebriefData data = tests::sample_debrief();
  EXPECT_EQ(debrief_page(data).find("felt at"), std::string::npos);
  EXPECT_EQ(to_json(data)["force_scale"], 1);
  data.force_scale = 0.44;
  EXPECT_NE(debrief_page(data).find("felt at 44 % of the forces below"), std::string::npos);
  EXPECT_EQ(to_json(data)["force_scale"], 0.44);
}

TEST(DebriefPage, ListsTheAttemptsBeforeItsOwn) {
  DebriefData data = tests::sample_debrief();
  EXPECT_EQ(debrief_page(data).find("id=\"attempts\""), std::string::npos);
  data.attempts = {{.folder = "attempt-1", .duration_s = 41, .score = DebriefScore{.total = 54.4, .pass_mark = 70}},
                   {.folder = "attempt-2", .duration_s = 9, .score = DebriefScore{.pass_mark = 70, .done = false}}};
  const std::string html = debrief_page(data);
  EXPECT_NE(html.find("<td>1</td><td>54 / 100</td><td>\u2717 not passed</td><td>41.0 s</td>"
                      "<td>attempt-1/debrief.html</td>"),
            std::string::npos);
  EXPECT_NE(html.find("<td>2</td><td>&ndash;</td><td>nothing was sampled or treated</td>"), std::string::npos);
  EXPECT_NE(html.find("<td>3</td>"), std::string::npos) << "this one";
  EXPECT_EQ(to_json(data)["attempts_before"][0]["score"]["total"], 54.4);
}

TEST(DebriefPage, OfNothingDoneSaysSo) {
  DebriefData data = tests::sample_debrief();
  data.score->done = data.score->passed = false;
  data.start_seed = 7;
  EXPECT_NE(debrief_page(data).find("nothing was sampled or treated"), std::string::npos);
  EXPECT_NE(debrief_page(data).find("start 7"), std::string::npos);
  EXPECT_EQ(to_json(data)["start_seed"], 7);
}

// Force limits come in bursts: their numbers must stay readable.
TEST(DebriefPage, MarksThatLieCloseShareALabel) {
  DebriefData data = tests::sample_debrief();
  data.events.clear();
  for (int i = 0; i < 12; ++i) data.events.push_back({3 + 0.01 * i, EventKind::safety, "Force limited", ""});
  data.events.push_back({6, EventKind::puncture, "Into fat", ""});
  data.events.push_back({6.02, EventKind::puncture, "Into muscle", ""});
  const std::string html = debrief_page(data);
  EXPECT_EQ(count_of(html, ">1\u201312</text>"), 3u) << "in the course and two plots";
  EXPECT_EQ(count_of(html, ">13, 14</text>"), 3u);
  EXPECT_EQ(count_of(html, "s: Force limited</title>"), 3u * 12u) << "each is still there to be pointed at";
}

TEST(DebriefPage, NeedsNothingFromOutside) {
  const std::string html = debrief_page(tests::sample_debrief());
  for (const char* way :
       {"http:", "https:", "//cdn", "<link", "@import", "url(", "fetch(", "XMLHttpRequest", "href="}) {
    EXPECT_EQ(html.find(way), std::string::npos) << way;
  }
  EXPECT_NE(html.find("Content-Security-Policy\" content=\"default-src 'none'; img-src data:;"), std::string::npos);
  EXPECT_EQ(count_of(html, " src="), count_of(html, " src=\"data:image/png;base64,"));
}

TEST(DebriefPage, EveryTextIsEscaped) {
  const std::string html = debrief_page(tests::sample_debrief(tests::kHostile));
  EXPECT_EQ(count_of(html, "<script"), 2u) << "the data and the page's own";
  EXPECT_EQ(count_of(html, "</script"), 2u);
  EXPECT_EQ(count_of(html, "<img"), 1u) << "the ultrasound image";
  EXPECT_EQ(count_of(html, "</title>"), 1u + count_of(debrief_page(tests::sample_debrief()), "</title>") - 1u);
  // The data come through whole.
  const std::size_t begin = html.find('>', html.find("id=\"data\"")) + 1;
  const auto json = nlohmann::json::parse(html.substr(begin, html.find("</script", begin) - begin));
  EXPECT_EQ(json["title"], tests::kHostile);
}

TEST(DebriefPage, StandsWithoutScoreExpertTargetAndPath) {
  const std::string html = debrief_page({});
  EXPECT_NE(html.find("Measured"), std::string::npos);
  EXPECT_EQ(html.find("nan"), std::string::npos);
}

TEST(DebriefFiles, CsvHasTheSameNumbersAndOneRowForEach) {
  const DebriefData data = tests::sample_debrief(tests::kHostile);
  const std::string csv = debrief_csv(data);
  EXPECT_NE(csv.find("\r\nmetric,targeting,Distance to the target,1.23456789,mm,0.5,40,50,false,,tip to centre\r\n"),
            std::string::npos)
      << csv;
  EXPECT_NE(csv.find("score,total,passed,81.25,"), std::string::npos);
  EXPECT_EQ(count_of(csv, "\r\nevent,"), data.events.size());
  EXPECT_NE(csv.find("\"\"\"'></title>"), std::string::npos) << "quotes are doubled";
  const std::string path = path_csv(data);
  EXPECT_EQ(count_of(path, "\r\ntrainee,"), data.path.size());
  EXPECT_EQ(count_of(path, "\r\nexpert,"), data.expert_path.size());
}

TEST(DebriefFiles, JsonKeepsEveryMoment) {
  const DebriefData data = tests::sample_debrief();
  const auto json = to_json(data);
  ASSERT_EQ(json["path"]["time_s"].size(), data.path.size());
  EXPECT_EQ(json["path"]["axial_n"][250].get<double>(), data.path[250].axial);
  EXPECT_EQ(json["expert_path"]["tip_m"][10][2].get<double>(), data.expert_path[10].tip.z());
  EXPECT_EQ(json["events"][4]["kind"], "sample");
}

/// What a headless browser made of the page: the document after its scripts ran, and what it wrote to the console.
struct Seen {
  std::string document;
  std::string console;
};
/// Empty: there is none.
std::string browser() {
  for (const char* name : {"chromium-headless-shell", "chromium"}) {
    if (std::system(fmt::format("command -v {} >/dev/null", name).c_str()) == 0) return name;
  }
  return {};
}
Seen open_in_browser(const std::string& html, const support::TemporaryFolder& folder) {
  const auto page = folder.write("debrief.html", html);
  const std::string command = fmt::format(
      "HOME={0} timeout 60 {1} --headless --no-sandbox --disable-gpu --disable-dev-shm-usage "
      "--disable-background-networking --no-first-run --host-resolver-rules='MAP * ~NOTFOUND' "
      "--user-data-dir={0}/user "
      "--enable-logging=stderr --virtual-time-budget=2000 --dump-dom 'file://{2}' "
      "2>{0}/console",
      folder.path().string(), browser(), page.string());
  Seen seen;
  seen.document = support::run_in_shell(command).output;
  std::ifstream console(folder / "console");
  for (std::string line; std::getline(console, line);) {
    if (line.find("CONSOLE") != std::string::npos) seen.console += line + '\n';
  }
  return seen;
}

TEST(DebriefPage, OpensInABrowser) {
  if (support::kSanitized) GTEST_SKIP() << "the browser is looked at in Release";
  if (browser().empty()) GTEST_SKIP() << "no chromium-headless-shell, no chromium";
  const support::TemporaryFolder folder;
  const DebriefData data = tests::sample_debrief(tests::kHostile);
  const Seen seen = open_in_browser(debrief_page(data), folder);
  EXPECT_EQ(seen.console, "") << "errors, refused requests and scripts are told there";
  const std::string html = seen.document.substr(0, seen.document.find('>', seen.document.find("<html")));
  EXPECT_NE(html.find("data-ready=\"1\""), std::string::npos) << html;
  EXPECT_EQ(html.find("data-problems"), std::string::npos) << html;
  EXPECT_EQ(html.find("data-hacked"), std::string::npos) << html;
  EXPECT_NE(seen.document.find(fmt::format("data-segments=\"{}\"", data.path.size() - 1)), std::string::npos);
  EXPECT_NE(seen.document.find("data-faces=\"4\""), std::string::npos);
  EXPECT_GE(count_of(seen.document, "class=\"cursor\""), 3u) << "the moment in each plot";
  const auto values = shown_values(seen.document);
  EXPECT_EQ(std::stod(values.at("targeting")), *data.metrics[0].value);
}

/// What a reader sees: no scripts, no styles, no tags.
std::string text_of(std::string document) {
  for (const char* element : {"script", "style"}) {
    for (std::size_t at = 0; (at = document.find(fmt::format("<{}", element), at)) != std::string::npos;) {
      document.erase(at, document.find(fmt::format("</{}", element), at) - at);
    }
  }
  return document;
}

// A session of one moment, cut off before anything was measured, and one without even that.
TEST(DebriefPage, LeavesOutSectionsWithoutData) {
  if (support::kSanitized) GTEST_SKIP() << "the browser is looked at in Release";
  if (browser().empty()) GTEST_SKIP() << "no chromium-headless-shell, no chromium";
  const support::TemporaryFolder folder;
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  DebriefData moment = tests::sample_debrief();
  moment.path.resize(1);
  moment.path[0].target_distance = std::numeric_limits<double>::infinity();
  moment.path[0].axial = kNone;
  moment.expert.clear();
  moment.expert_path.clear();
  moment.shaft.clear();
  moment.duration_s = 0;
  for (DebriefMetric& metric : moment.metrics) metric.value = kNone;
  for (const DebriefData& data : {moment, DebriefData{}}) {
    const Seen seen = open_in_browser(debrief_page(data), folder);
    EXPECT_EQ(seen.console, "");
    EXPECT_NE(seen.document.find("data-ready=\"1\""), std::string::npos);
    const std::string text = text_of(seen.document);
    for (const char* wrong : {"NaN", "undefined", "null", "Infinity", "nan", "inf "}) {
      const std::size_t at = text.find(wrong);
      EXPECT_EQ(at, std::string::npos) << text.substr(at - std::min<std::size_t>(at, 80), 120);
    }
  }
}

// What the tests above rely on: the page's own policy, and that the console tells.
TEST(DebriefPage, AScriptOrARequestSlippedInIsRefused) {
  if (support::kSanitized) GTEST_SKIP() << "the browser is looked at in Release";
  if (browser().empty()) GTEST_SKIP() << "no chromium-headless-shell, no chromium";
  const support::TemporaryFolder folder;
  std::string html = debrief_page(tests::sample_debrief());
  html.insert(html.find("<header>"),
              "<script>document.documentElement.dataset.hacked=1</script><img src=\"http://example.com/a.png\">");
  const Seen seen = open_in_browser(html, folder);
  EXPECT_EQ(seen.document.find("data-hacked"), std::string::npos);
  EXPECT_EQ(count_of(seen.console, "CONSOLE"), 2u) << seen.console;
}

}  // namespace
}  // namespace stylet::debrief
