// A picture in memory, and how it gets to disk.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <vector>

namespace stylet::session {

/// 8-bit RGBA, rows from the top, no padding; not premultiplied.
struct RgbaImage {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> pixels;  ///< [4 * width * height]

  RgbaImage() = default;
  RgbaImage(int w, int h)
      : width(w), height(h), pixels(4 * static_cast<std::size_t>(w) * static_cast<std::size_t>(h)) {}
  std::uint8_t* at(int x, int y) { return &pixels[4 * (static_cast<std::size_t>(y) * width + x)]; }
  const std::uint8_t* at(int x, int y) const { return &pixels[4 * (static_cast<std::size_t>(y) * width + x)]; }
};

/// Writes a PNG (8-bit RGBA). A file that could not be written whole is removed.
/// @param rgba  [4 * width * height]
/// @throws content::ContentError  when the file cannot be written
void write_png(const std::filesystem::path& path, int width, int height, std::span<const std::uint8_t> rgba);
void write_png(const std::filesystem::path& path, const RgbaImage& image);

}  // namespace stylet::session
