#include "tools/bench/competence_stations.h"

#include "engine/lab/store/lab.h"
#include "engine/lab/store/postgres.h"
#include "tools/bench/scratch.h"
#include "tools/reference/postgres_server.h"

#include <fmt/format.h>

#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

namespace stylet::bench {

namespace {

namespace store = lab::store;

constexpr int kMetrics = 31;
constexpr std::size_t kIdLength = 36;

std::string take(store::Lab& lab, const store::Person& person) {
  store::AttemptEnd end{.total = 80, .pass_mark = 70, .passed = true, .state_hash = "00ff00ff00ff00ff"};
  for (int i = 0; i < kMetrics; ++i) {
    end.metrics.push_back({.metric = fmt::format("metric_number_{:02}", i), .value = i / 7.0});
  }
  const std::string attempt = lab.begin(
      {.trainee = person.id,
       .scenario = {.sha256 = std::string(64, 'a'), .name = "liver_biopsy", .title = "Liver biopsy", .text = "[]"},
       .build = "bench"});
  lab.end(attempt, end);
  return attempt;
}

/// Keeps attempts until it is killed, and tells of each that is kept.
[[noreturn]] void keep_attempts(const std::filesystem::path& folder, int tell) {
  store::Lab lab({.folder = folder, .build = "bench"});
  const store::Person person = lab.enrolled("trainee");
  while (true) {
    const std::string attempt = take(lab, person);
    if (::write(tell, attempt.data(), attempt.size()) != static_cast<ssize_t>(attempt.size())) ::_exit(1);
  }
}

/// In a process of its own. @return its id
template <typename Act>
pid_t in_a_process(const Act& act) {
  const pid_t child = ::fork();
  if (child < 0) throw std::runtime_error("another process cannot be made");
  if (child > 0) return child;
  try {
    act();
  } catch (const std::exception&) {
    ::_exit(1);
  }
  ::_exit(0);
}

/// A database of its own on a server that is given, or a server of its own.
struct OwnDatabase {
  OwnDatabase() {
    if (const char* given = std::getenv("STYLET_TEST_POSTGRES"); given != nullptr && *given != '\0') {
      name = fmt::format("stylet_bench_{}", ::getpid());
      server_address = given;
      store::PostgresDatabase(server_address, "public").run("CREATE DATABASE " + name + " TEMPLATE template0");
      address = server_address;
      address.replace(address.find("/postgres?"), 10, "/" + name + "?");
    } else if (const auto programs = reference::postgres_programs()) {
      server = std::make_unique<reference::PostgresServer>(*programs);
      address = server->address();
    }
  }
  ~OwnDatabase() {
    if (name.empty()) return;
    try {
      store::PostgresDatabase(server_address, "public").run("DROP DATABASE IF EXISTS " + name + " WITH (FORCE)");
    } catch (const std::exception&) {  // it goes with the server
    }
  }
  OwnDatabase(const OwnDatabase&) = delete;
  OwnDatabase& operator=(const OwnDatabase&) = delete;

