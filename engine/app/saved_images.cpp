#include "engine/app/saved_images.h"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <string>
#include <system_error>
#include <utility>

namespace stylet::app {
namespace {

constexpr std::uintmax_t kMostBytes = 8 << 20;  // of an image: a few times those of noise

/// Empty: there is none, or nothing that could be one.
std::string image_file(const std::filesystem::path& path) {
  std::error_code error;
  if (!std::filesystem::is_regular_file(path, error) || std::filesystem::file_size(path, error) > kMostBytes)
    return {};
  std::ifstream file(path, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(file), {}};
  return bytes.starts_with("\x89PNG") ? bytes : "";
}

std::string caption_of(const nlohmann::json& distances) {
  std::string caption;
  if (!distances.is_array()) return caption;
  for (const nlohmann::json& distance : distances) {
    if (distance.is_number())
      caption += fmt::format("{}{:.1f} mm", caption.empty() ? "measured " : ", ", distance.get<double>() * 1e3);
  }
  return caption;
}

}  // namespace

void write_images(const scanner::SavedImages& saved, const files::OutputDirectory& out) {
  for (std::size_t i = 0; i < saved.size(); ++i) out.write(scanner::saved_image_name(i + 1), saved[i].png);
}

std::vector<session::SavedImageFacts> facts_of(const scanner::SavedImages& saved) {
  std::vector<session::SavedImageFacts> facts;
  for (const scanner::SavedImage& image : saved) {
    facts.push_back({.file = scanner::saved_image_name(facts.size() + 1),
                     .time_s = image.time_s,
                     .depth = image.depth,
                     .metres_per_pixel = image.metres_per_pixel,
                     .distances = image.distances});
  }
  return facts;
}

std::vector<debrief::DebriefPicture> saved_pictures(const std::filesystem::path& folder) {
  std::vector<debrief::DebriefPicture> pictures;
  std::ifstream file(folder / "session.json");
  const nlohmann::json numbers = nlohmann::json::parse(file, nullptr, false);
  if (!numbers.is_object() || !numbers.contains("saved_images") || !numbers["saved_images"].is_array())
    return pictures;
  const nlohmann::json& list = numbers["saved_images"];
  for (std::size_t i = 0; i < std::min(list.size(), scanner::kMostSavedImages); ++i) {
    std::string png = image_file(folder / scanner::saved_image_name(i + 1));
    const nlohmann::json& facts = list[i];
    if (png.empty() || !facts.is_object() || !facts.contains("time_s") || !facts["time_s"].is_number()) continue;
    pictures.push_back({.time_s = facts["time_s"].get<double>(),
                        .title = fmt::format("Saved image {}", i + 1),
                        .caption = facts.contains("distances_m") ? caption_of(facts["distances_m"]) : "",
                        .png = std::move(png)});
  }
  return pictures;
}

}  // namespace stylet::app
