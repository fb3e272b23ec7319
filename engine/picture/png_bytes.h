// PNG files in memory, in the kinds that data sets need: grey of 8 and 16 bits, and colour.
#pragma once

#include "engine/picture/picture.h"

#include <cstdint>
#include <span>
#include <string>

namespace stylet::picture {

/// The whole file. Rows from the top, width * height values (an assertion). The same pixels give the same bytes with
/// the same zlib.
std::string png_bytes(int width, int height, std::span<const std::uint8_t> grey);
std::string png_bytes(int width, int height, std::span<const std::uint16_t> grey);
/// Colour without alpha.
std::string png_bytes(const Picture& picture);

}  // namespace stylet::picture
