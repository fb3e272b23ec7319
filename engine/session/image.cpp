#include "engine/session/image.h"

#include "engine/content/error.h"

#include <fmt/core.h>
#include <stb_image_write.h>

#include <system_error>

namespace stylet::session {

void write_png(const std::filesystem::path& path, int width, int height, std::span<const std::uint8_t> rgba) {
  const std::size_t expected = 4 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  if (width <= 0 || height <= 0 || rgba.size() != expected) {
    throw content::ContentError(fmt::format("{}: a picture of {} x {} needs {} bytes, not {}", path.string(), width,
                                            height, expected, rgba.size()));
  }
  if (stbi_write_png(path.c_str(), width, height, 4, rgba.data(), 4 * width) == 0) {
    std::error_code ignored;
    std::filesystem::remove(path, ignored);
    throw content::ContentError(path.string() + ": cannot be written; check folder, permissions and space");
  }
}

void write_png(const std::filesystem::path& path, const RgbaImage& image) {
  write_png(path, image.width, image.height, image.pixels);
}

}  // namespace stylet::session
