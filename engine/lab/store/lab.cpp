#include "engine/lab/store/lab.h"

#include "engine/files/error.h"
#include "engine/files/json_reader.h"
#include "engine/files/json_scan.h"
#include "engine/lab/store/digest.h"
#include "engine/lab/store/identity.h"
#include "engine/lab/store/lab_files.h"
#include "engine/lab/store/postgres.h"
#include "engine/lab/store/schema.h"
#include "engine/lab/store/sqlite.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <set>
#include <string_view>
#include <system_error>
#include <tuple>
#include <utility>

namespace stylet::lab::store {

namespace fs = std::filesystem;

namespace {

constexpr std::int32_t kRecordsFile = 0x53744C62;  // "StLb"
constexpr std::size_t kLongestName = 200;          // bytes
constexpr std::int64_t kDayMs = 86'400'000;

/// A lock that goes with its process. @return -1: another one has it, or there is no file
int locked(const fs::path& path, int flags) {
  const int file = ::open(path.c_str(), flags | O_CLOEXEC, 0600);
  if (file < 0) return -1;
  if (::flock(file, LOCK_EX | LOCK_NB) == 0) return file;
  ::close(file);
  return -1;
}

/// Whether the open file is still the one of that name.
bool is_at(int file, const fs::path& path) {
  struct stat open {};
  struct stat named {};
  return ::fstat(file, &open) == 0 && ::stat(path.c_str(), &named) == 0 && open.st_ino == named.st_ino &&
         open.st_dev == named.st_dev;
}

int utc_offset_min(std::int64_t ms) {
  const std::time_t seconds = ms / 1000;
  std::tm local{};
  ::localtime_r(&seconds, &local);
  return static_cast<int>(local.tm_gmtoff / 60);
}

Value or_null(const std::string& text) {
  return text.empty() ? Value() : Value(text);
}

std::unique_ptr<Database> records_of(const LabSettings& settings) {
  private_folder(settings.folder);
  if (!settings.database.empty()) return std::make_unique<PostgresDatabase>(settings.database, "stylet");
  return std::make_unique<SqliteDatabase>(settings.folder / "lab.db", kRecordsFile);
}

Roster roster_of(const LabSettings& settings) {
  // Apart from the records also there: a dump of "stylet" alone names nobody.
  if (!settings.database.empty()) {
    return Roster(std::make_unique<PostgresDatabase>(settings.database, "stylet_roster"));
  }
  return Roster(settings.folder / "roster.db");
}

MetricResult metric_of(const Row& row, std::size_t from) {
  return {.metric = text(row[from]),
          .value = number(row[from + 1]),
          .points = number(row[from + 2]),
          .most = number(row[from + 3])};
}

}  // namespace

std::int64_t system_ms() {
  return std::chrono::duration_cast<std::chrono::milliseconds>(std::chrono::system_clock::now().time_since_epoch())
      .count();
}

fs::path default_lab_folder() {
  if (const char* lab = std::getenv("STYLET_LAB"); lab != nullptr && *lab != '\0') return lab;
  const char* data = std::getenv("XDG_DATA_HOME");
  if (data != nullptr && fs::path(data).is_absolute()) return fs::path(data) / "stylet" / "lab";
  const char* home = std::getenv("HOME");
  if (home != nullptr && fs::path(home).is_absolute()) return fs::path(home) / ".local" / "share" / "stylet" / "lab";
  throw files::ContentError(
      "the lab's records have no place: none of STYLET_LAB, XDG_DATA_HOME and HOME is a folder; name one with --lab");
}

bool AttemptRecord::counts() const {
  const bool of_gate = mode == "graded" || mode == "retention";
  const bool scored = status != "ended" || passed.has_value();
  return of_gate && status != "running" && scored && excluded.empty();
}

std::int64_t AttemptRecord::local_day() const {
  return (started_ms + std::int64_t{utc_offset_min} * 60'000) / kDayMs;
}

Lab::Lab(LabSettings settings)
    : settings_(std::move(settings)),
      opened_(records_of(settings_)),
      database_(*opened_),
      roster_(roster_of(settings_)) {
  const int version = schema_version(database_);
  const int newest = migrations().back().version;
  if (version > 0 && version < newest && settings_.database.empty()) {
    const fs::path backups = private_folder(settings_.folder / "backups");
    database_.copy_to(backups / fmt::format("before-version-{}-{}.db", newest, time_name(settings_.clock())));
  }
  migrate(database_, migrations(), settings_.clock(), settings_.build);
  adopt_crashed();
  sweep_locks();
  sweep_erased();
}

Lab::~Lab() {
  for (const auto& [attempt, file] : running_) ::close(file);
}

fs::path Lab::running_folder() const {
  return settings_.folder / (settings_.database.empty() ? "running" : "running-at-server");
}

std::vector<std::string> Lab::perhaps_cut_off() {
  std::vector<std::string> attempts;
  if (settings_.database.empty()) {
    // Whatever this computer is called today: the file is of one, the lock tells.
    for (const Row& row : database_.run("SELECT id FROM attempt WHERE status = 'running'")) {
      attempts.push_back(text(row[0]));
    }
    return attempts;
  }
  // Other stations' attempts go on there; this one's have left their locks.
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(running_folder(), error)) {
    if (is_id(entry.path().filename().string())) attempts.push_back(entry.path().filename());
  }
  return attempts;
}

void Lab::adopt_crashed() {
  for (const std::string& attempt : perhaps_cut_off()) {
    if (running_.contains(attempt)) continue;
    const fs::path lock = running_folder() / attempt;
    std::error_code error;
    const int file = locked(lock, O_RDWR);
    if (file < 0 && fs::exists(lock, error)) continue;  // it goes on
    {
      Transaction transaction(database_);
      // Another program may have been first, or the person erased meanwhile.
      const auto changed = database_.run(
          "UPDATE attempt SET status = 'crashed' WHERE id = $1 AND status = 'running' RETURNING id", {attempt});
      if (!changed.empty()) tell_end(attempt);
      transaction.commit();
    }
    fs::remove(lock, error);
    if (file >= 0) ::close(file);
  }
}

void Lab::sweep_locks() {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(running_folder(), error)) {
    const int file = locked(entry.path(), O_RDWR);
    if (file < 0) continue;
    // Of a process that is gone: killed before its row was there, or after its attempt was kept.
    std::error_code ignored;
    fs::remove(entry.path(), ignored);
    ::close(file);
  }
}

