#include "engine/view/offscreen.h"

namespace stylet::view {

picture::Picture read_picture(gpu::Device& device, const gpu::Image& image, std::uint32_t layer) {
  if (image.format() != VK_FORMAT_R8G8B8A8_SRGB && image.format() != VK_FORMAT_R8G8B8A8_UNORM)
    throw gpu::GpuError("view::read_picture: image format " + std::to_string(image.format()) +
                        " is not RGBA of 8 bits; convert it first");
  picture::Picture picture;
  picture.width = static_cast<int>(image.extent().width);
  picture.height = static_cast<int>(image.extent().height);
  picture.rgba = gpu::read_back<std::uint8_t>(device, image, layer);
  return picture;
}

}  // namespace stylet::view
