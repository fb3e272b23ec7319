// The lab's pages as a server gives them: who sees them, what changes them, and every usual attack.
#include "engine/app/lab_site.h"

#include "engine/lab/course/course_file.h"
#include "engine/lab/store/digest.h"
#include "tests/lab/sample_attempts.h"
#include "tests/support/shell.h"
#include "tests/support/temporary_folder.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace stylet::app {
namespace {

using lab::server::Request;
using lab::server::Response;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

constexpr const char* kHost = "127.0.0.1:8480";
const std::string kHostile = "</textarea><script>alert(1)</script>\"'><img src=x onerror=alert(1)>";

std::string header(const Response& response, const std::string& name) {
  for (const auto& [key, value] : response.headers) {
    if (key == name) return value;
  }
  return {};
}

class LabSiteTest : public ::testing::Test {
protected:
  LabSiteTest() {
    lab_.set_instructor("ines", lab::server::password_hash("right horse"));
    for (int i = 0; i < 2; ++i) {
      attempts_.push_back(lab_.begin(lab::store::test::start_of(ada_)));
      lab_.end(attempts_.back(),
               {.total = 70.0 + i,
                .pass_mark = 70,
                .passed = true,
                .metrics = {{.metric = "elapsed_time", .value = 60.0 + i},
                            {.metric = "path_length", .value = i == 0 ? std::optional(120.0) : std::nullopt}}});
    }
  }
  Response get(const std::string& path, const std::string& cookie) {
    const std::size_t question = path.find('?');
    Request request{.method = "GET", .path = path.substr(0, question), .host = kHost};
    if (question != std::string::npos) request.query = lab::server::decoded_form(path.substr(question + 1));
    if (!cookie.empty()) request.cookies["stylet"] = cookie;
    return site_.answer(request);
  }
  Response post(const std::string& path, const std::map<std::string, std::string>& form, const std::string& cookie,
                const std::string& origin = std::string("http://") + kHost) {
    Request request{.method = "POST", .path = path, .form = form, .host = kHost, .origin = origin};
    if (!cookie.empty()) request.cookies["stylet"] = cookie;
    return site_.answer(request);
  }
  std::string log_in() {
    const Response response = post("/login", {{"name", "ines"}, {"password", "right horse"}}, "");
    EXPECT_EQ(response.status, 303);
    const std::string cookie = header(response, "Set-Cookie");
    return cookie.substr(7, cookie.find(';') - 7);
  }
  /// Of the forms on a page.
  static std::string token_of(const Response& page) {
    const std::string before = "name=\"token\" value=\"";
    const std::size_t at = page.body.find(before);
    return at == std::string::npos ? "" : page.body.substr(at + before.size(), 64);
  }

