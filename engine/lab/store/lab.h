// The records of a skills lab: a folder with who trained what and what came of it.
//
//   lab.db             every attempt with its metrics, by pseudonym
//   roster.db          names and their pseudonyms
//   recordings/        YYYY/MM/ATTEMPT.rec
//   running/           a lock for each attempt under way
//   backups/           lab-TIME/: copies
//
// Or records and roster on a PostgreSQL server, for many stations: recordings stay in the station's folder, and a
// station without its server goes on in its own files (station.h).
//
// An attempt is written when its procedure begins and once more when it ends, so that who walks away leaves a trace.
#pragma once

#include "engine/lab/store/database.h"
#include "engine/lab/store/roster.h"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

namespace stylet::lab::store {

/// Unix milliseconds.
using Clock = std::function<std::int64_t()>;
std::int64_t system_ms();

struct Person {
  std::string id{};
  std::string pseudonym{};
  std::string name{};  ///< of the roster; empty: it has none
  bool added = false;  ///< just now
};

/// What an attempt was at, by its content.
struct Subject {
  std::string sha256{};
  std::string name{};
  std::string title{};
  std::string text{};  ///< of a scenario its scoring, of a course its file
};

struct AttemptStart {
  std::string trainee{};  ///< Person::id
  Subject scenario{};
  std::optional<Subject> course{};
  std::string mode = "graded";
  std::string build{};
  std::string stylus{};
  std::string loop_mode{};
};

struct MetricResult {
  std::string metric{};
  std::optional<double> value{};   ///< in the metric's unit; none: nothing there to measure it on
  std::optional<double> points{};  ///< where the scenario scores it
  std::optional<double> most{};
};

struct AttemptEnd {
  std::string status = "ended";  ///< or "aborted"
  std::optional<double> total{};
  std::optional<double> pass_mark{};
  std::optional<bool> passed{};   ///< none: the scenario scores nothing
  std::string failed_critical{};  ///< metrics, with blanks between
  std::int64_t missed_deadlines = 0;
  std::string state_hash{};
  std::vector<MetricResult> metrics{};
  std::filesystem::path recording{};  ///< copied; empty: there is none
};

struct AttemptRecord {
  std::string id{};
  std::string pseudonym{};
  std::string scenario{};  ///< name
  std::string scenario_sha256{};
  std::string course{};  ///< name; empty: none
  int number = 0;        ///< of this trainee at this scenario, from 1
  std::string mode{};
  std::string build{};
  std::string stylus{};
  std::int64_t started_ms = 0;
  int utc_offset_min = 0;
  std::optional<std::int64_t> ended_ms{};
  std::string status{};
  std::optional<double> total{};
  std::optional<double> pass_mark{};
  std::optional<bool> passed{};
  std::string failed_critical{};
  std::string recording_sha256{};
  std::string excluded{};  ///< why; empty: it counts

  /// Whether it is one outcome of a gate: graded or a retention test, begun and over, scored, not excluded.
  bool counts() const;
  /// Of one that counts: broken off or cut off it failed.
  bool succeeded() const { return status == "ended" && passed.value_or(false); }
  /// Days since 1970-01-01 where it was taken.
  std::int64_t local_day() const;
};

struct PersonSummary {
  Person person{};
  int attempts = 0;
  int passed = 0;
  std::int64_t last_ms = 0;  ///< 0: none
  bool anonymous = false;    ///< whose numbers alone are left
};

/// What an erasure took, and what it cannot reach.
struct Erased {
  int attempts = 0;
  int recordings = 0;
  std::vector<std::filesystem::path> backups{};  ///< that still hold the person
};

/// What an instructor wrote of a trainee.
struct Note {
  std::string author{};
  std::int64_t at_ms = 0;
  std::string body{};
};

/// The last word on a purpose.
struct Consent {
  std::string purpose{};
  std::optional<bool> given{};  ///< none: never asked, which is no consent
  std::int64_t at_ms = 0;       ///< when it was said
};

/// Of a trainee at a station.
struct Pin {
  std::string hash{};
  int wrong = 0;             ///< tries in a row
  std::int64_t wait_ms = 0;  ///< above 0: no try is looked at now
};

struct LabSettings {
  std::filesystem::path folder{};
  std::string build{};  ///< version and commit, for migrations
  Clock clock = system_ms;
  std::string database{};  ///< address of a PostgreSQL server that has records and roster; empty: files of the folder
};

/// What a station gave to its server.
struct HandedOver {
  int attempts = 0;
  int people = 0;                                ///< new to the server
  int erased = 0;                                ///< people erased there, whom the station has now forgotten too
  std::vector<std::filesystem::path> backups{};  ///< of the station, that still hold those
  int left = 0;                                  ///< people or attempts that the server does not take
  std::string problem{};                         ///< of the last of those
};

/// STYLET_LAB, else stylet/lab in XDG_DATA_HOME or ~/.local/share. @throws files::ContentError  there is no such
/// place
std::filesystem::path default_lab_folder();

// Settings.
inline constexpr const char* kEndpoint = "xapi.endpoint";    ///< address of the record store
inline constexpr const char* kHomePage = "xapi.home_page";   ///< of the lab; set: attempts are told to the store
inline constexpr const char* kKeyFile = "xapi.key_file";     ///< has the store's key
inline constexpr const char* kXapiVersion = "xapi.version";  ///< that the store speaks
inline constexpr const char* kWaitsFor = "xapi.waits_for";   ///< endpoint of what waits, also after it is set no more

inline constexpr const char* kRetentionDays = "retention.days";  ///< that people are kept after their last attempt

// Purposes of consent.
inline constexpr const char* kRecordStore = "record_store";  ///< statements by pseudonym leave the lab
inline constexpr const char* kResearch = "research";         ///< numbers by pseudonym leave the lab; they outlast it
std::vector<std::string> purposes();

inline constexpr std::size_t kLongestNote = 15'000;     ///< bytes
inline constexpr const char* kAnonymous = "anonymous";  ///< level of those whose numbers alone are left
inline constexpr std::int64_t kLongestPinWaitMs = 300'000;

inline constexpr const char* kDatabase = "lab.database";  ///< of a station: address of its server, no password in it

/// One thread at a time.
class Lab {
public:
  /// Opens the records, or makes them; takes them to the newest version, a copy before; attempts whose process is
  /// gone become "crashed", and what an erasure left lying is taken away.
  /// @throws files::ContentError
  explicit Lab(LabSettings settings);
  ~Lab();
  Lab(const Lab&) = delete;
  Lab& operator=(const Lab&) = delete;

