#include "engine/files/dataset_folder.h"

#include "engine/files/crc32c.h"
#include "engine/files/error.h"

#include <unistd.h>

#include <fmt/format.h>

#include <array>
#include <fstream>
#include <iterator>
#include <optional>
#include <span>
#include <system_error>

namespace stylet::files {

namespace fs = std::filesystem;

namespace {

std::optional<std::string> read(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  if (!file) return {};
  return std::string{std::istreambuf_iterator<char>(file), {}};
}

std::string checksum(const std::string& bytes) {
  return fmt::format("{:08x}", crc32c({reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()}));
}

std::string about_name(std::uint64_t frame) {
  return fmt::format("frame_{:06}.json", frame);
}

/// Distinguished by machine and process: several may write the manifest at once.
std::string partial_suffix() {
  std::array<char, 256> host{};
  ::gethostname(host.data(), host.size() - 1);
  return fmt::format(".partial-{}-{}", host.data(), ::getpid());
}

}  // namespace

DatasetFolder::DatasetFolder(fs::path folder, const nlohmann::ordered_json& manifest) : folder_(std::move(folder)) {
  std::error_code error;
  fs::create_directories(folder_, error);
  if (error) {
    throw files::ContentError(
        fmt::format("{}: cannot be made ({}); choose another folder with --out", folder_.string(), error.message()));
  }
  const fs::path file = folder_ / "manifest.json";
  if (const auto there = read(file)) {
    const nlohmann::ordered_json old = nlohmann::ordered_json::parse(*there, nullptr, false);
    if (old == manifest) return;
    std::string what = "is not one of data sets";
    if (old.is_object() && old.value("format", nlohmann::ordered_json()) == manifest["format"]) {
      what = "is that of another data set";
      for (const auto& [key, value] : manifest.items()) {
        if (!old.contains(key) || old[key] != value) {
          what += fmt::format(" (\"{}\" differs)", key);
          break;
        }
      }
    }
    throw files::ContentError(
        fmt::format("{}: {}; give the same scenario, options and program again, or another folder with --out",
                    file.string(), what));
  }
  write("manifest.json", manifest.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
}

void DatasetFolder::write(const std::string& name, const std::string& bytes) const {
  const fs::path partial = folder_ / ("." + name + partial_suffix());
  std::ofstream file(partial, std::ios::binary);
  const bool written =
      static_cast<bool>(file.write(bytes.data(), static_cast<std::streamsize>(bytes.size())).flush());
  file.close();
  std::error_code error;
  if (written) fs::rename(partial, folder_ / name, error);
  if (!written || error) {
    std::error_code ignored;
    fs::remove(partial, ignored);
    throw files::ContentError(fmt::format("{}: cannot be written; is the disk full?", (folder_ / name).string()));
  }
}

bool DatasetFolder::whole(std::uint64_t frame) const {
  const auto text = read(folder_ / about_name(frame));
  if (!text) return false;
  const nlohmann::json about = nlohmann::json::parse(*text, nullptr, false);
  if (!about.is_object() || !about.contains("files") || !about["files"].is_object()) return false;
  for (const auto& [kind, file] : about["files"].items()) {
    if (!file.is_object() || !file.value("name", nlohmann::json()).is_string()) return false;
    const auto bytes = read(folder_ / file["name"].get<std::string>());
    if (!bytes || file.value("crc32c", nlohmann::json()) != checksum(*bytes)) return false;
  }
  return true;
}

void DatasetFolder::put(std::uint64_t frame, const std::vector<FrameFile>& files,
                        nlohmann::ordered_json about) const {
  // First away with what says that the frame is there.
  std::error_code ignored;
  fs::remove(folder_ / about_name(frame), ignored);
  for (const FrameFile& file : files) {
    const std::string name = fmt::format("{}_{:06}.png", file.name, frame);
    write(name, file.bytes);
    about["files"][file.name] = {{"name", name}, {"crc32c", checksum(file.bytes)}};
  }
  write(about_name(frame), about.dump(1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n");
}

std::uint64_t DatasetFolder::count(std::uint64_t end) const {
  std::uint64_t found = 0;
  for (std::uint64_t frame = 0; frame < end; ++frame) {
    std::error_code ignored;
    found += fs::exists(folder_ / about_name(frame), ignored) ? 1 : 0;
  }
  return found;
}

}  // namespace stylet::files
