// From an image on the GPU to a picture in host memory.
#pragma once

#include "engine/gpu/commands.h"
#include "engine/picture/picture.h"

namespace stylet::view {

/// One layer of an image of format R8G8B8A8 (sRGB or UNORM: the bytes are taken as they are); waits for the GPU.
/// @throws gpu::GpuError for another format
picture::Picture read_picture(gpu::Device& device, const gpu::Image& image, std::uint32_t layer = 0);

}  // namespace stylet::view