  std::string address{};  ///< empty: there is no server
  std::string server_address{};
  std::string name{};
  std::unique_ptr<reference::PostgresServer> server{};
};

}  // namespace

void measure_kills(Report& report, int kills) {
  const Scratch folder;
  std::mt19937 random(2027);
  std::set<std::string> told;
  for (int k = 0; k < kills; ++k) {
    int ends[2];
    if (::pipe(ends) != 0) throw std::runtime_error("a pipe cannot be made");
    const pid_t child = in_a_process([&] {
      ::close(ends[0]);
      keep_attempts(folder.path(), ends[1]);
    });
    ::close(ends[1]);
    const auto hear = [&] {
      std::string attempt(kIdLength, '\0');
      if (::read(ends[0], attempt.data(), attempt.size()) != static_cast<ssize_t>(kIdLength)) return false;
      told.insert(attempt);
      return true;
    };
    // At any moment after so many: opening, beginning, keeping.
    for (auto messages = random() % 3; messages > 0 && hear(); --messages) {
    }
    ::usleep(static_cast<useconds_t>(random() % 30'000));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    while (hear()) {
    }
    ::close(ends[0]);
  }
  store::Lab lab({.folder = folder.path(), .build = "bench"});
  std::set<std::string> whole;
  int half = 0;
  const auto metrics = lab.all_metrics();
  for (const store::AttemptRecord& attempt : lab.attempts()) {
    const auto found = metrics.find(attempt.id);
    const std::size_t has = found != metrics.end() ? found->second.size() : 0;
    const bool ended = attempt.status == "ended" && has == kMetrics && attempt.total == 80.0;
    if (ended) whole.insert(attempt.id);
    if (!ended && (attempt.status != "crashed" || has > 0)) ++half;
  }
  const auto lost = std::ranges::count_if(told, [&](const std::string& id) { return !whole.contains(id); });
  const std::string of =
      fmt::format("{} kills at random moments, {} attempts had been said to be kept", kills, told.size());
  report.add(noted(at_most("records.killed.lost", static_cast<double>(lost), "1", 0), of));
  report.add(noted(at_most("records.killed.half", half, "1", 0), of));
}

void measure_stations(Report& report, int attempts_each) {
  constexpr int kStations = 8;
  const OwnDatabase database;
  if (database.address.empty()) {
    report.add(noted({"postgres.left_out", 1, "1"}, "there is no PostgreSQL server here; Debian: postgresql"));
    return;
  }
  const Scratch folder;
  const auto settings = [&](int station, bool server) {
    return store::LabSettings{.folder = folder.path() / std::to_string(station),
                              .build = "bench",
                              .database = server ? database.address : ""};
  };
  std::set<std::string> taken;
  for (int i = 0; i < kStations; ++i) {
    store::Lab own(settings(i, false));
    own.database().run("PRAGMA synchronous=OFF");
    // The same people everywhere, enrolled at each by itself.
    for (int k = 0; k < attempts_each; ++k) taken.insert(take(own, own.enrolled(fmt::format("trainee {}", k % 3))));
  }
  const auto begun = std::chrono::steady_clock::now();
  std::vector<pid_t> stations;
  for (int i = 0; i < kStations; ++i) {
    stations.push_back(in_a_process([&] {
      store::Lab own(settings(i, false));
      store::Lab server(settings(i, true));
      own.hand_over(server);
      // And one right into the server.
      const store::Person person = server.enrolled("trainee 0");
      take(server, person);
    }));
  }
  int failed = 0;
  for (const pid_t station : stations) {
    int status = 0;
    ::waitpid(station, &status, 0);
    failed += WIFEXITED(status) && WEXITSTATUS(status) == 0 ? 0 : 1;
  }
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
  store::Lab server(settings(0, true));
  const auto metrics = server.all_metrics();
  std::map<std::string, int> there;
  for (const store::AttemptRecord& attempt : server.attempts()) {
    const auto found = metrics.find(attempt.id);
    if (found != metrics.end() && found->second.size() == kMetrics) ++there[attempt.id];
  }
  const std::size_t wanted = taken.size() + kStations;
  const auto lost =
      std::ranges::count_if(taken, [&](const std::string& id) { return !there.contains(id); }) +
      std::max<std::ptrdiff_t>(0, static_cast<std::ptrdiff_t>(wanted) - static_cast<std::ptrdiff_t>(there.size()));
  const auto twice = std::ranges::count_if(there, [](const auto& attempt) { return attempt.second > 1; }) +
                     (static_cast<std::ptrdiff_t>(server.people().size()) - std::min(3, attempts_each));
  const std::string of = fmt::format("{} stations at once, {} attempts, {:.2f} s", kStations, wanted, seconds);
  report.add(noted(at_most("postgres.lost", static_cast<double>(lost), "1", 0), of));
  report.add(noted(at_most("postgres.twice", static_cast<double>(twice), "1", 0), "attempts, and people; " + of));
  report.add(at_most("postgres.failed", failed, "1", 0));
}

}  // namespace stylet::bench
