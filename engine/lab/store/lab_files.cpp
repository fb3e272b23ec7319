#include "engine/lab/store/lab_files.h"

#include "engine/files/error.h"

#include <fcntl.h>
#include <unistd.h>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include <ctime>
#include <system_error>

namespace stylet::lab::store {

namespace fs = std::filesystem;

fs::path private_folder(fs::path folder) {
  std::error_code error;
  const bool made = fs::create_directories(folder, error);
  if (made) fs::permissions(folder, fs::perms::owner_all, error);
  if (error) {
    throw files::ContentError(fmt::format("{}: the lab's records cannot be kept there ({}); name another folder",
                                          folder.string(), error.message()));
  }
  return folder;
}

void sync(const fs::path& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  if (file < 0) return;
  ::fsync(file);
  ::close(file);
}

std::string time_name(std::int64_t ms) {
  return fmt::format("{:%Y%m%dT%H%M%SZ}", fmt::gmtime(static_cast<std::time_t>(ms / 1000)));
}

fs::path unfinished(const fs::path& recording) {
  return recording.string() + ".part";
}

bool remove_recording(const fs::path& recording) {
  std::error_code error;
  const bool part = fs::remove(unfinished(recording), error);
  return fs::remove(recording, error) || part;
}

}  // namespace stylet::lab::store
