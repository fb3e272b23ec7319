#include "engine/session/output_directory.h"

#include "engine/content/error.h"

#include <unistd.h>

#include <fmt/format.h>

#include <system_error>

namespace stylet::session {

namespace fs = std::filesystem;

namespace {
[[noreturn]] void refuse(const fs::path& path, const std::string& reason) {
  throw content::ContentError(
      fmt::format("{}: cannot write results here ({}); choose another folder with --out", path.string(), reason));
}
}  // namespace

OutputDirectory::OutputDirectory(fs::path destination) : destination_(std::move(destination)) {
  if (destination_.empty()) destination_ = ".";
  destination_ = fs::absolute(destination_).lexically_normal();
  if (!destination_.has_filename()) destination_ = destination_.parent_path();
  std::error_code error;
  if (fs::exists(destination_, error) && !fs::is_directory(destination_, error)) {
    refuse(destination_, "it is not a folder");
  }
  fs::create_directories(destination_.parent_path(), error);
  if (error) refuse(destination_, error.message());
  staging_ = destination_.parent_path() / fmt::format(".{}.partial-{}", destination_.filename().string(), ::getpid());
  fs::remove_all(staging_, error);
  fs::create_directory(staging_, error);
  if (error) refuse(destination_, error.message());
}

OutputDirectory::~OutputDirectory() {
  std::error_code ignored;
  if (!staging_.empty()) fs::remove_all(staging_, ignored);
}

void OutputDirectory::commit() {
  std::error_code error;
  fs::create_directories(destination_, error);
  for (const auto& entry : fs::directory_iterator(staging_)) {
    const fs::path to = destination_ / entry.path().filename();
    if (entry.is_directory()) fs::remove_all(to, error);  // rename() does not replace a folder that is not empty
    fs::rename(entry.path(), to, error);
    if (error) refuse(to, error.message());
  }
  fs::remove_all(staging_, error);
  staging_.clear();
}

}  // namespace stylet::session
