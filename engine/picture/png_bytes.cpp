#include "engine/picture/png_bytes.h"

#include <zlib.h>

#include <cassert>
#include <stdexcept>
#include <string_view>

namespace stylet::picture {
namespace {

void put_big_endian(std::string& bytes, std::uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(value >> shift);
}

void put_chunk(std::string& file, std::string_view type, std::string_view content) {
  put_big_endian(file, static_cast<std::uint32_t>(content.size()));
  const std::size_t start = file.size();
  file += type;
  file += content;
  put_big_endian(file, static_cast<std::uint32_t>(
                           crc32(0, reinterpret_cast<const Bytef*>(file.data() + start), uInt(file.size() - start))));
}

/// @param rows  each with a leading 0, the filter that does nothing: speckle is noise and labels are flat
std::string encode(int width, int height, int bits, int colour_type, const std::string& rows) {
  std::string header;
  put_big_endian(header, static_cast<std::uint32_t>(width));
  put_big_endian(header, static_cast<std::uint32_t>(height));
  header += {static_cast<char>(bits), static_cast<char>(colour_type), 0, 0, 0};
  std::string packed(compressBound(uLong(rows.size())), '\0');
  uLongf size = uLongf(packed.size());
  if (compress2(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(rows.data()),
                uLong(rows.size()), Z_DEFAULT_COMPRESSION) != Z_OK) {
    throw std::runtime_error("zlib cannot compress a picture; out of memory?");
  }
  packed.resize(size);
  std::string file = "\x89PNG\r\n\x1a\n";
  put_chunk(file, "IHDR", header);
  put_chunk(file, "IDAT", packed);
  put_chunk(file, "IEND", {});
  return file;
}

}  // namespace

std::string png_bytes(int width, int height, std::span<const std::uint8_t> grey) {
  assert(grey.size() == static_cast<std::size_t>(width) * height);
  std::string rows;
  rows.reserve(grey.size() + static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y) {
    rows += '\0';
    rows.append(reinterpret_cast<const char*>(grey.data()) + static_cast<std::size_t>(y) * width,
                static_cast<std::size_t>(width));
  }
  return encode(width, height, 8, 0, rows);
}

std::string png_bytes(int width, int height, std::span<const std::uint16_t> grey) {
  assert(grey.size() == static_cast<std::size_t>(width) * height);
  std::string rows;
  rows.reserve(2 * grey.size() + static_cast<std::size_t>(height));
  for (std::size_t i = 0; i < grey.size(); ++i) {
    if (i % static_cast<std::size_t>(width) == 0) rows += '\0';
    rows += static_cast<char>(grey[i] >> 8);
    rows += static_cast<char>(grey[i] & 0xFF);
  }
  return encode(width, height, 16, 0, rows);
}

std::string png_bytes(const Picture& picture) {
  std::string rows;
  rows.reserve(3 * picture.rgba.size() / 4 + static_cast<std::size_t>(picture.height));
  for (int y = 0; y < picture.height; ++y) {
    rows += '\0';
    for (int x = 0; x < picture.width; ++x) rows.append(reinterpret_cast<const char*>(picture.at(x, y)), 3);
  }
  return encode(picture.width, picture.height, 8, 2, rows);
}

}  // namespace stylet::picture
