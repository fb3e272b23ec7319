// What is taken away for good, and copied in time.
#include "engine/files/error.h"
#include "engine/lab/store/identity.h"
#include "engine/lab/store/lab.h"
#include "engine/lab/store/lab_files.h"

#include <fcntl.h>
#include <unistd.h>

#include <fmt/format.h>

#include <algorithm>
#include <cstdint>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

namespace stylet::lab::store {

namespace fs = std::filesystem;

namespace {

/// A folder of this object's own, gone with it unless it has been renamed.
struct OwnFolder {
  explicit OwnFolder(fs::path place) : path(private_folder(std::move(place))) {}
  ~OwnFolder() {
    std::error_code error;
    fs::remove_all(path, error);
  }
  OwnFolder(const OwnFolder&) = delete;
  OwnFolder& operator=(const OwnFolder&) = delete;
  fs::path path;
};

/// Everything that was written to the disk that the folder is on.
void sync_disk(const fs::path& folder) {
  const int file = ::open(folder.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return;
  ::syncfs(file);
  ::close(file);
}

}  // namespace

void Lab::sweep_erased() {
  for (const Row& row : database_.run("SELECT id FROM tombstone WHERE kind = 'attempt'")) {
    remove_recording(recording_of(text(row[0])));
  }
  forget_erased_names();
}

void Lab::forget_erased_names() {
  // Only whose erasure was cut off: a name without records may be of records that were lost, and is nowhere else.
  for (const Row& row : database_.run("SELECT id FROM tombstone WHERE kind = 'name'")) forget_name(text(row[0]));
}

void Lab::forget_name(const std::string& pseudonym) {
  roster_.remove(pseudonym);
  database_.run("DELETE FROM tombstone WHERE id = $1 AND kind = 'name'", {pseudonym});
}

Erased Lab::erase(const Person& person) {
  return take_away(person, false);
}

Erased Lab::make_anonymous(const Person& person) {
  return take_away(person, true);
}

Erased Lab::take_away(const Person& person, bool keep_numbers) {
  Erased erased;
  const std::int64_t now = settings_.clock();
  std::vector<std::string> ids;
  {
    Transaction transaction(database_);
    for (const Row& row : database_.run("SELECT id FROM attempt WHERE trainee = $1", {person.id})) {
      ids.push_back(text(row[0]));
      database_.run("INSERT INTO tombstone(id, kind, at_ms) VALUES ($1, 'attempt', $2)", {ids.back(), now});
    }
    if (keep_numbers) keep_numbers_of_nobody(person.id, now);
    database_.run("INSERT INTO tombstone(id, kind, at_ms) VALUES ($1, 'trainee', $2)", {person.id, now});
    // Whom stations know by another id, which they may bring again.
    database_.run("INSERT INTO tombstone(id, kind, at_ms) SELECT id, 'trainee', $1 FROM joined WHERE trainee = $2",
                  {now, person.id});
    database_.run("DELETE FROM joined WHERE trainee = $1", {person.id});
    // Goes when the name has gone.
    database_.run("INSERT INTO tombstone(id, kind, at_ms) VALUES ($1, 'name', $2) ON CONFLICT DO NOTHING",
                  {person.pseudonym, now});
    for (const char* of_attempts : {"attempt_metric", "exclusion", "outbox"}) {
      database_.run(
          fmt::format("DELETE FROM {} WHERE attempt IN (SELECT id FROM attempt WHERE trainee = $1)", of_attempts),
          {person.id});
    }
    for (const char* of_person : {"consent", "pin", "note"}) {
      database_.run(fmt::format("DELETE FROM {} WHERE trainee = $1", of_person), {person.id});
    }
    database_.run("DELETE FROM attempt WHERE trainee = $1", {person.id});
    database_.run("DELETE FROM trainee WHERE id = $1", {person.id});
    database_.run("DELETE FROM audit WHERE object = $1", {person.pseudonym});
    database_.run("INSERT INTO audit(id, at_ms, who, what, object) VALUES ($1, $2, '', 'erase', '')",
                  {new_id(now), now});
    transaction.commit();
  }
  erased.attempts = static_cast<int>(ids.size());
  std::error_code error;
  for (const std::string& id : ids) erased.recordings += remove_recording(recording_of(id)) ? 1 : 0;
  forget_name(person.pseudonym);
  database_.wipe_deleted();
  for (const auto& entry : fs::directory_iterator(settings_.folder / "backups", error)) {
    erased.backups.push_back(fs::absolute(entry.path(), error));
  }
  // Also those elsewhere, a stick that is not plugged in among them.
  for (const Row& row : database_.run("SELECT object FROM audit WHERE what = 'backup'")) {
    const fs::path elsewhere = text(row[0]);
    if (elsewhere.parent_path() != fs::absolute(settings_.folder / "backups", error)) {
      erased.backups.push_back(elsewhere);
    }
  }
  std::ranges::sort(erased.backups);
  erased.backups.erase(std::unique(erased.backups.begin(), erased.backups.end()), erased.backups.end());
  return erased;
}

fs::path Lab::back_up(fs::path to) {
  if (to.empty()) {
    to = private_folder(settings_.folder / "backups") / ("lab-" + time_name(settings_.clock()));
  }
  std::error_code error;
  if (fs::exists(to, error)) {
    throw files::ContentError(to.string() + ": is there already; name a folder that is not");
  }
  // Whole or not there: made beside its place.
  if (const fs::path part = to.string() + ".part"; fs::exists(part, error)) {
    throw files::ContentError(
        part.string() +
        ": is there already, of a backup that was cut off or of something else; take it away, or "
        "name another folder");
  }
  const OwnFolder part(to.string() + ".part");
  // On the lab's own disk first: while a database is read nobody commits to it, and a stick may take minutes.
  std::error_code ignored;
  {
    const OwnFolder own(private_folder(settings_.folder / "backups") / ("making-" + new_id(settings_.clock())));
    database_.copy_to(own.path / "lab.db");
    roster_.database().copy_to(own.path / "roster.db");
    fs::copy(own.path, part.path, fs::copy_options::recursive, error);
  }
  const fs::path recordings = settings_.folder / "recordings";
  if (!error && fs::exists(recordings, ignored)) {
    fs::copy(recordings, part.path / "recordings", fs::copy_options::recursive, error);
  }
  if (!error) sync_disk(part.path);
  if (!error) fs::rename(part.path, to, error);
  if (error) {
    throw files::ContentError(
        fmt::format("{}: cannot be written whole ({}); check folder and space", to.string(), error.message()));
  }
  sync(to.parent_path());
  note("backup", fs::absolute(to, ignored).string());
  return to;
}

}  // namespace stylet::lab::store
