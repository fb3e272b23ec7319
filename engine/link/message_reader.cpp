#include "engine/link/message_reader.h"

#include <igtl_header.h>
#include <igtl_tdata.h>
#include <igtl_transform.h>
#include <igtl_util.h>

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <optional>
#include <string_view>

namespace stylet::link {
namespace {

constexpr std::size_t kExtendedHeader = 12;  // of version 2, at least
constexpr std::string_view kCommandDevice = "CMD_";

// COMMAND: number, name, encoding and length of the text. Debian's library has no igtl_command.h.
constexpr std::size_t kCommandName = 128;
constexpr std::size_t kCommandHeader = 4 + kCommandName + 2 + 4;
constexpr std::size_t kStringHeader = 4;  // encoding and length

std::uint64_t big_endian(std::span<const std::uint8_t> bytes) {
  std::uint64_t value = 0;
  for (const std::uint8_t byte : bytes) value = value << 8 | byte;
  return value;
}

/// Text of a field: up to its first zero.
std::string text_of(std::span<const char> field) {
  return {field.begin(), std::ranges::find(field, '\0')};
}

/// Capitals, digits and underscores, then zeros.
bool is_type(std::span<const char> field) {
  const auto zero = std::ranges::find(field, '\0');
  return zero != field.begin() && std::all_of(zero, field.end(), [](char c) { return c == '\0'; }) &&
         std::all_of(field.begin(), zero,
                     [](char c) { return (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_'; });
}

std::string text_of(std::span<const std::uint8_t> field) {
  return {field.begin(), std::ranges::find(field, '\0')};
}

Eigen::Matrix4d matrix_of(std::span<const std::uint8_t> bytes) {
  std::array<igtl_float32, 12> numbers{};
  std::memcpy(numbers.data(), bytes.data(), IGTL_TRANSFORM_SIZE);
  igtl_transform_convert_byte_order(numbers.data());
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  for (int column = 0; column < 4; ++column) {
    for (int row = 0; row < 3; ++row) {
      matrix(row, column) = double(numbers[3 * column + row]);
    }
  }
  return matrix;
}

/// What a version 2 body holds between its extended header and its meta data.
std::optional<std::span<const std::uint8_t>> content_of(std::span<const std::uint8_t> body) {
  if (body.size() < kExtendedHeader) return {};
  const std::uint64_t before = big_endian(body.first(2));
  const std::uint64_t behind = big_endian(body.subspan(2, 2)) + big_endian(body.subspan(4, 4));
  if (before < kExtendedHeader || before + behind > body.size()) return {};
  return body.subspan(before, body.size() - before - behind);
}

}  // namespace

bool MessageReader::refuse(std::string problem) {
  problem_ = std::move(problem);
  return false;
}

bool MessageReader::is_taken() const {
  return type_ == "TRANSFORM" || type_ == "TDATA" || type_ == "COMMAND" ||
         (type_ == "STRING" && device_.starts_with(kCommandDevice));
}

bool MessageReader::begin() {
  igtl_header header;
  std::memcpy(&header, held_.data(), IGTL_HEADER_SIZE);
  igtl_header_convert_byte_order(&header);
  if (header.version != 1 && header.version != 2) {
    return refuse(fmt::format("a header of version {}, which is no OpenIGTLink of today", header.version));
  }
  if (!is_type(header.name)) return refuse("a header without a message type");
  type_ = text_of(header.name);
  device_ = text_of(header.device_name);
  version_ = header.version;
  body_size_ = header.body_size;
  expected_sum_ = header.crc;
  if (body_size_ > (is_taken() ? std::uint64_t(kLongestTaken) : kLongestPassedOver)) {
    return refuse(fmt::format("a {} message of {} bytes", type_, body_size_));
  }
  sum_ = 0;
  got_ = 0;
  passing_ = true;
  held_.clear();
  return true;
}

bool MessageReader::read(std::vector<ReceivedTransform>& out) {
  std::span<const std::uint8_t> content(held_);
  if (version_ == 2) {
    const auto inner = content_of(content);
    if (!inner) return refuse(fmt::format("a {} message whose extended header does not fit it", type_));
    content = *inner;
  }
  const bool command = type_ == "COMMAND" || type_ == "STRING";
  return command ? read_command(content) : read_transforms(content, out);
}

bool MessageReader::read_command(std::span<const std::uint8_t> content) {
  const bool numbered = type_ == "COMMAND";
  const std::size_t header = numbered ? kCommandHeader : kStringHeader;
  const std::size_t length_bytes = numbered ? 4 : 2;
  const bool complete = content.size() >= header &&
                        big_endian(content.subspan(header - length_bytes, length_bytes)) <= content.size() - header;
  if (!complete) return refuse(fmt::format("a {} message that is shorter than its text", type_));
  if (commands_.size() == kMostCommands) return true;
  const std::uint64_t length = big_endian(content.subspan(header - length_bytes, length_bytes));
  ReceivedCommand command{.numbered = numbered, .device = device_, .text = text_of(content.subspan(header, length))};
  if (numbered) {
    command.id = static_cast<std::uint32_t>(big_endian(content.first(4)));
    command.name = text_of(content.subspan(4, kCommandName));
  }
  commands_.push_back(std::move(command));
  return true;
}

bool MessageReader::read_transforms(std::span<const std::uint8_t> content, std::vector<ReceivedTransform>& out) {
  const bool single = type_ == "TRANSFORM";
  const std::size_t element = single ? IGTL_TRANSFORM_SIZE : IGTL_TDATA_ELEMENT_SIZE;
  if (content.size() % element != 0 || (single && content.size() != element)) {
    return refuse(fmt::format("a {} message of {} bytes", type_, content.size()));
  }
  for (; !content.empty(); content = content.subspan(element)) {
    if (single) {
      out.push_back({.name = device_, .matrix = matrix_of(content)});
      continue;
    }
    igtl_tdata_element tool;
    std::memcpy(&tool, content.data(), element);
    out.push_back({.name = text_of(tool.name), .matrix = matrix_of(content.subspan(element - IGTL_TRANSFORM_SIZE))});
  }
  return true;
}

bool MessageReader::finish(std::vector<ReceivedTransform>& out) {
  if (sum_ != expected_sum_) return refuse(fmt::format("a {} message with a wrong check sum", type_));
  if (is_taken() && !read(out)) return false;
  ++messages_;
  passing_ = false;
  held_.clear();
  return true;
}

bool MessageReader::take(std::span<const std::uint8_t> bytes, std::vector<ReceivedTransform>& out) {
  while (problem_.empty()) {
    if (!passing_) {
      const std::size_t part = std::min(bytes.size(), IGTL_HEADER_SIZE - held_.size());
      held_.insert(held_.end(), bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(part));
      bytes = bytes.subspan(part);
      if (held_.size() < IGTL_HEADER_SIZE) return true;
      if (!begin()) return false;
    }
    const auto part = static_cast<std::size_t>(std::min<std::uint64_t>(bytes.size(), body_size_ - got_));
    const std::span<const std::uint8_t> body = bytes.first(part);
    // The library's prototype has forgotten that it only reads.
    sum_ = crc64(const_cast<unsigned char*>(body.data()), part, sum_);
    if (is_taken()) held_.insert(held_.end(), body.begin(), body.end());
    got_ += part;
    bytes = bytes.subspan(part);
    if (got_ < body_size_) return true;
    if (!finish(out)) return false;
  }
  return false;
}

}  // namespace stylet::link