  std::int64_t now_ms_ = lab::store::system_ms();
  support::TemporaryFolder folder_;
  lab::store::Lab lab_{{.folder = folder_.path() / "lab", .build = "test", .clock = [this] { return now_ms_ += 1; }}};
  lab::store::Person ada_ = lab_.enrolled("Ada <b>L</b>");
  lab::course::Course course_ = lab::course::load_course(lab::course::find_course("needle_basics"));
  std::vector<std::string> attempts_;
  LabSite site_{lab_, course_, {.hosts = {kHost}, .names = true, .clock = [this] { return now_ms_; }}};
};

TEST_F(LabSiteTest, WhoIsNotLoggedInSeesNobody) {
  for (const std::string& path : {std::string("/"), std::string("/index.html"), "/" + ada_.pseudonym + ".html",
                                  "/compare?a=" + attempts_[0] + "&b=" + attempts_[1], std::string("/anything")}) {
    for (const char* cookie : {"", "0", "ffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffffff"}) {
      const Response response = get(path, cookie);
      EXPECT_EQ(response.status, 401) << path;
      EXPECT_THAT(response.body, HasSubstr("name=\"password\""));
      EXPECT_THAT(response.body, Not(HasSubstr(ada_.pseudonym)));
    }
  }
  EXPECT_EQ(post("/note", {{"trainee", ada_.pseudonym}, {"body", "x"}}, "").status, 403);
  EXPECT_EQ(post("/login", {{"name", "ines"}, {"password", "wrong"}}, "").status, 403);
  EXPECT_EQ(post("/login", {}, "").status, 403);
}

TEST_F(LabSiteTest, AnInstructorGoesThroughThePages) {
  const std::string cookie = log_in();
  const Response cohort = get("/", cookie);
  EXPECT_EQ(cohort.status, 200);
  EXPECT_THAT(cohort.body, HasSubstr("href=\"" + ada_.pseudonym + ".html\""));
  EXPECT_THAT(cohort.body, HasSubstr("Logged in as"));
  const Response person = get("/" + ada_.pseudonym + ".html", cookie);
  EXPECT_EQ(person.status, 200);
  EXPECT_THAT(person.body, HasSubstr("action=\"note\""));
  EXPECT_THAT(person.body, HasSubstr("value=\"" + attempts_[0] + "\""));
  const Response both = get("/compare?a=" + attempts_[0] + "&b=" + attempts_[1], cookie);
  EXPECT_EQ(both.status, 200);
  EXPECT_THAT(both.body, HasSubstr("<td>60</td><td>61</td><td>+1</td>"));
  EXPECT_THAT(both.body, HasSubstr("<td>120</td><td>&ndash;</td><td>&ndash;</td>"));
  const Response noted = post(
      "/note", {{"token", token_of(person)}, {"trainee", ada_.pseudonym}, {"body", "Holds the probe well."}}, cookie);
  EXPECT_EQ(noted.status, 303);
  EXPECT_EQ(header(noted, "Location"), "/" + ada_.pseudonym + ".html");
  EXPECT_THAT(get("/" + ada_.pseudonym + ".html", cookie).body, HasSubstr("Holds the probe well."));
  const auto seen = lab_.database().run("SELECT DISTINCT object FROM audit WHERE who = 'ines' AND what = 'show'");
  EXPECT_THAT(seen, SizeIs(2)) << "who looked at whom is on record";
  EXPECT_EQ(post("/logout", {{"token", token_of(cohort)}}, cookie).status, 303);
  EXPECT_EQ(get("/", cookie).status, 401);
}

TEST_F(LabSiteTest, ItsCookieIsOfItsOwnPagesAndEndsByItself) {
  const std::string set = header(post("/login", {{"name", "ines"}, {"password", "right horse"}}, ""), "Set-Cookie");
  for (const char* part : {"; HttpOnly", "; SameSite=Strict", "; Path=/"}) EXPECT_THAT(set, HasSubstr(part));
  const std::string cookie = log_in();
  EXPECT_EQ(get("/", cookie).status, 200);
  now_ms_ += lab::server::Logins::kLongestMs;
  EXPECT_EQ(get("/", cookie).status, 401);
}

TEST_F(LabSiteTest, AFormOfAnotherSiteChangesNothing) {
  const std::string cookie = log_in();
  const std::string token = token_of(get("/", cookie));
  const std::map<std::string, std::string> form{{"token", token}, {"trainee", ada_.pseudonym}, {"body", "forged"}};
  for (const char* origin : {"http://evil.example", "null", "https://127.0.0.1:8480", "http://127.0.0.1:8481"}) {
    EXPECT_EQ(post("/note", form, cookie, origin).status, 403) << origin;
  }
  for (const std::string& wrong : {std::string(), std::string(64, '0'), token.substr(1), cookie}) {
    auto forged = form;
    forged["token"] = wrong;
    EXPECT_EQ(post("/note", forged, cookie).status, 403);
    EXPECT_EQ(post("/logout", forged, cookie).status, 403);
  }
  EXPECT_THAT(lab_.notes(ada_.id), IsEmpty());
  EXPECT_EQ(token_of(get("/", log_in())) == token, false) << "each session has its own";
  EXPECT_EQ(get("/note?token=" + token + "&trainee=" + ada_.pseudonym + "&body=forged", cookie).status, 404)
      << "GET changes nothing";
  EXPECT_THAT(lab_.notes(ada_.id), IsEmpty());
  EXPECT_EQ(post("/note", form, cookie).status, 303);
}

TEST_F(LabSiteTest, BehindAWebServerWithACertificateOneLogsIn) {
  LabSite site(lab_, course_, {.hosts = {kHost, "lab.example"}, .behind = {"lab.example"}});
  const auto log_in_from = [&](const std::string& host, const std::string& origin) {
    return site.answer({.method = "POST",
                        .path = "/login",
                        .form = {{"name", "ines"}, {"password", "right horse"}},
                        .host = host,
                        .origin = origin});
  };
  const Response in = log_in_from("lab.example", "https://lab.example");
  EXPECT_EQ(in.status, 303);
  EXPECT_THAT(header(in, "Set-Cookie"), HasSubstr("; Secure"));
  EXPECT_EQ(log_in_from("lab.example", "https://evil.example").status, 403);
  EXPECT_EQ(log_in_from(kHost, std::string("https://") + kHost).status, 403) << "nothing stands before that";
}

TEST_F(LabSiteTest, ByAnotherNameItIsNotThere) {
  const std::string cookie = log_in();
  for (const char* host : {"", "evil.example", "evil.example:8480", "127.0.0.1", "127.0.0.1:8480.evil.example"}) {
    const Response response =
        site_.answer({.method = "GET", .path = "/", .host = host, .cookies = {{"stylet", cookie}}});
    EXPECT_EQ(response.status, 421) << host;
    EXPECT_THAT(response.body, IsEmpty());
  }
}

TEST_F(LabSiteTest, NoPathLeadsToAFile) {
  const std::string cookie = log_in();
  for (const std::string& path :
       {std::string("/../roster.db"), std::string("/..%2froster.db"), std::string("/%2e%2e/lab.db"),
        std::string("/recordings"), std::string("/lab.db"), std::string("//etc/passwd"), std::string("/....//lab.db"),
        "/recordings/" + attempts_[0] + ".rec", std::string("/.html"), std::string("/7Q4M2K%.html"),
        "/" + ada_.pseudonym, "/" + ada_.pseudonym + ".html/..", "/" + std::string(5000, 'a'),
        std::string("\\..\\lab.db"), std::string("/lab.db\0.html", 13)}) {
    const Response response = get(path, cookie);
    EXPECT_EQ(response.status, 404) << path;
    EXPECT_THAT(response.body, Not(HasSubstr("SQLite")));
  }
  for (const char* ids : {"?a=1&b=2", "", "?a=../../x&b=..", "?a=%27%20OR%201%3D1&b=%27"}) {
    EXPECT_EQ(get(std::string("/compare") + ids, cookie).status, 404) << ids;
  }
  const auto bob = lab_.enrolled("bob");
  const std::string of_bob = lab_.begin(lab::store::test::start_of(bob));
  EXPECT_EQ(get("/compare?a=" + attempts_[0] + "&b=" + of_bob, cookie).status, 404) << "of two people";
  for (const char* method : {"PUT", "DELETE", "HEAD", "TRACE", "get", ""}) {
    EXPECT_EQ(site_.answer({.method = method, .path = "/", .host = kHost, .cookies = {{"stylet", cookie}}}).status,
              405);
  }
}

TEST_F(LabSiteTest, ScriptsInNamesAndNotesAreText) {
  const std::string cookie = log_in();
  const std::string token = token_of(get("/", cookie));
  lab_.set_instructor(kHostile, lab::server::password_hash("right horse"));
  const Response in = post("/login", {{"name", kHostile}, {"password", "right horse"}}, "");
  ASSERT_EQ(in.status, 303);
  const std::string set = header(in, "Set-Cookie");
  const std::string of_hostile = set.substr(7, set.find(';') - 7);
  const Response page = get("/" + ada_.pseudonym + ".html", of_hostile);
  EXPECT_EQ(
      post("/note", {{"token", token_of(page)}, {"trainee", ada_.pseudonym}, {"body", kHostile}}, of_hostile).status,
      303);
  for (const std::string& path :
       {std::string("/"), "/" + ada_.pseudonym + ".html", "/compare?a=" + attempts_[0] + "&b=" + attempts_[1]}) {
    const Response shown = get(path, of_hostile);
    EXPECT_EQ(shown.status, 200);
    for (const char* never : {"<script", "<img", "<b>L"}) EXPECT_THAT(shown.body, Not(HasSubstr(never))) << path;
    EXPECT_THAT(header(shown, "Content-Security-Policy"), HasSubstr("default-src 'none'"));
    EXPECT_THAT(header(shown, "Content-Security-Policy"), HasSubstr("frame-ancestors 'none'"));
    EXPECT_EQ(header(shown, "X-Content-Type-Options"), "nosniff");
    EXPECT_EQ(header(shown, "Cache-Control"), "no-store");
  }
  EXPECT_EQ(post("/note", {{"token", token}, {"trainee", ada_.pseudonym}, {"body", std::string(20'000, 'a')}}, cookie)
                .status,
            400);
  EXPECT_EQ(post("/note", {{"token", token}, {"trainee", "' OR 1=1"}, {"body", "x"}}, cookie).status, 404);
}

TEST_F(LabSiteTest, ANoteIsShownWithItsLinesAndAsLongAsTheFormLetsIt) {
  const std::string cookie = log_in();
  const std::string page = "/" + ada_.pseudonym + ".html";
  const Response form = get(page, cookie);
  const std::string before = "maxlength=\"";
  const std::size_t at = form.body.find(before);
  ASSERT_NE(at, std::string::npos);
  const int most = std::stoi(form.body.substr(at + before.size()));
  EXPECT_GE(most, 2000);
  std::string longest;  // as many as a browser lets in, each of three bytes
  for (int i = 0; i < most; ++i) longest += "\u20ac";
  const auto noted = [&](const std::string& body) {
    return post("/note", {{"token", token_of(form)}, {"trainee", ada_.pseudonym}, {"body", body}}, cookie).status;
  };
  EXPECT_EQ(noted(longest), 303);
  EXPECT_EQ(noted(longest + "\u20ac"), 400);
  EXPECT_EQ(noted("Holds the probe well.\r\n\r\nNext: depth <b>"), 303);
  EXPECT_THAT(get(page, cookie).body, HasSubstr("Holds the probe well.\n\nNext: depth &lt;b&gt;</bdi>"));
}

TEST_F(LabSiteTest, APageSaysWhatSomebodyAgreedToAndHowLongTheyAreKept) {
  const std::string cookie = log_in();
  const std::string page = "/" + ada_.pseudonym + ".html";
  EXPECT_THAT(get(page, cookie).body, HasSubstr("<td>never asked, which is no consent</td>"));
  EXPECT_THAT(get(page, cookie).body, Not(HasSubstr("Kept until")));
  lab_.set_consent(ada_.id, lab::store::kRecordStore, true);
  lab_.set_consent(ada_.id, lab::store::kResearch, false);
  lab_.set(lab::store::kRetentionDays, "730");
  const std::string shown = get(page, cookie).body;
  EXPECT_THAT(shown, HasSubstr(">Record store</th><td>agreed 20"));
  EXPECT_THAT(shown, HasSubstr(">Research</th><td>refused 20"));
  EXPECT_THAT(shown, HasSubstr(">Kept until</th>"));
  lab_.make_anonymous(ada_);
  EXPECT_THAT(get("/", cookie).body, HasSubstr("0 trainees")) << "numbers of nobody are no trainee";
}

TEST_F(LabSiteTest, WhoGuessesPasswordsIsHeldUp) {
  for (int i = 0; i < lab::server::Logins::kTries; ++i) {
    EXPECT_EQ(post("/login", {{"name", "ines"}, {"password", "guess"}}, "").status, 403);
  }
  const Response braked = post("/login", {{"name", "ines"}, {"password", "right horse"}}, "");
  EXPECT_EQ(braked.status, 429);
  EXPECT_EQ(header(braked, "Retry-After"), "30");
  EXPECT_EQ(header(braked, "Set-Cookie"), "");
  now_ms_ += lab::server::Logins::kPauseMs;
  log_in();
}

std::string browser() {
  for (const char* name : {"chromium-headless-shell", "chromium"}) {
    if (std::system(fmt::format("command -v {} >/dev/null", name).c_str()) == 0) return name;
  }
  return {};
}

TEST_F(LabSiteTest, ABrowserShowsItAndAForeignPageDoesNotGetIn) {
  if (browser().empty()) GTEST_SKIP() << "no chromium-headless-shell, no chromium";
  std::string host;
  std::unique_ptr<LabSite> site;
  // Beside its pages one that does what an instructor does: logs in, goes to a trainee, fills in the form there,
  // sends.
  const std::string hand = fmt::format(R"(<!DOCTYPE html><body><script>(async () => {{
    const form = new URLSearchParams({{name: "ines", password: "right horse"}});
    await fetch("/login", {{method: "POST", body: form}});
    const page = new DOMParser().parseFromString(await (await fetch("/{}.html")).text(), "text/html");
    const note = document.body.appendChild(page.querySelector("form[action=note]"));
    note.querySelector("textarea").value = "From a browser.";
    note.requestSubmit();
  }})()</script></body>)",
                                       ada_.pseudonym);
  std::map<std::string, std::vector<int>> logins;  // what was answered, by the page that asked
  lab::server::HttpServer server({.port = 0}, [&](const Request& request) {
    if (request.path == "/hand") return Response{.body = hand};
    Response response = site->answer(request);
    if (request.path == "/login" && request.method == "POST") logins[request.origin].push_back(response.status);
    return response;
  });
  host = server.host();
  site =
      std::make_unique<LabSite>(lab_, course_, LabSiteSettings{.hosts = {host}, .clock = [this] { return now_ms_; }});
  std::atomic<bool> over = false;
  std::thread serving([&] { server.run([&] { return over.load(); }); });
  const auto open = [&](const std::string& address) {
    return support::run_in_shell(
               fmt::format("HOME={0} timeout 60 {1} --headless --no-sandbox --disable-gpu --disable-dev-shm-usage "
                           "--no-first-run --disable-background-networking --user-data-dir={0}/user "
                           "--virtual-time-budget=3000 --dump-dom '{2}' 2>/dev/null",
                           folder_.path().string(), browser(), address))
        .output;
  };
  const std::string page = open("http://" + host + "/");
  EXPECT_THAT(page, HasSubstr("name=\"password\""));
  EXPECT_THAT(page, Not(HasSubstr(ada_.pseudonym)));
  const std::string noted = open("http://" + host + "/hand");
  EXPECT_THAT(noted, HasSubstr("From a browser."));
  EXPECT_THAT(noted, HasSubstr("<h2 id=\"every\">")) << "the trainee's page again";
  // Another site, with the right password even: it is not its form.
  const std::string form = fmt::format(
      R"(<!DOCTYPE html><form method="post" action="http://{}/login"><input name="name" value="ines"><input )"
      R"(name="password" value="right horse"></form><script>document.forms[0].submit()</script>)",
      host);
  lab::server::HttpServer other({.port = 0}, [&](const Request&) { return Response{.body = form}; });
  std::thread serving_other([&] { other.run([&] { return over.load(); }); });
  const std::string foreign = "http://localhost" + other.host().substr(other.host().rfind(':'));
  EXPECT_THAT(open(foreign + "/"), Not(HasSubstr("Who stands where")));
  over = true;
  serving.join();
  serving_other.join();
  EXPECT_THAT(logins["http://" + host], testing::ElementsAre(303)) << "its own page";
  EXPECT_THAT(logins[foreign], testing::ElementsAre(403)) << "it was asked, and let nobody in";
  EXPECT_THAT(lab_.notes(ada_.id), SizeIs(1));
  if (const char* keep = std::getenv("STYLET_KEEP_PAGES")) {  // to be looked at
    const std::string cookie = log_in();
    std::ofstream(std::string(keep) + "/served.html") << get("/" + ada_.pseudonym + ".html", cookie).body;
    std::ofstream(std::string(keep) + "/compare.html")
        << get("/compare?a=" + attempts_[0] + "&b=" + attempts_[1], cookie).body;
    std::ofstream(std::string(keep) + "/login.html") << get("/login", "").body;
  }
}

}  // namespace
}  // namespace stylet::app