std::string Lab::station() {
  std::array<char, 256> host{};
  if (::gethostname(host.data(), host.size() - 1) != 0) host[0] = '\0';
  const std::string name = host.data();
  const auto rows = database_.run("SELECT id FROM station WHERE name = $1", {name});
  if (!rows.empty()) return text(rows[0][0]);
  const std::int64_t now = settings_.clock();
  // Two processes at once are one station all the same.
  database_.run("INSERT INTO station SELECT $1, $2, $3 WHERE NOT EXISTS (SELECT 1 FROM station WHERE name = $2)",
                {new_id(now), name, now});
  return text(database_.run("SELECT id FROM station WHERE name = $1", {name})[0][0]);
}

std::optional<Person> Lab::find(const std::string& who) {
  if (!files::is_utf8(who)) return std::nullopt;  // nobody is called so, and not every database is to be asked
  std::string pseudonym = roster_.pseudonym_of(who).value_or("");
  if (pseudonym.empty()) pseudonym = normalized_pseudonym(who);
  const auto rows = database_.run("SELECT id, pseudonym FROM trainee WHERE pseudonym = $1", {pseudonym});
  if (rows.empty()) return std::nullopt;
  const auto names = roster_.names();
  const auto name = names.find(pseudonym);
  return Person{.id = text(rows[0][0]), .pseudonym = pseudonym, .name = name != names.end() ? name->second : ""};
}

Person Lab::get(const std::string& who) {
  if (auto person = find(who)) return *std::move(person);
  std::set<std::string> names;
  for (const auto& [pseudonym, name] : roster_.names()) names.insert(name);
  const std::string close = files::nearest(who, names);
  throw files::ContentError(
      fmt::format("{} is nobody in {}; {}", files::printable(who), settings_.folder.string(),
                  close.empty() ? "`stylet lab list` shows everybody" : fmt::format("did you mean {}?", close)));
}

