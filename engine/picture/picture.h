// A finished frame in host memory, and PNG files.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace stylet::picture {

/// sRGB colour with straight alpha, 8 bits a channel: R, G, B, A; rows from the top.
struct Picture {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgba;  ///< [height][width][4]

  Picture() = default;
  Picture(int w, int h, std::array<std::uint8_t, 4> fill = {0, 0, 0, 255});
  /// The four channels of a pixel; 0 <= x < width, 0 <= y < height.
  std::uint8_t* at(int x, int y) { return &rgba[(static_cast<std::size_t>(y) * width + x) * 4]; }
  const std::uint8_t* at(int x, int y) const { return &rgba[(static_cast<std::size_t>(y) * width + x) * 4]; }
};

/// Throws std::runtime_error "FILE: cannot write PNG; ..." if the file cannot be written.
void write_png(const std::filesystem::path& file, const Picture& picture);
/// Throws std::runtime_error if the file is missing or no PNG.
Picture read_png(const std::filesystem::path& file);

}  // namespace stylet::picture