  const std::filesystem::path& folder() const { return settings_.folder; }
  Database& database() { return database_; }

  /// By name or pseudonym. Nothing: nobody.
  std::optional<Person> find(const std::string& who);
  /// By name or pseudonym, with whom could be meant. @throws files::ContentError  nobody
  Person get(const std::string& who);
  /// The same; a name that is new gets a pseudonym. @throws files::ContentError  no name: empty, too long, with
  /// control characters, a pseudonym with a slip or of nobody
  Person enrolled(const std::string& who);
  /// In the order in which they came.
  std::vector<Person> everybody();
  /// The same, with what they have done, and those whose numbers alone are left.
  std::vector<PersonSummary> people();

  /// The procedure begins. @return id of the attempt, which is "running" while this lives
  std::string begin(const AttemptStart& start);
  /// It is over: numbers and status, all or nothing, and the recording.
  /// @return why the recording is not kept, all else is; empty: it is, or there is none
  /// @throws files::ContentError  nothing is kept; it may be tried again
  std::string end(const std::string& attempt, const AttemptEnd& end);

  /// An attempt made elsewhere, as a whole: its recording has the numbers. @param end  with its recording
  /// @return id. @throws files::ContentError  nothing is kept; also where the recording is here already
  std::string take_in(const AttemptStart& start, const AttemptEnd& end, std::int64_t started_ms,
                      std::int64_t ended_ms);

  /// Gives all attempts that are over to a server, with everything of them but their recordings, each all or nothing
  /// and once: killed in between, or done by two programs, it comes to the same. Nothing of an attempt stays in these
  /// files; people do. Who was enrolled here and has a name, or a pseudonym, that somebody there has is that person.
  /// Who was erased there is erased here. The server tells its record store what this one did not.
  /// @throws files::ContentError  what was handed over until then is
  HandedOver hand_over(Lab& server);
  /// Somebody of the server, known here from now on.
  Person known(const Person& of_server);
  /// A station's person here. @param id  there. Nothing: nobody yet, or erased
  std::optional<Person> of_station(const std::string& id);
  /// enrolled(), where nobody can be asked: who gives a pseudonym that is well formed is taken for its owner.
  Person enrolled_without_server(const std::string& who);

  /// In order of time. @param trainee  Person::id; empty: of all
  std::vector<AttemptRecord> attempts(const std::string& trainee = {});
  std::vector<MetricResult> metrics(const std::string& attempt);
  /// By attempt; of all where trainee is empty.
  std::map<std::string, std::vector<MetricResult>> all_metrics(const std::string& trainee = {});
  /// The same of everybody's attempts at a scenario, only the metrics of those names.
  std::map<std::string, std::vector<MetricResult>> metrics_at(const std::string& scenario_sha256,
                                                              const std::set<std::string>& names);
  /// Pseudonym of whose attempt it is. Nothing: there is none of that id.
  std::optional<std::string> taken_by(const std::string& attempt);

  /// An attempt that does not count, by a rule that was there before. @param attempt  id, or an end of one that is
  /// alone in ending so. @return its id. @throws files::ContentError
  std::string exclude(const std::string& attempt, const std::string& author, const std::string& why);

