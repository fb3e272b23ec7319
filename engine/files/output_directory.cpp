#include "engine/files/output_directory.h"

#include "engine/files/error.h"

#include <signal.h>
#include <unistd.h>

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstdlib>
#include <fstream>
#include <stdexcept>
#include <system_error>
#include <vector>

namespace stylet::files {

namespace fs = std::filesystem;

namespace {
[[noreturn]] void refuse(const fs::path& path, const std::string& reason) {
  throw files::ContentError(
      fmt::format("{}: cannot write results here ({}); choose another folder with --out", path.string(), reason));
}

/// Staging folders whose process is gone, or is this one.
void remove_abandoned(const fs::path& parent, const std::string& prefix) {
  std::error_code ignored;
  std::vector<fs::path> abandoned;
  for (const auto& entry : fs::directory_iterator(parent, ignored)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(prefix)) continue;
    const int process = std::atoi(name.c_str() + prefix.size());
    if (process == ::getpid() || (process > 0 && ::kill(process, 0) != 0 && errno == ESRCH)) {
      abandoned.push_back(entry.path());
    }
  }
  for (const fs::path& path : abandoned) fs::remove_all(path, ignored);
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
  if (fs::exists(destination_, error) && ::access(destination_.c_str(), W_OK | X_OK) != 0) {
    refuse(destination_, "it may not be written to");
  }
  fs::create_directories(destination_.parent_path(), error);
  if (error) refuse(destination_, error.message());
  const std::string prefix = fmt::format(".{}.partial-", destination_.filename().string());
  remove_abandoned(destination_.parent_path(), prefix);
  staging_ = destination_.parent_path() / (prefix + std::to_string(::getpid()));
  fs::create_directory(staging_, error);
  if (error) refuse(destination_, error.message());
}

OutputDirectory::~OutputDirectory() {
  std::error_code ignored;
  if (!staging_.empty()) fs::remove_all(staging_, ignored);
}

void OutputDirectory::write(const fs::path& name, std::string_view bytes) const {
  std::ofstream file(staged(name), std::ios::binary);
  if (!file.write(bytes.data(), static_cast<std::streamsize>(bytes.size())).flush()) {
    throw files::ContentError((destination_ / name).string() + ": cannot be written; is the disk full?");
  }
}

std::string OutputDirectory::in_place(std::string text) const {
  const std::string hidden = staging_.string(), shown = destination_.string();
  for (std::size_t at = text.find(hidden); at != std::string::npos; at = text.find(hidden, at + shown.size())) {
    text.replace(at, hidden.size(), shown);
  }
  return text;
}

void OutputDirectory::named_in_place(const std::function<void()>& act) const {
  try {
    act();
  } catch (const std::runtime_error& error) {
    const std::string what = in_place(error.what());
    if (what == error.what()) throw;  // of its own kind
    throw files::ContentError(what);
  }
}

void OutputDirectory::require_places(const std::vector<std::string>& names) const {
  std::error_code none;
  for (const std::string& name : names) {
    if (fs::is_directory(destination_ / name, none)) refuse(destination_ / name, "a folder of this name is there");
  }
}

void OutputDirectory::keep_only(std::initializer_list<std::string_view> names) {
  std::vector<fs::path> unwanted;
  for (const auto& entry : fs::directory_iterator(staging_)) {
    if (std::ranges::find(names, entry.path().filename().string()) == names.end()) unwanted.push_back(entry.path());
  }
  std::error_code ignored;
  for (const fs::path& path : unwanted) fs::remove_all(path, ignored);
}

void OutputDirectory::supersede(std::vector<std::string> names) {
  superseded_ = std::move(names);
}

void OutputDirectory::check_places() const {
  for (const auto& entry : fs::directory_iterator(staging_)) {
    const fs::path to = destination_ / entry.path().filename();
    std::error_code none;
    if (!fs::exists(to, none) || fs::is_directory(to, none) == entry.is_directory()) continue;
    refuse(to, entry.is_directory() ? "a file of this name is there" : "a folder of this name is there");
  }
}

void OutputDirectory::remove_superseded(const fs::path& last) {
  std::error_code error;
  const auto remove = [&](const fs::path& name) {
    const fs::path path = destination_ / name;
    if (fs::is_regular_file(fs::symlink_status(path, error))) fs::remove(path, error);
  };
  if (!last.empty()) remove(last);
  for (const fs::path name : superseded_) {
    if (name.filename() == name && !fs::exists(staging_ / name, error)) remove(name);
  }
}

void OutputDirectory::publish(const std::vector<std::string>& names) {
  std::error_code error;
  fs::create_directories(destination_, error);
  if (error) refuse(destination_, error.message());
  for (const std::string& name : names) {
    const fs::path to = destination_ / name;
    if (fs::is_directory(to, error)) refuse(to, "a folder of this name is there");
    fs::rename(staging_ / name, to, error);
    if (error) refuse(to, error.message());
  }
}

void OutputDirectory::commit(const fs::path& last) {
  std::error_code error;
  fs::create_directories(destination_, error);
  if (error) refuse(destination_, error.message());
  check_places();
  remove_superseded(last);
  const auto move = [&](const fs::path& from) {
    const fs::path to = destination_ / from.filename();
    if (fs::is_directory(from)) fs::remove_all(to, error);  // rename() does not replace a folder that is not empty
    fs::rename(from, to, error);
    if (error) refuse(to, error.message());
  };
  std::vector<fs::path> staged;
  for (const auto& entry : fs::directory_iterator(staging_)) {
    if (entry.path().filename() != last) staged.push_back(entry.path());
  }
  for (const fs::path& path : staged) move(path);
  if (fs::exists(staging_ / last) && !last.empty()) move(staging_ / last);
  fs::remove_all(staging_, error);
  staging_.clear();
}

}  // namespace stylet::files