Person Lab::enrolled(const std::string& who) {
  if (auto person = find(who)) return *std::move(person);
  const bool odd = std::ranges::any_of(who, [](char c) { return static_cast<unsigned char>(c) < 0x20 || c == 0x7f; });
  if (who.empty() || who.size() > kLongestName || odd || !files::is_utf8(who) || who.front() == ' ' ||
      who.back() == ' ') {
    throw files::ContentError(
        fmt::format("\"{}\" is no name of a trainee; write up to {} bytes on one line, no blanks at "
                    "its ends",
                    files::printable(who), kLongestName));
  }
  refuse_slip(who);
  forget_erased_names();  // who was erased comes as somebody new
  const std::int64_t now = settings_.clock();
  // The name first: a kill in between leaves one without records, which is enrolled the next time, as are those whose
  // records were lost. Another program may do the same at once.
  if (!roster_.pseudonym_of(who)) {
    std::string pseudonym;
    do {
      pseudonym = new_pseudonym();
    } while (find(pseudonym));
    roster_.add(who, pseudonym, now);
  }
  database_.run(
      "INSERT INTO trainee(id, pseudonym, role, level, created_ms) VALUES ($1, $2, 'trainee', '', $3) ON CONFLICT DO "
      "NOTHING",
      {new_id(now), roster_.pseudonym_of(who).value_or(""), now});
  Person person = get(who);
  person.added = true;
  return person;
}

void Lab::refuse_slip(const std::string& who) {
  const std::string typed = normalized_pseudonym(who);
  std::set<std::string> pseudonyms;
  for (const Row& row : database_.run("SELECT pseudonym FROM trainee")) pseudonyms.insert(text(row[0]));
  const std::string meant = files::nearest(typed, pseudonyms);
  if (!looks_like_pseudonym(who) && (meant.empty() || typed.size() < 6 || typed.size() > 8)) return;
  throw files::ContentError(fmt::format(
      "{} looks like a pseudonym and is nobody's in {}; {}", files::printable(who), settings_.folder.string(),
      meant.empty() ? "`stylet lab list` shows everybody" : fmt::format("did you mean {}?", meant)));
}

std::vector<PersonSummary> Lab::listed() {
  const auto names = roster_.names();
  std::vector<PersonSummary> all;
  for (Row& row : database_.run("SELECT id, pseudonym, level FROM trainee ORDER BY created_ms, id")) {
    PersonSummary& summary = all.emplace_back();
    Person& person = summary.person;
    person.id = text(std::move(row[0]));
    person.pseudonym = text(std::move(row[1]));
    summary.anonymous = text(row[2]) == kAnonymous;
    if (const auto name = names.find(person.pseudonym); name != names.end()) person.name = name->second;
  }
  return all;
}

std::vector<Person> Lab::everybody() {
  std::vector<Person> all;
  for (PersonSummary& summary : listed()) {
    if (!summary.anonymous) all.push_back(std::move(summary.person));
  }
  return all;
}

std::vector<PersonSummary> Lab::people() {
  std::map<std::string, PersonSummary> taken;  // by pseudonym
  for (const AttemptRecord& attempt : attempts()) {
    PersonSummary& summary = taken[attempt.pseudonym];
    summary.attempts += 1;
    summary.passed += attempt.counts() && attempt.succeeded() ? 1 : 0;
    summary.last_ms = attempt.started_ms;
  }
  std::vector<PersonSummary> all = listed();
  for (PersonSummary& summary : all) {
    const PersonSummary& counted = taken[summary.person.pseudonym];
    summary.attempts = counted.attempts;
    summary.passed = counted.passed;
    summary.last_ms = counted.last_ms;
  }
  return all;
}

void Lab::keep_subject(const char* table, const Subject& subject) {
  const bool scenario = std::string_view(table) == "scenario";
  if (scenario) {
    database_.run("INSERT INTO scenario(sha256, name, title, scoring) VALUES ($1, $2, $3, $4) ON CONFLICT DO NOTHING",
                  {subject.sha256, subject.name, subject.title, subject.text});
  } else {
    database_.run("INSERT INTO course(sha256, name, spec) VALUES ($1, $2, $3) ON CONFLICT DO NOTHING",
                  {subject.sha256, subject.name, subject.text});
  }
}

void Lab::lock_running(const std::string& attempt) {
  const fs::path lock = private_folder(running_folder()) / attempt;
  constexpr int kTries = 100;
  int file = -1;
  for (int k = 0; k < kTries; ++k) {
    file = locked(lock, O_RDWR | O_CREAT);
    if (file < 0) continue;
    if (is_at(file, lock)) break;
    ::close(file);  // swept away by another program in between
    file = -1;
  }
  if (file < 0) {
    throw files::ContentError(
        fmt::format("{}: cannot be made ({}); check folder and space", lock.string(), std::strerror(errno)));
  }
  running_[attempt] = file;
}

