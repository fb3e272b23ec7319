// `stylet lab`: the records of a skills lab, for those who teach there.
#include "engine/lab/store/lab.h"
#include "engine/app/build_name.h"
#include "engine/app/course_standing.h"
#include "engine/app/deliver_statements.h"
#include "engine/app/lab_pages.h"
#include "engine/app/lab_site.h"
#include "engine/app/observer.h"
#include "engine/app/take_recording.h"
#include "engine/app/trainee_door.h"
#include "engine/files/error.h"
#include "engine/files/json_scan.h"
#include "engine/files/key_tables.h"
#include "engine/lab/course/course_file.h"
#include "engine/lab/server/http_server.h"
#include "engine/lab/server/logins.h"
#include "engine/lab/statistics/proportion.h"
#include "engine/lab/store/export.h"
#include "engine/lab/store/postgres.h"
#include "engine/lab/store/station.h"
#include "tools/stylet/commands.h"
#include "tools/stylet/interrupt.h"
#include "tools/stylet/session_options.h"
#include "tools/stylet/terminal.h"

#include <poll.h>
#include <sys/stat.h>
#include <termios.h>
#include <unistd.h>

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace stylet::tools {

namespace fs = std::filesystem;
namespace store = lab::store;

namespace {

struct LabRequest {
  std::string action;
  std::string who;
  fs::path folder;
  std::string database;
  std::string course;
  std::string format = "csv";
  std::string out;
  std::string why;
  std::string recording;
  bool graded = false;
  std::string store;
  std::string home_page;
  std::string key;
  std::string xapi;
  std::string waiting;
  bool off = false;
  bool follow = false;
  std::string purpose;
  bool given = false;
  bool refused = false;
  bool for_research = false;
  int days = 0;
  lab::server::ServerSettings server{};
  std::vector<std::string> hosts;
  bool names = false;
  bool undo = false;
  bool yes = false;
};

/// An action on a trainee was asked for without one.
const std::string& named(const LabRequest& request, const char* what) {
  if (request.who.empty()) {
    throw files::ContentError(
        fmt::format("lab {}: say {}: `stylet lab {} {}`", request.action, what, request.action, "WHO"));
  }
  return request.who;
}

std::string name_of(const store::Person& person) {
  return person.name.empty() ? person.pseudonym
                             : fmt::format("{} ({})", files::one_line(person.name), person.pseudonym);
}

int list(store::Lab& lab) {
  const std::vector<store::PersonSummary> people = lab.people();
  if (people.empty()) {
    say(stdout, "Nobody is in {} yet; `stylet lab enroll NAME` or `stylet train SCENARIO --trainee NAME` begins.\n",
        lab.folder().string());
    return kExitYes;
  }
  std::vector<std::vector<std::string>> rows{{"PSEUDONYM", "NAME", "ATTEMPTS", "PASSED", "LAST"}};
  int anonymous = 0;
  for (const store::PersonSummary& summary : people) {
    if (summary.anonymous) {
      ++anonymous;
      continue;
    }
    rows.push_back({summary.person.pseudonym, files::one_line(summary.person.name), std::to_string(summary.attempts),
                    std::to_string(summary.passed),
                    summary.last_ms > 0 ? store::utc_text(summary.last_ms).substr(0, 10) : "-"});
  }
  say(stdout, "{}", files::columns(rows));
  if (anonymous > 0) say(stdout, "And numbers of {} who are nobody any more.\n", anonymous);
  if (const auto overdue = lab.overdue().size(); overdue > 0) {
    say(stdout, "{} have not trained for the {} days that records are kept; `stylet lab retain` names them\n",
        overdue, lab.retention_days().value_or(0));
  }
  return kExitYes;
}

std::string result_words(const store::AttemptRecord& attempt) {
  if (!attempt.excluded.empty()) return "excluded: " + files::one_line(attempt.excluded);
  if (attempt.status == "running") return "under way";
  const char* failed = attempt.counts() ? ": failed" : "";
  if (attempt.status == "crashed") return std::string("cut off") + failed;
  if (attempt.status == "aborted") return std::string("broken off") + failed;
  if (!attempt.passed) return "measured";
  if (*attempt.passed) return "passed";
  return attempt.failed_critical.empty() ? "failed" : "failed: " + attempt.failed_critical;
}

void show_course(store::Lab& lab, const store::Person& person, const std::string& named_course) {
  const lab::course::Course course = lab::course::load_course(lab::course::find_course(named_course));
  const std::int64_t today = app::local_day(store::system_ms());
  const app::CourseStanding standing = app::standing_of(lab, person, course, today);
  std::vector<std::vector<std::string>> rows;
  for (std::size_t e = 0; e < course.exercises.size(); ++e) {
    std::string words = lab::course::progress_words(course.exercises[e], standing.exercises[e]);
    if (standing.at_earlier_versions[e] > 0) {
      words += fmt::format("; {} at an earlier version of the scenario or with another device are not counted",
                           standing.at_earlier_versions[e]);
    }
    rows.push_back({"  " + files::one_line(course.exercises[e].name), words});
  }
  say(stdout, "\n{}\n{}", files::one_line(course.title), files::columns(rows));
  if (!standing.due) {
    say(stdout, "Nothing more today.\n");
    return;
  }
  const lab::course::Exercise& next = course.exercises[*standing.due];
  say(stdout, "Next: {}{}; `stylet train {} --trainee {} --course {}`\n", files::one_line(next.name),
      standing.exercises[*standing.due].after_pause ? ", after a pause: the first attempts may be worse" : "",
      next.scenario.stem().string(), person.pseudonym, named_course);
}

int show(store::Lab& lab, const LabRequest& request) {
  const store::Person person = lab.get(named(request, "who"));
  lab.note("show", person.pseudonym);
  const std::vector<store::AttemptRecord> attempts = lab.attempts(person.id);
  say(stdout, "{}\n", name_of(person));
  std::vector<std::vector<std::string>> rows{{"  SCENARIO", "NO", "WHEN", "MODE", "POINTS", "RESULT", "ATTEMPT"}};
  int counted = 0;
  int passed = 0;
  for (const store::AttemptRecord& attempt : attempts) {
    counted += attempt.counts() ? 1 : 0;
    passed += attempt.counts() && attempt.succeeded() ? 1 : 0;
    rows.push_back({"  " + files::one_line(attempt.scenario), std::to_string(attempt.number),
                    store::local_text(attempt.started_ms, attempt.utc_offset_min), attempt.mode,
                    attempt.total ? fmt::format("{:.0f}", *attempt.total) : "-", result_words(attempt),
                    attempt.id.substr(24)});
  }
  if (rows.size() > 1) say(stdout, "{}", files::columns(rows));
  if (counted > 0) {
    const lab::statistics::Interval interval = lab::statistics::wilson(passed, counted);
    say(stdout, "  passed {} of {} that count; with 95 % confidence the pass rate lies between {:.0f} and {:.0f} %\n",
        passed, counted, interval.low * 100, interval.high * 100);
  }
  if (!request.course.empty()) show_course(lab, person, request.course);
  return kExitYes;
}

int export_attempts(store::Lab& lab, const LabRequest& request) {
  store::ExportScope scope{.for_research = request.for_research};
  std::string object = request.for_research ? "everybody, for research" : "everybody";
  if (!request.who.empty()) {
    const store::Person person = lab.get(request.who);
    scope.trainee = person.id;
    object = person.pseudonym;
  }
  const std::string text =
      request.format == "json" ? store::attempts_as_json(lab, scope) : store::attempts_as_csv(lab, scope);
  lab.note("export", object);  // before anybody has it
  if (request.out.empty()) {
    if (std::fwrite(text.data(), 1, text.size(), stdout) != text.size() || std::fflush(stdout) != 0) {
      throw files::ContentError("lab export: could not be written whole; check space");
    }
  } else {
    std::ofstream file(request.out, std::ios::binary);
    file << text;
    file.close();
    if (!file) throw files::ContentError(request.out + ": could not be written whole; check folder and space");
  }
  return kExitYes;
}

int write_pages(store::Lab& lab, const LabRequest& request) {
  if (request.course.empty() || request.out.empty()) {
    throw files::ContentError(
        "lab page: say of which course and where: `stylet lab page --course NAME --out FOLDER`");
  }
  const lab::course::Course course = lab::course::load_course(lab::course::find_course(request.course));
  say(stdout, "{} and a page for each trainee; any browser opens it, without network\n",
      app::write_lab_pages(lab, course, request.names, request.out).string());
  return kExitYes;
}

/// @param anonymous  the numbers stay, as those of nobody
void take_away(store::Lab& lab, const store::Person& person, bool anonymous) {
  const store::Erased erased = anonymous ? lab.make_anonymous(person) : lab.erase(person);
  say(stdout, "{} is gone: {} attempts, {} recordings, the name{}\n", name_of(person), erased.attempts,
      erased.recordings, anonymous ? "; the numbers stay, as those of nobody" : "");
  for (const fs::path& backup : erased.backups) {
    say(stdout, "  {} may still hold them; remove it, or let its time run out\n", backup.string());
  }
  // Also of who has never agreed, or no more: earlier versions asked nobody.
  std::string place = lab.setting(store::kWaitsFor);
  if (place.empty()) place = lab.setting(store::kEndpoint);
  if (erased.attempts > 0 && !place.empty()) {
    say(stdout, "  {} may have been told of {}: ask there for its statements to be erased\n", files::printable(place),
        person.pseudonym);
  }
}

int erase(store::Lab& lab, const LabRequest& request) {
  const store::Person person = lab.get(named(request, "whom"));
  if (!request.yes) {
    say(stdout,
        "This takes {} with {} attempts and their recordings out of {}, for good; say --yes to do it.\n"
        "`stylet lab export {} --format json --out FILE` keeps what the person may ask for.\n",
        name_of(person), lab.attempts(person.id).size(), lab.folder().string(), person.pseudonym);
    return kExitNo;
  }
  take_away(lab, person, false);
  say(stdout, "Results that sessions left elsewhere (--out) and exports are not known here.\n");
  return kExitYes;
}

int exclude(store::Lab& lab, const LabRequest& request) {
  const std::string& attempt = named(request, "which attempt");
  if (request.why.empty() != request.undo) {
    throw files::ContentError("lab exclude: say --why REASON, by a rule that was there before, or --undo");
  }
  const char* user = std::getenv("USER");
  const std::string id = lab.exclude(attempt, user != nullptr ? user : "", request.why);
  say(stdout, "{} {}\n", id, request.undo ? "counts again" : "counts no more: " + files::one_line(request.why));
  return kExitYes;
}

int import_recording(store::Lab& lab, const LabRequest& request) {
  const std::string& who = named(request, "whose it is");
  if (request.recording.empty()) {
    throw files::ContentError("lab import: say which: `stylet lab import WHO --recording FILE`");
  }
  const store::Person person = lab.get(who);
  Terminal terminal;
  const app::TakenRecording taken = app::take_recording(
      lab, person, {.recording = request.recording, .course = request.course, .graded = request.graded}, terminal);
  lab.note("import", person.pseudonym);
  say(stdout, "{} is an attempt of {}{}{}{}; {}\n", taken.attempt, name_of(person),
      taken.broken_off ? ", broken off" : "", taken.total ? fmt::format(", {:.0f} points", *taken.total) : "",
      !taken.passed   ? ""
      : *taken.passed ? ", passed"
                      : ", failed",
      taken.compared ? "the replay is the same bit for bit, and so are the numbers of its session.json"
                     : "the replay is the same bit for bit; no session.json was there to compare numbers with");
  return kExitYes;
}

int consent(store::Lab& lab, const LabRequest& request) {
  const store::Person person = lab.get(named(request, "whose"));
  if (request.given && request.refused) throw files::ContentError("lab consent: say --given or --refused, not both");
  if (request.given || request.refused) {
    if (request.purpose.empty()) {
      throw files::ContentError("lab consent: say to what: --purpose record_store, or research");
    }
    lab.set_consent(person.id, request.purpose, request.given);
    lab.note(request.given ? "consent given" : "consent refused", person.pseudonym);
  }
  std::vector<std::vector<std::string>> rows;
  for (const store::Consent& said : lab.consents(person.id)) {
    rows.push_back({name_of(person), said.purpose,
                    !said.given ? "never asked, which is no consent"
                                : fmt::format("{} {}", *said.given ? "given" : "refused",
                                              store::utc_text(said.at_ms).substr(0, 10))});
  }
  say(stdout, "{}", files::columns(rows));
  return kExitYes;
}

int retain(store::Lab& lab, const LabRequest& request) {
  if (request.off) {
    lab.set(store::kRetentionDays, {});
    say(stdout, "Records are kept without a limit of time.\n");
    return kExitYes;
  }
  if (request.days > 0 && request.yes) {
    throw files::ContentError(
        "lab retain: --days alone says first who would go; `stylet lab retain --yes` then does it");
  }
  if (request.days > 0) lab.set(store::kRetentionDays, std::to_string(request.days));
  const std::optional<std::int64_t> days = lab.retention_days();
  if (!days) throw files::ContentError("lab retain: say for how long: `stylet lab retain --days 730`");
  const std::vector<store::PersonSummary> overdue = lab.overdue();
  if (overdue.empty()) say(stdout, "Nobody's records are older than {} days.\n", *days);
  for (const store::PersonSummary& summary : overdue) {
    const bool anonymous = lab.consents_to(summary.person.id, store::kResearch);
    if (request.yes) {
      take_away(lab, summary.person, anonymous);
    } else {
      say(stdout, "{} has not trained for {} days: {} attempts, the last {}; {}\n", name_of(summary.person), *days,
          summary.attempts,
          summary.last_ms > 0 ? store::utc_text(summary.last_ms).substr(0, 10) : std::string("never"),
          anonymous ? "the numbers would stay, as those of nobody (agreed to research)"
                    : "everything would be erased");
    }
  }
  if (!overdue.empty() && !request.yes) say(stdout, "Nothing is done; say --yes to do it, for good.\n");
  return overdue.empty() || request.yes ? kExitYes : kExitNo;
}

const std::map<std::string, app::Waiting> kWaiting{
    {"", app::Waiting::refuse}, {"send", app::Waiting::send}, {"drop", app::Waiting::drop}};

int connect(store::Lab& lab, const LabRequest& request) {
  if (request.store.empty() != request.off) {
    throw files::ContentError(
        "lab connect: say which: `stylet lab connect --store URL --home-page URL --key FILE`, or --off");
  }
  const app::Connected connected = app::connect_record_store(lab, {.endpoint = request.store,
                                                                   .home_page = request.home_page,
                                                                   .key_file = request.key,
                                                                   .version = request.xapi,
                                                                   .waiting = kWaiting.at(request.waiting)});
  if (request.off) {
    say(stdout, "Attempts are told to no record store any more; what waits stays.\n");
    return kExitYes;
  }
  say(stdout,
      "Attempts from now on are told to {} in xAPI {}{}, by pseudonym, of those who have agreed (`stylet lab consent "
      "WHO --purpose record_store --given`); `stylet lab send` brings what waits.\n",
      request.store, connected.version,
      connected.not_asked.empty() ? "" : fmt::format(" (it did not say which: {})", connected.not_asked));
  if (connected.tried_again > 0) {
    say(stdout, "{} statements that were refused earlier are tried again.\n", connected.tried_again);
  }
  return kExitYes;
}

int send(store::Lab& lab, const LabRequest& request) {
  constexpr std::int64_t kLookEveryMs = 30'000;
  int failures = 0;
  while (true) {
    const auto delivery = app::deliver_statements(lab, failures);
    if (!delivery) {
      throw files::ContentError("lab send: there is no record store; `stylet lab connect` names one");
    }
    say(stdout, "{}\n", app::delivery_words(*delivery));
    if (!request.follow) return delivery->left.waiting > 0 ? kExitNo : kExitYes;
    std::fflush(stdout);
    failures = delivery->sent.failures;
    const std::int64_t now = store::system_ms();
    const std::int64_t wait_ms = std::max<std::int64_t>(0, delivery->sent.next_ms.value_or(now + kLookEveryMs) - now);
    // Not by the clock on the wall, which somebody may set.
    const auto until = std::chrono::steady_clock::now() + std::chrono::milliseconds(wait_ms);
    while (std::chrono::steady_clock::now() < until) {
      if (interrupted()) return kExitInterrupted;
      std::this_thread::sleep_for(std::chrono::milliseconds(200));
    }
  }
}

/// From the terminal without being shown there, or the first line of what is piped in.
std::string asked_secret(const char* what) {
  termios shown{};
  const bool terminal = ::isatty(STDIN_FILENO) == 1 && ::tcgetattr(STDIN_FILENO, &shown) == 0;
  if (terminal) {
    termios hidden = shown;
    hidden.c_lflag &= ~static_cast<tcflag_t>(ECHO);
    ::tcsetattr(STDIN_FILENO, TCSAFLUSH, &hidden);
    say(stdout, "{}: ", what);
    std::fflush(stdout);
  }
  std::string password;
  pollfd in{.fd = STDIN_FILENO, .events = POLLIN, .revents = 0};
  const bool cut = terminal && (::poll(&in, 1, -1) < 0 || interrupted());  // unlike a read, never begun again
  if (!cut) std::getline(std::cin, password);
  if (terminal) {
    ::tcsetattr(STDIN_FILENO, TCSAFLUSH, &shown);
    say(stdout, "\n");
  }
  if (cut) throw app::Stopped();
  return password;
}

int enroll(store::Station& station, const LabRequest& request) {
  const store::Person person = station.enrolled(named(request, "who"));
  if (!person.added) {
    throw files::ContentError(
        fmt::format("lab enroll: {} is there already, as {}", name_of(person), person.pseudonym));
  }
  if (station.server) station.hand_over();
  say(stdout, "{} goes by {}; `stylet lab pin` asks for a PIN, `stylet lab consent` keeps what was agreed to.\n",
      name_of(person), person.pseudonym);
  return kExitYes;
}

int set_pin(store::Lab& lab, const LabRequest& request) {
  const store::Person person = lab.get(named(request, "whose"));
  if (request.off) {
    lab.set_pin(person.id, {});
    say(stdout, "{} trains by the name alone.\n", name_of(person));
    return kExitYes;
  }
  const std::string pin = asked_secret("PIN");
  if (!app::is_pin(pin)) {
    throw files::ContentError(fmt::format("lab pin: a PIN has {} to {} digits", app::kShortestPin, app::kLongestPin));
  }
  lab.set_pin(person.id, lab::server::password_hash(pin));
  say(stdout, "{} is asked for the PIN from now on; it is a convenience, no lock on the records.\n", name_of(person));
  return kExitYes;
}

int add_instructor(store::Lab& lab, const LabRequest& request) {
  constexpr std::size_t kShortest = 10;
  constexpr std::size_t kLongest = 200;
  const std::string& name = named(request, "who");
  if (name.empty() || name.size() > kLongest || name != files::one_line(name)) {
    throw files::ContentError("lab instructor: a name is one line of up to 200 bytes");
  }
  const std::string password = asked_secret("Password");
  if (password.size() < kShortest || password.size() > kLongest) {
    throw files::ContentError("lab instructor: a password has at least 10 characters; a sentence is easy to keep");
  }
  lab.set_instructor(name, lab::server::password_hash(password));
  say(stdout, "{} may log in at the pages of `stylet lab serve`.\n", files::one_line(name));
  return kExitYes;
}

int serve(store::Lab& lab, const LabRequest& request) {
  if (request.course.empty()) {
    throw files::ContentError("lab serve: say of which course: `stylet lab serve --course NAME`");
  }
  if (!lab.has_instructors()) {
    throw files::ContentError("lab serve: nobody may log in yet; `stylet lab instructor NAME` makes a login");
  }
  const lab::course::Course course = lab::course::load_course(lab::course::find_course(request.course));
  std::optional<app::LabSite> site;
  lab::server::HttpServer server(request.server,
                                 [&](const lab::server::Request& asked) { return site->answer(asked); });
  app::LabSiteSettings settings{.hosts = {server.host()}, .names = request.names};
  const std::string port = server.host().substr(server.host().rfind(':'));
  settings.hosts.push_back("localhost" + port);
  settings.hosts.insert(settings.hosts.end(), request.hosts.begin(), request.hosts.end());
  settings.behind = request.hosts;
  site.emplace(lab, course, settings);
  say(stdout, "http://{}/ has the pages of {}; Ctrl-C ends it\n", server.host(), files::one_line(course.title));
  if (!request.server.address.starts_with("127.") && request.server.address != "::1") {
    say(stdout,
        "Other computers reach it, and what they send and see is not encrypted: let a web server with a certificate "
        "stand before it.\n");
  }
  std::fflush(stdout);
  server.run([] { return interrupted(); });
  return kExitYes;
}

int join(const store::LabSettings& settings, const LabRequest& request) {
  if (request.database.empty() != request.off) {
    throw files::ContentError(
        "lab join: say which: `stylet lab join --database postgresql://HOST/DATABASE`, or --off");
  }
  store::Lab own({.folder = settings.folder, .build = settings.build});
  if (request.off) {
    own.set(store::kDatabase, {});
    say(stdout, "This computer is a station of no server any more; what it kept is in {}.\n", own.folder().string());
    return kExitYes;
  }
  if (store::has_password(request.database)) {
    throw files::ContentError(
        "lab join: an address with a password is not kept; write the password into ~/.pgpass, the address without "
        "it");
  }
  store::Lab server(settings);
  const std::string words = store::handed_over_words(own.hand_over(server), server.database().place());
  own.set(store::kDatabase, request.database);
  say(stdout, "This computer is a station of {}.{}\n", server.database().place(),
      words.empty() ? "" : " " + words + ".");
  return kExitYes;
}

int hand_over(store::Station& station) {
  if (!station.server) station.hand_over();  // says why not
  const std::string words = store::handed_over_words(station.handed_over, station.server->database().place());
  say(stdout, "{}\n", words.empty() ? station.server->database().place() + " has everything" : words);
  return station.handed_over.left > 0 ? kExitNo : kExitYes;
}

int run(const LabRequest& request) {
  ::umask(077);  // pages and exports are about people, as the records
  const store::LabSettings settings{.folder = request.folder.empty() ? store::default_lab_folder() : request.folder,
                                    .build = app::build_name(),
                                    .database = request.database};
  if (request.action == "join") return join(settings, request);
  store::Station station = store::open_station(settings);
  if (request.action == "hand-over") return hand_over(station);
  // Half the attempts would be a wrong answer.
  if (!station.away.empty()) {
    throw files::ContentError(station.away + "; `--database own` is what this computer has by itself");
  }
  if (station.server) {
    if (store::has_password(request.database)) {
      say(stderr,
          "stylet: everybody on this computer can read the password in --database while this runs; ~/.pgpass keeps "
          "it\n");
    }
    const std::string words = store::handed_over_words(station.handed_over, station.server->database().place());
    if (!words.empty()) say(stderr, "stylet: {}\n", words);
  }
  if (request.action == "enroll") return enroll(station, request);
  store::Lab& lab = station.lab();
  if (request.action == "show") return show(lab, request);
  if (request.action == "export") return export_attempts(lab, request);
  if (request.action == "consent") return consent(lab, request);
  if (request.action == "retain") return retain(lab, request);
  if (request.action == "pin") return set_pin(lab, request);
  if (request.action == "serve") return serve(lab, request);
  if (request.action == "instructor") return add_instructor(lab, request);
  if (request.action == "connect") return connect(lab, request);
  if (request.action == "send") return send(lab, request);
  if (request.action == "import") return import_recording(lab, request);
  if (request.action == "page") return write_pages(lab, request);
  if (request.action == "exclude") return exclude(lab, request);
  if (request.action == "erase") {
    const int exit_code = erase(lab, request);
    if (station.server) station.hand_over();  // forgets who was erased there
    return exit_code;
  }
  if (request.action == "backup") {
    say(stdout, "{} holds a copy of all records; `stylet lab list --lab {}` reads it\n",
        lab.back_up(request.out).string(), request.out.empty() ? "FOLDER" : request.out);
    return kExitYes;
  }
  return list(lab);
}

}  // namespace

void add_lab(CLI::App& app, int& exit_code) {
  CLI::App* command = app.add_subcommand("lab", "The records of a skills lab: who trained what, and what came of it");
  auto request = std::make_shared<LabRequest>();
  command->add_option("ACTION", request->action, "What to do; without it everybody is listed")
      ->check(
          CLI::IsMember({"list", "show", "page", "export", "import", "exclude", "erase", "backup", "connect", "send",
                         "serve", "instructor", "join", "hand-over", "enroll", "consent", "retain", "pin"}));
  command->add_option("WHO", request->who,
                      "Name or pseudonym of a trainee; of exclude an attempt, or the end of its id");
  command->add_option("--lab", request->folder, kLabHelp);
  command->add_option("--database", request->database,
                      "Of a lab with many stations: its PostgreSQL server, postgresql://USER@HOST/DATABASE; default: "
                      "STYLET_LAB_DATABASE, else what `join` kept; own: this computer's files alone");
  command->add_option("--course", request->course,
                      "show, page, serve: where trainees stand in it, and what comes next; import: what the "
                      "recording is an exercise of");
  command->add_option("--format", request->format, "export: csv, a row an attempt; or json, with everything")
      ->check(CLI::IsMember({"csv", "json"}))
      ->capture_default_str();
  command->add_option(
      "--out", request->out,
      "export: file, default the terminal; page: folder; backup: folder that is not there yet, default "
      "backups/lab-TIME in the lab's");
  command->add_option("--recording", request->recording, "import: a session.rec, or the folder of its results");
  command->add_flag("--graded", request->graded,
                    "import: counts for a gate; say so only of one that was to count before it began");
  command->add_option("--store", request->store,
                      "connect: https address of a learning record store (xAPI), up to before /statements");
  command->add_option("--home-page", request->home_page,
                      "connect: an address of the lab's own, by which its people and scenarios are named; ends in /");
  command->add_option("--key", request->key,
                      "connect: file with the store's name:secret, readable by its owner alone");
  command->add_option("--port", request->server.port, "serve: 0 is any free one")->capture_default_str();
  command
      ->add_option("--address", request->server.address,
                   "serve: to listen on; another than this lets other computers in")
      ->capture_default_str();
  command->add_option("--host", request->hosts,
                      "serve: a name with port by which browsers may ask for it besides, such as lab.example:8480");
  command->add_option("--xapi", request->xapi, "connect: version that the store speaks; default: the newest it says")
      ->check(CLI::IsMember({"1.0.3", "2.0.0"}));
  command
      ->add_option("--waiting", request->waiting,
                   "connect to another store: send it what waits for the one before, or drop that")
      ->check(CLI::IsMember({"send", "drop"}));
  command
      ->add_option("--purpose", request->purpose,
                   "consent: record_store (attempts are told to it, by pseudonym) or research (numbers by pseudonym "
                   "leave the lab, and outlast the person's records)")
      ->check(CLI::IsMember(store::purposes()));
  command->add_flag("--given", request->given, "consent: was given");
  command->add_flag("--refused", request->refused, "consent: was refused or taken back; what waits is not told");
  command->add_flag("--research", request->for_research, "export: of those alone who agreed to it");
  command->add_option("--days", request->days, "retain: that records are kept after somebody's last attempt")
      ->check(CLI::Range(1, 36'500));
  command->add_flag("--off", request->off,
                    "connect: to no record store any more; join: to no server; retain: no limit; pin: none");
  command->add_flag("--follow", request->follow, "send: goes on until Ctrl-C, as the store comes and goes");
  command->add_flag("--names", request->names, "page, serve: with names beside the pseudonyms");
  command->add_option("--why", request->why, "exclude: the reason");
  command->add_flag("--undo", request->undo, "exclude: the attempt counts again");
  command->add_flag("--yes", request->yes, "erase, retain: really");
  command->footer(
      "`stylet train SCENARIO --trainee NAME` keeps an attempt from when its procedure begins: who tries again or "
      "walks\n"
      "away has failed it. A new name is enrolled and gets a pseudonym; records and exports have the pseudonym "
      "alone,\n"
      "names are in roster.db beside them. A recorded motion is a demonstration and counts for nothing.\n\n"
      "  stylet lab list                                 everybody, with attempts and passes\n"
      "  stylet lab show ada                             every attempt of one, and what the pass rate is known to "
      "be\n"
      "  stylet lab show ada --course needle_basics      gates passed, how far it is to the next, what to train now\n"
      "  stylet lab page --course needle_basics --out pages   a cohort as HTML: who stands where, every chart\n"
      "  stylet lab instructor ines                      a login for the pages; asks for a password\n"
      "  stylet lab serve --course needle_basics         the same pages at http://127.0.0.1:8480/, with notes and "
      "two\n"
      "                                                  attempts side by side; Ctrl-C ends it\n"
      "  stylet lab export --out attempts.csv            for R or a spreadsheet: a row an attempt, a column a "
      "metric\n"
      "  stylet lab export ada --format json             everything about one, as the person may ask for\n"
      "  stylet lab import ada --recording out/demo      a session from another computer: replayed bit for bit and "
      "scored\n"
      "                                                  again, refused where anything differs; practice unless "
      "--graded\n"
      "  stylet lab exclude 3f2b1c9d0e4a --why \"stylus unplugged\"   it counts no more, and says why\n"
      "  stylet lab enroll \"Ada Lovelace\"               somebody new, who is asked for in window and headset from "
      "then\n"
      "                                                  on; `train --trainee NAME` enrolls too\n"
      "  stylet lab consent ada --purpose record_store --given   what somebody agrees to; without --given: what was "
      "said\n"
      "  stylet lab retain --days 730                    who has not trained for so long; --yes erases them, or "
      "keeps "
      "the\n"
      "                                                  numbers of who agreed to research as those of nobody\n"
      "  stylet lab pin ada                              is asked for where a trainee is chosen\n"
      "  stylet lab erase ada                            says what would go; --yes does it, for good\n"
      "  stylet lab backup --out /media/usb/lab          a copy of all, while sessions go on\n"
      "  stylet lab connect --store https://lrs.example/xapi --home-page https://lab.example/stylet/ --key lrs.key\n"
      "  stylet lab send                                 what waits for the record store; sessions of a trainee send "
      "too\n"
      "  stylet lab join --database postgresql://lab@db.example/lab   makes this computer a station of that server\n"
      "  stylet lab hand-over                            gives it what this computer kept while it was away; "
      "sessions\n"
      "                                                  and every `stylet lab` do so too\n\n"
      "A gate proposes that somebody is competent; a person decides.\n"
      "Exit code 0: done; 1: erase or retain without --yes, send or hand-over with something left; 2: bad input.");
  command->callback([request, &exit_code] { exit_code = run(*request); });
}

}  // namespace stylet::tools
