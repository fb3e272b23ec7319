#include "engine/picture/picture.h"

#include <stb_image.h>
#include <stb_image_write.h>

#include <memory>
#include <stdexcept>

namespace stylet::picture {

Picture::Picture(int w, int h, std::array<std::uint8_t, 4> fill)
    : width(w), height(h), rgba(static_cast<std::size_t>(w) * h * 4) {
  for (std::size_t i = 0; i < rgba.size(); ++i) rgba[i] = fill[i % 4];
}

void write_png(const std::filesystem::path& file, const Picture& picture) {
  if (stbi_write_png(file.c_str(), picture.width, picture.height, 4, picture.rgba.data(), picture.width * 4) == 0)
    throw std::runtime_error(file.string() + ": cannot write PNG; check that the folder exists and has room");
}

Picture read_png(const std::filesystem::path& file) {
  Picture picture;
  int channels = 0;
  const std::unique_ptr<stbi_uc, void (*)(void*)> pixels(
      stbi_load(file.c_str(), &picture.width, &picture.height, &channels, 4), stbi_image_free);
  if (!pixels) throw std::runtime_error(file.string() + ": cannot read PNG: " + stbi_failure_reason());
  picture.rgba.assign(pixels.get(), pixels.get() + static_cast<std::size_t>(picture.width) * picture.height * 4);
  return picture;
}

}  // namespace stylet::picture