void Lab::unlock_running(const std::string& attempt) {
  const auto found = running_.find(attempt);
  if (found == running_.end()) return;
  std::error_code error;
  fs::remove(running_folder() / attempt, error);
  ::close(found->second);
  running_.erase(found);
}

std::string Lab::begin(const AttemptStart& start) {
  // Attempts keep their order where the clock was set back a little, or two are of one millisecond.
  constexpr std::int64_t kSlipMs = 3'600'000;
  std::int64_t now = settings_.clock();
  const std::int64_t last = integer(
      database_.run("SELECT coalesce(max(started_ms), 0) FROM attempt WHERE trainee = $1", {start.trainee})[0][0]);
  if (now <= last && last - now < kSlipMs) now = last + 1;
  const std::string of_station = station();
  std::string attempt = new_id(now);
  lock_running(attempt);  // before the row: who finds the row without a lock takes it for cut off
  try {
    write_beginning(attempt, now, of_station, start, true);
  } catch (...) {
    unlock_running(attempt);
    throw;
  }
  return attempt;
}

void Lab::write_beginning(const std::string& attempt, std::int64_t now, const std::string& of_station,
                          const AttemptStart& start, bool tell) {
  Transaction transaction(database_);
  keep_subject("scenario", start.scenario);
  if (start.course) keep_subject("course", *start.course);
  database_.run(
      "INSERT INTO attempt(id, trainee, course, scenario, station, mode, build, stylus, loop_mode, started_ms, "
      "utc_offset_min, status) VALUES ($1, $2, $3, $4, $5, $6, $7, $8, $9, $10, $11, 'running')",
      {attempt, start.trainee, start.course ? Value(start.course->sha256) : Value(), start.scenario.sha256,
       of_station, start.mode, start.build, start.stylus, start.loop_mode, now, std::int64_t{utc_offset_min(now)}});
  if (tell) tell_beginning(attempt);
  transaction.commit();
}

fs::path Lab::recording_of(const std::string& attempt) const {
  const auto began = static_cast<std::time_t>(time_of(attempt) / 1000);
  return settings_.folder / "recordings" / fmt::format("{:%Y}", fmt::gmtime(began)) /
         fmt::format("{:%m}", fmt::gmtime(began)) / (attempt + ".rec");
}

Lab::KeptRecording Lab::keep_recording(const std::string& attempt, const fs::path& recording) {
  const fs::path place = recording_of(attempt);
  private_folder(settings_.folder / "recordings");
  private_folder(place.parent_path());
  const fs::path part = unfinished(place);
  std::error_code error;
  // No link: what is done to the session's results later must not change what is kept.
  fs::copy_file(recording, part, fs::copy_options::overwrite_existing, error);
  if (!error) fs::permissions(part, fs::perms::owner_read | fs::perms::owner_write, error);
  if (!error) sync(part);
  if (!error) fs::rename(part, place, error);
  if (error) {
    throw files::ContentError(fmt::format("{}: the recording cannot be kept there ({}); it is {}", place.string(),
                                          error.message(), recording.string()));
  }
  sync(place.parent_path());
  return {.bytes = static_cast<std::int64_t>(fs::file_size(place, error)), .sha256 = sha256_of_file(place)};
}

std::string Lab::end(const std::string& attempt, const AttemptEnd& end) {
  if (database_.run("SELECT 1 FROM attempt WHERE id = $1", {attempt}).empty()) {
    unlock_running(attempt);
    throw files::ContentError(database_.place() + ": the trainee was erased meanwhile");
  }
  KeptRecording kept;
  std::string problem;
  if (!end.recording.empty()) {
    try {
      kept = keep_recording(attempt, end.recording);
    } catch (const files::ContentError& error) {
      problem = error.what();
      remove_recording(recording_of(attempt));  // the numbers may need its room
    }
  }
  write_end(attempt, end, kept, settings_.clock(), {});
  unlock_running(attempt);
  return problem;
}

