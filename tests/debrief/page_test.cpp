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
#include <array>
#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

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
                      "<td><a href=\"attempt-1/debrief.html\">attempt-1/debrief.html</a></td>"),
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
  EXPECT_EQ(count_of(html, ">1\u201312</text>"), 3u * 3u) << "in the course and two plots, for three widths";
  EXPECT_EQ(count_of(html, ">13, 14</text>"), 3u * 3u);
  EXPECT_EQ(count_of(html, "s: Force limited</title>"), 3u * 12u) << "each is still there to be pointed at";
}

TEST(DebriefPage, LaysTheCoresOutToScaleAsTheJsonHasThem) {
  DebriefData data = tests::sample_debrief();
  EXPECT_EQ(debrief_page(data).find("class=\"cores\""), std::string::npos) << "there are none";
  data.cores = {{.to = {0, 0, 0.017F},
                 .target_share = 0.75F,
                 .pieces = {{.from = 0, .to = 0.75F, .tissue = 2, .target = true},
                            {.from = 0.75F, .to = 1, .low = 0.5F, .high = 1, .tissue = 1},
                            {.from = 0.75F, .to = 1, .low = 0, .high = 0.5F, .tissue = 0}}},
                {.to = {0, 0, 0.0085F}}};
  const std::string html = debrief_page(data);
  EXPECT_NE(html.find("<svg width=\"136\""), std::string::npos);
  EXPECT_NE(html.find("<svg width=\"68\""), std::string::npos) << "half as long";
  EXPECT_NE(html.find("core 1: 17 mm, 75 % target"), std::string::npos);
  EXPECT_EQ(count_of(html, "<rect x=\"0.7500\" y=\"0.5000\" width=\"0.2500\" height=\"0.5000\""), 1U);
  EXPECT_EQ(count_of(html, "<rect x=\"0.7500\" y=\"0.0000\""), 0U) << "a gap";
  const nlohmann::ordered_json cores = to_json(data)["cores"];
  ASSERT_EQ(cores.size(), 2U);
  EXPECT_EQ(cores[0]["length_mm"], 17) << "of single precision no more digits than there are";
  EXPECT_EQ(cores[0]["pieces"][1]["tissue"], "fat");
  EXPECT_EQ(cores[0]["pieces"][0]["to"], 0.75);
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

/// The points of a line of a plot in the units of its axes.
std::vector<std::array<double, 2>> line_of(const std::string& html, const std::string& plot,
                                           const std::string& line) {
  const auto number = [](const std::string& text, const std::string& name) {
    const std::size_t at = text.find(" " + name + "=\"");
    return at == std::string::npos ? 0.0 : std::stod(text.substr(at + name.size() + 3));
  };
  const std::size_t begin = html.find("id=\"" + plot + "\"");
  const std::string svg = html.substr(begin, html.find("</figure>", begin) - begin);
  const double x0 = number(svg, "data-x0"), x1 = number(svg, "data-x1");
  const double y0 = number(svg, "data-y0"), y1 = number(svg, "data-y1");
  const double height = number(svg, "data-bottom") - number(svg, "data-top");
  std::vector<std::array<double, 2>> points;
  const std::string tag = "<polyline class=\"line " + line + "\" points=\"";
  for (std::size_t at = svg.find(tag); at != std::string::npos; at = svg.find(tag, at + 1)) {
    const std::size_t from = at + tag.size();
    std::istringstream in(svg.substr(from, svg.find('"', from) - from));
    double x = 0, y = 0;
    for (char comma = 0; in >> x >> comma >> y;) {
      points.push_back({x0 + x / 1000 * (x1 - x0), y0 + (height - y) / height * (y1 - y0)});
    }
  }
  return points;
}

/// A needle that dents the skin by 12 mm before it is through, which springs back by 5 mm: goes in at `entry_s`.
std::vector<PathPoint> denting_path(double entry_s, double force) {
  std::vector<PathPoint> path;
  for (int i = 0; i <= 600; ++i) {
    const double t = 0.05 * i;
    const double way = 0.02 * (t - entry_s);  // past where it goes in
    const bool in = way > 1e-9;
    const double dent = std::clamp((way + 0.012) / 0.012, 0.0, 1.0);
    path.push_back({.time_s = t,
                    .tip = {0, 0, -way},
                    .tissue = in ? 1 : 0,
                    .inserted = in ? way + 0.005 : 0,
                    .force = in ? 0.1 * force : force * dent,
                    .axial = in ? 0.1 * force : force * dent});
  }
  return path;
}

// They come to the skin at different moments: laid on each other where they go in.
TEST(DebriefPage, PlotsOfDepthHaveTheSkinEntryOfBothAtZero) {
  DebriefData data = tests::sample_debrief();
  data.path = denting_path(11, 3);
  data.expert_path = denting_path(4, 2);
  const std::string html = debrief_page(data);
  for (const char* line : {"depth", "depth dashed"}) {
    const auto points = line_of(html, "depth_time", line);
    ASSERT_FALSE(points.empty()) << line;
    const auto in = std::ranges::find_if(points, [](const auto& p) { return p[1] > 2; });
    ASSERT_NE(in, points.end()) << line;
    EXPECT_NEAR((*in)[0], 0, 0.06 + 0.05) << line << ": a sample, and the tenth of a pixel that is written";
  }
  for (const auto& [line, peak] : {std::pair{"axial", 3.0}, std::pair{"axial dashed", 2.0}}) {
    const auto points = line_of(html, "force_depth", line);
    ASSERT_FALSE(points.empty()) << line;
    const auto most = std::ranges::max_element(points, {}, [](const auto& p) { return p[1]; });
    EXPECT_NEAR((*most)[1], peak, 0.02) << line;
    EXPECT_NEAR((*most)[0], 0, 0.1) << line << ": the puncture";
    // Half of the force when the skin is dented by half.
    const auto half = std::ranges::find_if(points, [peak = peak](const auto& p) { return p[1] > peak / 2; });
    EXPECT_NEAR((*half)[0], -6, 1.1) << line << ": a sample is a millimetre";
    EXPECT_GE(points.front()[0], -20.1) << line << ": not all of the way through the air";
  }
  EXPECT_NE(html.find("time from the skin entry, s"), std::string::npos);
  const auto json = to_json(data);
  EXPECT_NEAR(json["skin_entry_s"].get<double>(), 11, 0.06);
  EXPECT_NEAR(json["expert_skin_entry_s"].get<double>(), 4, 0.06);
}

TEST(DebriefPage, OfANeedleThatNeverEnteredHasTheTimeOfTheSession) {
  DebriefData data = tests::sample_debrief();
  data.path = denting_path(1000, 3);
  const std::string html = debrief_page(data);
  EXPECT_EQ(html.find("time from the skin entry, s"), std::string::npos);
  EXPECT_TRUE(to_json(data)["skin_entry_s"].is_null());
  EXPECT_TRUE(line_of(html, "force_depth", "axial").empty());
}

TEST(DebriefPage, LeadsToTheMomentsOfTheFilm) {
  DebriefData data = tests::sample_debrief();
  EXPECT_EQ(debrief_page(data).find("session.mp4"), std::string::npos) << "there is none";
  data.film = DebriefFilm{.file = "session.mp4", .from_s = 2, .to_s = 6, .speed = 0.5};
  const std::string html = debrief_page(data);
  EXPECT_NE(html.find("href=\"session.mp4#t=1.00\""), std::string::npos) << "2.5 s of the session";
  EXPECT_EQ(count_of(html, "href=\"session.mp4#t=6.40\""), 2u) << "the core in the course, and its picture";
  EXPECT_EQ(count_of(html, "href=\"session.mp4#t="), 4u) << "2.5, 5 and 5.2 s; not before or after the film";
  EXPECT_EQ(count_of(html, " href="), 5u) << "and that of the moment that is shown";
  EXPECT_EQ(to_json(data)["film"]["from_s"], 2);
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
/// @param how  of its switches, what is to be done with the page
Seen open_in_browser(const std::string& html, const support::TemporaryFolder& folder,
                     const std::string& how = "--dump-dom") {
  const auto page = folder.write("debrief.html", html);
  const std::string command = fmt::format(
      "HOME={0} timeout 60 {1} --headless --no-sandbox --disable-gpu --disable-dev-shm-usage "
      "--disable-background-networking --no-first-run --host-resolver-rules='MAP * ~NOTFOUND' "
      "--user-data-dir={0}/user "
      "--enable-logging=stderr --virtual-time-budget=2000 {3} 'file://{2}' "
      "2>{0}/console",
      folder.path().string(), browser(), page.string(), how);
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

/// A page with a script of the test's own, which the page's policy lets run, after those of the page.
std::string with_script(std::string html, const std::string& script) {
  const std::string tag = "<script nonce=";
  const std::size_t own = html.rfind(tag);
  const std::string nonce = html.substr(own + tag.size(), html.find('>', own) - own - tag.size());
  const std::size_t end = html.rfind("</body>");
  return html.insert(end, "<script nonce=" + nonce + ">" + script + "</script>");
}

/// As a long session of a real scenario fills it.
DebriefData full_debrief() {
  DebriefData data = tests::sample_debrief("Liver biopsy: a 23 mm tumour in segment V, 18G needle");
  for (PathPoint& p : data.path) p.time_s *= 13.7;
  for (PathPoint& p : data.expert_path) p.time_s *= 5;
  for (DebriefEvent& event : data.events) event.time_s *= 13.7;
  data.duration_s = 137;
  data.arrival_s *= 13.7;
  for (int i = 0; i < 8; ++i) {
    data.events.push_back({80 + 7.1 * i, EventKind::note, "Core",
                           "target 100.00 %: tumour 100.00 %; the stylet came out 4.0 mm behind the target"});
    data.metrics.push_back({.key = fmt::format("jerk_{}", i),
                            .title = "off the reference motion, time warped",
                            .unit = "mm/s^2.5",
                            .value = 13554,
                            .expert = 13554,
                            .definition = "square root of the time integral of the hub's squared jerk"});
    data.outlines.push_back(data.outlines.front());
    data.pictures.push_back(data.pictures.front());
  }
  data.attempts = {{.folder = "attempt-1", .duration_s = 41, .score = DebriefScore{.pass_mark = 70, .done = false}}};
  data.film = DebriefFilm{.file = "session.mp4", .to_s = 137};
  return data;
}

// All is seen by scrolling down alone, and no text of a figure is small or lies on another.
TEST(DebriefPage, IsReadableOnATelephone) {
  if (support::kSanitized) GTEST_SKIP() << "the browser is looked at in Release";
  if (browser().empty()) GTEST_SKIP() << "no chromium-headless-shell, no chromium";
  const support::TemporaryFolder folder;
  const std::string script = R"js(
    const wide = [], small = [], over = [], name = e => (e.id || e.className.baseVal || e.className || e.tagName) + ': '
      + e.textContent.slice(0, 20);
    let texts = 0;
    for (const e of document.body.querySelectorAll('*')) {
      const box = e.getBoundingClientRect();
      if (box.right > innerWidth + 0.5 || box.left < -0.5) wide.push(name(e));
      if (getComputedStyle(e).overflowX !== 'visible' && e.tagName !== 'CANVAS' && e.scrollWidth > e.clientWidth) wide.push('scrolls ' + name(e));
    }
    for (const svg of document.querySelectorAll('section svg')) {
      const seen = [...svg.querySelectorAll('text')].map(e => ({ e, box: e.getBoundingClientRect() }))
        .filter(t => t.box.width > 0 && !t.e.closest('.cursor'));
      texts += seen.length;
      seen.forEach(({ e, box }, i) => {
const to = e.getScreenCTM();
        if (parseFloat(getComputedStyle(e).fontSize) * Math.hypot(to.a, to.b) < 11) small.push(name(e));
        for (const other of seen.slice(i + 1)) {
          const b = other.box;
          if (Math.min(box.right, b.right) - Math.max(box.left, b.left) > 0.5 &&
              Math.min(box.bottom, b.bottom) - Math.max(box.top, b.top) > 3) over.push(name(e) + ' / ' + name(other.e));
        }
      });
    }
    document.body.innerHTML = '<p></p>';
    document.querySelector('p').textContent =
      `[width ${innerWidth}] [some ${texts > 40}] [wide ${wide}] [small ${small}] [over ${over}]`;
  )js";
  for (const int width : {390, 768, 1280}) {
    const Seen seen = open_in_browser(with_script(debrief_page(full_debrief()), script), folder,
                                      fmt::format("--window-size={},844 --hide-scrollbars --dump-dom", width));
    EXPECT_EQ(seen.console, "");
    const std::string told = fmt::format("[width {}] [some true] [wide ] [small ] [over ]", width);
    const std::size_t body = seen.document.find("[width");
    ASSERT_NE(body, std::string::npos);
    EXPECT_EQ(seen.document.substr(body, seen.document.find("</p>", body) - body), told);
  }
}

/// Of each link within a PDF, by its host and path, the pages that it is on. As Chromium writes them: uncompressed.
std::map<std::string, std::set<int>> pages_of_links(const std::string& pdf) {
  std::map<std::string, std::string> address;  // of an object
  const std::regex link(R"re((\d+) 0 obj\s<</Type /Annot[^(]*/URI \(http://figure/([a-z0-9]+)/\))re");
  for (auto it = std::sregex_iterator(pdf.begin(), pdf.end(), link); it != std::sregex_iterator(); ++it) {
    address[(*it)[1]] = (*it)[2];
  }
  std::map<std::string, std::set<int>> pages;
  int page = 0;
  for (std::size_t at = pdf.find("<</Type /Page\n"); at != std::string::npos;
       at = pdf.find("<</Type /Page\n", at + 1), ++page) {
    const std::size_t list = pdf.find("/Annots [", at);
    if (list == std::string::npos || list > pdf.find("endobj", at)) continue;
    std::istringstream in(pdf.substr(list + 9, pdf.find(']', list) - list - 9));
    for (std::string object, generation, r; in >> object >> generation >> r;) {
      if (address.contains(object)) pages[address[object]].insert(page);
    }
  }
  return pages;
}

// Each figure gets a link as large as itself, which a PDF names once for every page that it lies on.
TEST(DebriefPage, PrintsFiguresOnWholePages) {
  if (support::kSanitized) GTEST_SKIP() << "the browser is looked at in Release";
  if (browser().empty()) GTEST_SKIP() << "no chromium-headless-shell, no chromium";
  const support::TemporaryFolder folder;
  // With more or fewer rows above, every figure comes to the foot of a page sooner or later.
  for (int rows = 0; rows < 30; rows += 4) {
    DebriefData data = full_debrief();
    data.film.reset();
    for (int i = 0; i < rows; ++i) data.events.push_back({136, EventKind::note, "Core", "target"});
    const std::string script = R"js(
      const cover = (e, name) => {
        const link = e.appendChild(document.createElement('a'));
        link.href = 'http://figure/' + name + '/';
        link.textContent = '.';
        e.style.position = 'relative';
        link.style.cssText = 'position:absolute;inset:0';
      };
      let number = 0;
      for (const e of document.querySelectorAll('figure, .wide, .way, .verdict')) cover(e, `figure${number++}`);
      // A heading is not left behind by what it is above of.
      for (const e of document.querySelectorAll('section > h2')) {
        cover(e, `heading${number}`);
        cover(e.nextElementSibling.querySelector('figure, tr') || e.nextElementSibling, `first${number++}`);
      }
    )js";
    open_in_browser(with_script(debrief_page(data), script), folder,
                    fmt::format("--no-pdf-header-footer --print-to-pdf={}/page.pdf", folder.path().string()));
    std::ifstream in(folder / "page.pdf", std::ios::binary);
    const std::string pdf((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
    const std::map<std::string, std::set<int>> pages = pages_of_links(pdf);
    ASSERT_GE(pages.size(), 20u);
    for (const auto& [name, on] : pages) {
      EXPECT_EQ(on.size(), 1u) << name << " is broken, " << rows << " rows more";
      if (name.starts_with("heading")) {
        EXPECT_EQ(on, pages.at("first" + name.substr(7))) << name << " is left behind, " << rows << " rows more";
      }
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
