#include "engine/recording/unfinished_recording.h"

#include "engine/files/error.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <string>
#include <system_error>
#include <utility>

namespace stylet::recording {

namespace fs = std::filesystem;

namespace {
constexpr std::string_view kPrefix = "unfinished-";
constexpr std::string_view kSuffix = ".rec";
constexpr const char* kSession = "session.rec";

/// The lock of RecordingWriter goes with its process, of which a number alone would tell little: it may be a zombie,
/// or of another container.
bool is_being_written(const fs::path& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return false;
  const bool locked = ::flock(file, LOCK_SH | LOCK_NB) != 0;
  ::close(file);
  return locked;
}
}  // namespace

UnfinishedRecording::UnfinishedRecording(fs::path folder) : folder_(std::move(folder)) {
  std::error_code error;
  made_folder_ = fs::create_directories(folder_, error);
  if (error) {
    throw files::ContentError(
        fmt::format("{}: cannot write the recording here ({}); choose another folder with --out", folder_.string(),
                    error.message()));
  }
  // The time sorts by name, and keeps apart processes of the same number (each container counts from 1).
  do {
    const auto now = std::chrono::floor<std::chrono::microseconds>(std::chrono::system_clock::now());
    path_ = folder_ / fmt::format("{}{:%Y%m%dT%H%M%S}.{:06}Z-{}{}", kPrefix,
                                  fmt::gmtime(std::chrono::system_clock::to_time_t(now)),
                                  now.time_since_epoch().count() % 1'000'000, ::getpid(), kSuffix);
  } while (fs::exists(path_, error));
}

UnfinishedRecording::~UnfinishedRecording() {
  if (kept_) return;
  std::error_code ignored;
  fs::remove(path_, ignored);
  if (made_folder_) fs::remove(folder_, ignored);  // where it is empty
}

void UnfinishedRecording::finish(files::OutputDirectory& out, const fs::path& last) {
  const fs::path staged = out.staged(kSession);
  std::error_code error;
  fs::create_hard_link(path_, staged, error);
  if (error && !fs::copy_file(path_, staged, error)) {
    throw files::ContentError(fmt::format("{}: cannot be written ({}); the recording is {}",
                                          (out.destination() / kSession).string(), error.message(), path_.string()));
  }
  out.commit(last);
  fs::remove(path_, error);
  kept_ = true;
}

std::vector<fs::path> cut_off_recordings(const fs::path& folder) {
  std::vector<fs::path> found;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(kPrefix) || !name.ends_with(kSuffix)) continue;
    if (!is_being_written(entry.path())) found.push_back(entry.path());
  }
  std::ranges::sort(found, std::ranges::greater{});
  return found;
}

fs::path find_recording(const fs::path& named) {
  std::error_code error;
  if (!fs::is_directory(named, error)) {
    if (fs::exists(named, error) || named.filename() != kSession) return named;
    const std::vector<fs::path> left = cut_off_recordings(named.parent_path());
    if (left.empty()) return named;
    throw files::ContentError(fmt::format("{}: is not there, its session was cut off; give what it left: {}",
                                          named.string(), left.front().string()));
  }
  if (fs::exists(named / kSession, error)) return named / kSession;
  const std::vector<fs::path> found = cut_off_recordings(named);
  if (found.empty()) {
    throw files::ContentError(
        fmt::format("{}: holds no recording (session.rec or unfinished-*.rec); give the folder a session wrote to",
                    named.string()));
  }
  return found.front();
}

}  // namespace stylet::recording