void Lab::write_end(const std::string& attempt, const AttemptEnd& end, const KeptRecording& recording,
                    std::int64_t ended_ms, const std::string& mode) {
  std::optional<std::int64_t> passed;
  if (end.passed) passed = *end.passed ? 1 : 0;
  Transaction transaction(database_);
  database_.run(
      "UPDATE attempt SET ended_ms = $1, status = $2, total = $3, pass_mark = $4, passed = $5, failed_critical = $6, "
      "missed_deadlines = $7, state_hash = $8, recording_sha256 = $9, recording_bytes = $10, mode = coalesce($11, "
      "mode) WHERE id = $12",
      {ended_ms, end.status, value_of(end.total), value_of(end.pass_mark), value_of(passed),
       or_null(end.failed_critical), end.missed_deadlines, or_null(end.state_hash), or_null(recording.sha256),
       value_of(recording.bytes), or_null(mode), attempt});
  for (const MetricResult& metric : end.metrics) {
    database_.run("INSERT INTO attempt_metric(attempt, metric, value, points, most) VALUES ($1, $2, $3, $4, $5)",
                  {attempt, metric.metric, value_of(metric.value), value_of(metric.points), value_of(metric.most)});
  }
  if (!mode.empty()) tell_beginning(attempt);  // all at once
  tell_end(attempt);
  transaction.commit();
}

std::string Lab::take_in(const AttemptStart& start, const AttemptEnd& end, std::int64_t started_ms,
                         std::int64_t ended_ms) {
  const std::string hash = sha256_of_file(end.recording);
  if (const auto rows = database_.run("SELECT id FROM attempt WHERE recording_sha256 = $1", {hash}); !rows.empty()) {
    throw files::ContentError(fmt::format("{}: is in {} already, as the attempt {}", end.recording.string(),
                                          settings_.folder.string(), text(rows[0][0])));
  }
  // Until it is whole it is practice: cut off in the middle it is nobody's failure, and erasure finds what it left.
  AttemptStart unfinished_start = start;
  unfinished_start.mode = "practice";
  const std::string of_station = station();
  const std::string attempt = new_id(started_ms);
  lock_running(attempt);
  try {
    write_beginning(attempt, started_ms, of_station, unfinished_start, false);
    try {
      write_end(attempt, end, keep_recording(attempt, end.recording), ended_ms, start.mode);
    } catch (...) {
      remove_recording(recording_of(attempt));
      database_.run("DELETE FROM outbox WHERE attempt = $1", {attempt});
      database_.run("DELETE FROM attempt WHERE id = $1", {attempt});
      throw;
    }
  } catch (...) {
    unlock_running(attempt);
    throw;
  }
  unlock_running(attempt);
  return attempt;
}

std::map<std::string, std::string> Lab::exclusions() {
  std::map<std::string, std::string> why;
  for (Row& row : database_.run("SELECT attempt, why, undone FROM exclusion ORDER BY at_ms, id")) {
    why[text(std::move(row[0]))] = integer(row[2]) == 0 ? text(std::move(row[1])) : "";
  }
  return why;
}

std::map<std::string, std::string> Lab::words(const std::string& sql) {
  std::map<std::string, std::string> all;
  for (Row& row : database_.run(sql)) all[text(std::move(row[0]))] = text(std::move(row[1]));
  return all;
}

std::vector<AttemptRecord> Lab::attempts(const std::string& trainee) {
  // Of ten thousand the joins and the order were most of the time: names are looked up here.
  const std::string where = trainee.empty() ? "" : " WHERE trainee = $1";
  std::vector<Value> values;
  if (!trainee.empty()) values.emplace_back(trainee);
  std::vector<Row> rows = database_.run(
      "SELECT id, trainee, scenario, course, mode, build, stylus, started_ms, utc_offset_min, ended_ms, status, "
      "total, pass_mark, passed, failed_critical, recording_sha256 FROM attempt" +
          where,
      values);
  const auto pseudonyms = words("SELECT id, pseudonym FROM trainee");
  const auto scenarios = words("SELECT sha256, name FROM scenario");
  const auto courses = words("SELECT sha256, name FROM course");
  const auto excluded = exclusions();
  const auto word = [](const std::map<std::string, std::string>& all, const std::string& key) {
    const auto found = all.find(key);
    return found != all.end() ? found->second : std::string();
  };
  std::vector<AttemptRecord> all;
  all.reserve(rows.size());
  for (Row& row : rows) {
    const std::string pseudonym = word(pseudonyms, text(std::move(row[1])));
    if (pseudonym.empty()) continue;  // erased by another program in between
    AttemptRecord& record = all.emplace_back();
    record.id = text(std::move(row[0]));
    record.pseudonym = pseudonym;
    record.scenario_sha256 = text(std::move(row[2]));
    record.scenario = word(scenarios, record.scenario_sha256);
    record.course = word(courses, text(std::move(row[3])));
    record.mode = text(std::move(row[4]));
    record.build = text(std::move(row[5]));
    record.stylus = text(std::move(row[6]));
    record.started_ms = integer(row[7]);
    record.utc_offset_min = static_cast<int>(integer(row[8]));
    if (number(row[9])) record.ended_ms = integer(row[9]);
    record.status = text(std::move(row[10]));
    record.total = number(row[11]);
    record.pass_mark = number(row[12]);
    record.passed = truth(row[13]);
    record.failed_critical = text(std::move(row[14]));
    record.recording_sha256 = text(std::move(row[15]));
    record.excluded = word(excluded, record.id);
  }
  std::ranges::sort(all, {}, [](const AttemptRecord& record) { return std::tie(record.started_ms, record.id); });
  std::map<std::pair<std::string_view, std::string_view>, int> taken;
  for (AttemptRecord& record : all) record.number = ++taken[{record.pseudonym, record.scenario}];
  return all;
}