  /// Everything about a person: attempts, metrics, recordings, name; what stays is that somebody was erased.
  Erased erase(const Person& person);
  /// The same, and the numbers of attempts that are over stay as those of nobody: another pseudonym, other ids, the
  /// first attempt on 1970-01-01, no name, note, recording or reason.
  Erased make_anonymous(const Person& person);
  /// A whole copy into a folder that is not there yet; empty: backups/lab-TIME of this one. @return it
  std::filesystem::path back_up(std::filesystem::path to = {});

  /// Place of an attempt's recording.
  std::filesystem::path recording_of(const std::string& attempt) const;

  /// What somebody was asked and said. With kRecordStore refused, statements that wait go; who was never asked has
  /// none written, and what waits from before there was the question is held back until this.
  /// @throws files::ContentError  there is no such purpose
  void set_consent(const std::string& trainee, const std::string& purpose, bool given);
  /// The last word on each purpose.
  std::vector<Consent> consents(const std::string& trainee);
  bool consents_to(const std::string& trainee, const std::string& purpose);
  /// Who was never asked neither consents nor refuses.
  bool refuses(const std::string& trainee, const std::string& purpose);
  /// kRetentionDays; none: no time is set.
  std::optional<std::int64_t> retention_days();
  /// Whose last attempt (or, without one, enrolment) is longer ago than that; nobody where it is not set.
  std::vector<PersonSummary> overdue();

  /// @param hash  in place of an earlier one; empty: no PIN any more
  void set_pin(const std::string& trainee, const std::string& hash);
  /// None: the name is enough.
  std::optional<Pin> pin(const std::string& trainee);
  /// Each wrong try in a row doubles the wait from a second, up to kLongestPinWaitMs, also over restarts.
  void pin_tried(const std::string& trainee, bool right);

  /// @param hash  of the password; in place of an earlier one
  void set_instructor(const std::string& name, const std::string& hash);
  /// Hash of the password. Nothing: nobody of that name.
  std::optional<std::string> instructor(const std::string& name);
  bool has_instructors();
  /// @param trainee  Person::id. @throws files::ContentError  empty or beyond kLongestNote
  void add_note(const std::string& trainee, const std::string& author, const std::string& body);
  /// In order of time.
  std::vector<Note> notes(const std::string& trainee);

  /// Of the lab, "xapi.endpoint"; empty: it is not set.
  std::string setting(const std::string& name);
  /// @param value  empty: not set
  void set(const std::string& name, const std::string& value);

  /// Notes that somebody looked or took away: "export", "show".
  /// @param who  empty: the user of this computer
  void note(const std::string& what, const std::string& object, const std::string& who = {});

private:
  std::string station();
  /// people() without numbers.
  std::vector<PersonSummary> listed();
  /// Why attempts do not count, by attempt; empty: it counts again.
  std::map<std::string, std::string> exclusions();
  /// Second columns by first ones.
  std::map<std::string, std::string> words(const std::string& sql);
  std::filesystem::path running_folder() const;
  std::vector<std::string> perhaps_cut_off();
  /// Within a transaction. @return id here of a station's person; empty: erased here
  std::string joined(Lab& from, const Person& person, HandedOver& done);
  void hand_over_person(Lab& server, const Person& person, HandedOver& done);
  void hand_over_attempt(Lab& server, const Person& person, const std::string& attempt, HandedOver& done);
  void adopt_crashed();
  void sweep_locks();
  void sweep_erased();
  void forget_erased_names();
  void refuse_slip(const std::string& who);
  void forget_name(const std::string& pseudonym);
  Erased take_away(const Person& person, bool keep_numbers);
  std::optional<bool> last_word(const std::string& trainee, const std::string& purpose);
  /// What waits of somebody is not told any more. Within a transaction.
  void take_back_statements(const std::string& trainee);
  void keep_numbers_of_nobody(const std::string& trainee, std::int64_t now);
  void write_beginning(const std::string& attempt, std::int64_t now, const std::string& of_station,
                       const AttemptStart& start, bool tell);
  /// Statements for a record store, where there is one (kHomePage is set) and the trainee consents; within the
  /// transaction of what they tell.
  void tell_beginning(const std::string& attempt);
  void tell_end(const std::string& attempt);
  void lock_running(const std::string& attempt);
  void unlock_running(const std::string& attempt);
  struct KeptRecording {
    std::optional<std::int64_t> bytes{};
    std::string sha256{};
  };
  /// All or nothing.
  void write_end(const std::string& attempt, const AttemptEnd& end, const KeptRecording& recording,
                 std::int64_t ended_ms, const std::string& mode);
  void keep_subject(const char* table, const Subject& subject);
  KeptRecording keep_recording(const std::string& attempt, const std::filesystem::path& recording);

  LabSettings settings_;
  std::unique_ptr<Database> opened_;
  Database& database_;  ///< that
  Roster roster_;
  std::map<std::string, int> running_;  ///< locked files of attempts under way
};

}  // namespace stylet::lab::store
