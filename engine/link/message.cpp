#include "engine/link/message.h"

#include <igtl_header.h>
#include <igtl_image.h>
#include <igtl_transform.h>
#include <igtl_util.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace stylet::link {
namespace {

constexpr std::uint16_t kAscii = 3;  // IANA's number of US-ASCII

/// Fixed point of the protocol: seconds in the upper 32 bits, their fraction in the lower.
std::uint64_t fixed_point(double utc_s) {
  const double whole = std::floor(utc_s);
  const auto fraction = static_cast<std::uint64_t>((utc_s - whole) * 4294967296.0);
  return static_cast<std::uint64_t>(whole) << 32 | std::min<std::uint64_t>(fraction, 0xFFFFFFFF);
}

void copy_name(std::string_view name, std::span<char> field) {
  std::copy_n(name.begin(), std::min(name.size(), field.size()), field.begin());
}

/// Rows of a transform as the protocol orders them: three columns of the rotation, then the position.
std::array<igtl_float32, 12> twelve(const Eigen::Matrix4d& matrix) {
  std::array<igtl_float32, 12> numbers{};
  for (int column = 0; column < 4; ++column) {
    for (int row = 0; row < 3; ++row) {
      numbers[3 * column + row] = static_cast<float>(matrix(row, column));
    }
  }
  return numbers;
}

void append(Bytes& out, const void* data, std::size_t size) {
  const auto* bytes = static_cast<const std::uint8_t*>(data);
  out.insert(out.end(), bytes, bytes + size);
}

/// Puts the header in the place left for it before the body, which is all that follows `start`.
void complete(Bytes& out, std::size_t start, const char* type, std::string_view device, double utc_s,
              std::uint16_t version = 1) {
  std::uint8_t* body = out.data() + start + IGTL_HEADER_SIZE;
  const std::size_t size = out.size() - start - IGTL_HEADER_SIZE;
  igtl_header header{};
  header.version = version;
  copy_name(type, header.name);
  copy_name(device, header.device_name);
  header.timestamp = fixed_point(utc_s);
  header.body_size = size;
  header.crc = crc64(body, size, 0);
  igtl_header_convert_byte_order(&header);
  std::memcpy(out.data() + start, &header, IGTL_HEADER_SIZE);
}

void append_number(Bytes& out, std::uint64_t value, std::size_t bytes) {
  while (bytes-- > 0) out.push_back(static_cast<std::uint8_t>(value >> (8 * bytes)));
}

void append(Bytes& out, std::string_view text) {
  out.insert(out.end(), text.begin(), text.end());
}

std::size_t leave_header(Bytes& out) {
  const std::size_t start = out.size();
  out.resize(start + IGTL_HEADER_SIZE);
  return start;
}

}  // namespace

void append_transform(Bytes& out, std::string_view device, double utc_s, const Eigen::Matrix4d& matrix) {
  const std::size_t start = leave_header(out);
  std::array<igtl_float32, 12> numbers = twelve(matrix);
  igtl_transform_convert_byte_order(numbers.data());
  append(out, numbers.data(), IGTL_TRANSFORM_SIZE);
  complete(out, start, "TRANSFORM", device, utc_s);
}

void append_image(Bytes& out, std::string_view device, double utc_s, const GreyImage& image) {
  const std::size_t start = leave_header(out);
  // The protocol's position is that of the middle of the image, not of its first pixel.
  Eigen::Matrix4d centred = image.reference_from_image;
  centred.col(3) =
      image.reference_from_image * Eigen::Vector4d(0.5 * (image.width - 1), 0.5 * (image.height - 1), 0, 1);
  igtl_image_header header{};
  header.version = IGTL_IMAGE_HEADER_VERSION;
  header.num_components = 1;
  header.scalar_type = IGTL_IMAGE_STYPE_TYPE_UINT8;
  header.endian = igtl_is_little_endian() != 0 ? IGTL_IMAGE_ENDIAN_LITTLE : IGTL_IMAGE_ENDIAN_BIG;
  header.coord = IGTL_IMAGE_COORD_RAS;
  const std::array<igtl_uint16, 3> size{static_cast<igtl_uint16>(image.width), static_cast<igtl_uint16>(image.height),
                                        1};
  std::ranges::copy(size, header.size);
  std::ranges::copy(size, header.subvol_size);
  const std::array<igtl_float32, 12> numbers = twelve(centred);
  std::memcpy(header.matrix, numbers.data(), sizeof header.matrix);
  igtl_image_convert_byte_order(&header);
  append(out, &header, IGTL_IMAGE_HEADER_SIZE);
  append(out, image.pixels.data(), image.pixels.size());
  complete(out, start, "IMAGE", device, utc_s);
}

void append_status(Bytes& out, std::string_view device, double utc_s, Status code, std::string_view text) {
  // 16 bits of code, 64 of sub-code, 20 bytes of error name, the text and a zero. Debian leaves igtl_status.h out.
  const std::size_t start = leave_header(out);
  append_number(out, static_cast<std::uint16_t>(code), 2);
  out.resize(out.size() + 8 + 20);
  append(out, text);
  out.push_back(0);
  complete(out, start, "STATUS", device, utc_s);
}

void append_string(Bytes& out, std::string_view device, double utc_s, std::string_view text) {
  const std::size_t start = leave_header(out);
  append_number(out, kAscii, 2);
  append_number(out, text.size(), 2);
  append(out, text);
  complete(out, start, "STRING", device, utc_s);
}

void append_command_reply(Bytes& out, std::string_view device, double utc_s, const CommandReply& reply) {
  const std::string_view key = "Status", status = reply.done ? "SUCCESS" : "FAIL";
  const std::string text = fmt::format("<Command><Result>{0}</Result><{1}>{2}</{1}></Command>", reply.done,
                                       reply.done ? "Message" : "Error", reply.words);
  const std::size_t start = leave_header(out);
  // The extended header, the content, the index of the meta data, the meta data.
  constexpr std::size_t kExtendedHeader = 12, kIndex = 2 + 8, kName = 128;
  append_number(out, kExtendedHeader, 2);
  append_number(out, kIndex, 2);
  append_number(out, key.size() + status.size(), 4);
  append_number(out, 0, 4);  // number of the message: not counted
  append_number(out, reply.id, 4);
  append(out, reply.name.substr(0, kName));
  out.resize(start + IGTL_HEADER_SIZE + kExtendedHeader + 4 + kName);
  append_number(out, kAscii, 2);
  append_number(out, text.size(), 4);
  append(out, text);
  append_number(out, 1, 2);
  append_number(out, key.size(), 2);
  append_number(out, kAscii, 2);
  append_number(out, status.size(), 4);
  append(out, key);
  append(out, status);
  complete(out, start, "RTS_COMMAND", device, utc_s, 2);
}

}  // namespace stylet::link