std::vector<MetricResult> Lab::metrics(const std::string& attempt) {
  std::vector<MetricResult> all;
  for (const Row& row : database_.run(
           "SELECT metric, value, points, most FROM attempt_metric WHERE attempt = $1 ORDER BY metric", {attempt})) {
    all.push_back(metric_of(row, 0));
  }
  return all;
}

std::map<std::string, std::vector<MetricResult>> Lab::all_metrics(const std::string& trainee) {
  std::map<std::string, std::vector<MetricResult>> all;
  const std::string columns = "SELECT m.attempt, m.metric, m.value, m.points, m.most FROM attempt_metric m ";
  auto rows =
      trainee.empty()
          ? database_.run(columns + "ORDER BY m.attempt, m.metric")
          : database_.run(
                columns + "JOIN attempt a ON a.id = m.attempt WHERE a.trainee = $1 ORDER BY m.attempt, m.metric",
                {trainee});
  for (Row& row : rows) all[text(std::move(row[0]))].push_back(metric_of(row, 1));
  return all;
}

std::map<std::string, std::vector<MetricResult>> Lab::metrics_at(const std::string& scenario_sha256,
                                                                 const std::set<std::string>& names) {
  std::map<std::string, std::vector<MetricResult>> all;
  for (const std::string& name : names) {
    // Each attempt's own row by its key: a scan would read thirty times as many.
    for (Row& row : database_.run(
             "SELECT m.attempt, m.metric, m.value, m.points, m.most FROM attempt a CROSS JOIN attempt_metric "
             "m WHERE a.scenario = $1 AND m.attempt = a.id AND m.metric = $2",
             {scenario_sha256, name})) {
      all[text(std::move(row[0]))].push_back(metric_of(row, 1));
    }
  }
  return all;
}

std::optional<std::string> Lab::taken_by(const std::string& attempt) {
  const auto rows = database_.run(
      "SELECT t.pseudonym FROM attempt a JOIN trainee t ON t.id = a.trainee WHERE a.id = $1", {attempt});
  if (rows.empty()) return std::nullopt;
  return text(rows[0][0]);
}

std::string Lab::exclude(const std::string& attempt, const std::string& author, const std::string& why) {
  const auto rows = database_.run(
      "SELECT id FROM attempt WHERE id = $1 OR substr(id, length(id) - length($1) + 1) = $1", {attempt});
  if (attempt.empty() || rows.size() != 1) {
    throw files::ContentError(fmt::format("{} is {}; `stylet lab show TRAINEE` lists the ends of their ids",
                                          files::printable(attempt),
                                          rows.size() > 1 ? "the end of several attempts" : "no attempt"));
  }
  const std::string id = text(rows[0][0]);
  // The last word is the newest also where the clock was set back.
  const std::int64_t before =
      integer(database_.run("SELECT coalesce(max(at_ms), 0) FROM exclusion WHERE attempt = $1", {id})[0][0]);
  const std::int64_t now = std::max(settings_.clock(), before + 1);
  database_.run("INSERT INTO exclusion(id, attempt, author, at_ms, why, undone) VALUES ($1, $2, $3, $4, $5, $6)",
                {new_id(now), id, author, now, why, std::int64_t{why.empty() ? 1 : 0}});
  return id;
}

void Lab::note(const std::string& what, const std::string& object, const std::string& who) {
  const std::int64_t now = settings_.clock();
  const char* user = std::getenv("USER");
  database_.run("INSERT INTO audit(id, at_ms, who, what, object) VALUES ($1, $2, $3, $4, $5)",
                {new_id(now), now, !who.empty() ? who : std::string(user != nullptr ? user : ""), what, object});
}

}  // namespace stylet::lab::store
