// The bytes of a recording (recording.h): what reader and writer share.
#pragma once

#include "engine/files/crc32c.h"
#include "engine/recording/recording.h"

#include <algorithm>
#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>

namespace stylet::recording::format {

static_assert(std::endian::native == std::endian::little, "recordings are little-endian");

/// As PNG: a high bit, a name, and a line end that a text-mode copy would change.
inline constexpr std::array<std::uint8_t, 8> kMagic{0x89, 'S', 'T', 'Y', 'R', 'E', 'C', '\n'};

enum class RecordType : std::uint8_t { haptic_step = 1, simulation_step = 2, hash = 3, event = 4, end = 5 };

inline constexpr std::size_t kFrontBytes = 5;  // type, length
inline constexpr std::size_t kChecksumBytes = 4;
inline constexpr std::size_t kMaxPayload = 4096;
inline constexpr std::size_t kMaxRecord = kFrontBytes + kMaxPayload + kChecksumBytes;

/// Payloads of fixed size; an event is longer by its texts and fields.
inline constexpr std::size_t kHapticStepBytes = 8 + 8 + 8 + 7 * 8 + 4 + 1 + 8;
inline constexpr std::size_t kSimulationStepBytes1 = 8 + 8 + 8 + 1 + 1 + 8 + 7 * 8;  // of version 1
inline constexpr std::size_t kSimulationStepBytes2 = kSimulationStepBytes1 + 8 * physics::kMaxCavities;
inline constexpr std::size_t kSimulationStepBytes = kSimulationStepBytes2 + 8;  // cavities, breath
inline constexpr std::size_t kHashBytes = 1 + 1 + 8 + 8;
inline constexpr std::size_t kMinEventBytes = 8 + 8 + 2 + 1;  // of version 2: name and number of fields
inline constexpr std::size_t kEventBytes1 = 8 + 8 + 2 + 2;    // of version 1: name and text
inline constexpr std::size_t kEndBytes = 8 + 8 + 8;
inline constexpr std::size_t kMaxEventBytes = kMaxPayload;
static_assert(8 + 8 + 2 * (2 + kMaxEventText) <= kMaxPayload, "an event of version 1 fits");

/// What a field's value is.
enum class FieldType : std::uint8_t { quantity = 0, count = 1, word = 2 };

template <typename T>
concept Number = std::integral<T> || std::floating_point<T>;

/// Builds one record on the stack.
class RecordBytes {
public:
  explicit RecordBytes(RecordType type) { put(static_cast<std::uint8_t>(type)), put(std::uint32_t{0}); }

  template <Number T>
  void put(T value) {
    std::memcpy(&bytes_[size_], &value, sizeof value);
    size_ += sizeof value;
  }
  void put(bool value) { put(static_cast<std::uint8_t>(value ? 1 : 0)); }
  void put(const Eigen::Vector3d& v) { put(v.x()), put(v.y()), put(v.z()); }
  void put(const Eigen::Quaterniond& q) { put(q.x()), put(q.y()), put(q.z()), put(q.w()); }
  /// Cut at kMaxEventText.
  void put(std::string_view text) {
    const std::size_t length = std::min(text.size(), kMaxEventText);
    put(static_cast<std::uint16_t>(length));
    std::copy_n(text.data(), length, &bytes_[size_]);  // unlike memcpy, an empty text may have no address
    size_ += length;
  }
  /// Adds fields as long as there is room, at most kMaxEventFields.
  template <typename Fields>
  void put_fields(const Fields& fields) {
    const std::size_t count_at = size_;
    std::uint8_t count = 0;
    put(count);
    for (const auto& field : fields) {
      if (count == kMaxEventFields || size_ + field_bytes(field) > kFrontBytes + kMaxPayload) break;
      put(std::string_view(field.name));
      put(std::string_view(field.unit));
      put(static_cast<std::uint8_t>(field.value.index()));
      std::visit([this](const auto& value) { this->put_value(value); }, field.value);
      ++count;
    }
    bytes_[count_at] = count;
  }
  /// Fills in length and checksum.
  std::span<const std::uint8_t> finish() {
    const auto length = static_cast<std::uint32_t>(size_ - kFrontBytes);
    std::memcpy(&bytes_[1], &length, sizeof length);
    put(files::crc32c({bytes_.data(), size_}));
    return {bytes_.data(), size_};
  }

private:
  static std::size_t text_bytes(std::string_view text) {
    return sizeof(std::uint16_t) + std::min(text.size(), kMaxEventText);
  }
  template <typename AnyField>
  static std::size_t field_bytes(const AnyField& field) {
    const std::size_t value = std::visit([](const auto& v) { return value_bytes(v); }, field.value);
    return text_bytes(field.name) + text_bytes(field.unit) + 1 + value;
  }
  static std::size_t value_bytes(double) { return sizeof(double); }
  static std::size_t value_bytes(std::int64_t) { return sizeof(std::int64_t); }
  static std::size_t value_bytes(std::string_view text) { return text_bytes(text); }
  void put_value(double value) { put(value); }
  void put_value(std::int64_t value) { put(value); }
  void put_value(std::string_view text) { put(text); }

  std::array<std::uint8_t, kMaxRecord> bytes_;
  std::size_t size_ = 0;
};

/// Takes numbers from the front of a payload. Reading past the end gives zeros and shows in ok().
class PayloadReader {
public:
  explicit PayloadReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  template <Number T>
  T get() {
    T value{};
    if (bytes_.size() < sizeof value) {
      ok_ = false;
      return value;
    }
    std::memcpy(&value, bytes_.data(), sizeof value);
    bytes_ = bytes_.subspan(sizeof value);
    return value;
  }
  bool get_bool() {
    const auto byte = get<std::uint8_t>();
    ok_ = ok_ && byte <= 1;
    return byte == 1;
  }
  Eigen::Vector3d get_vector() {
    const double x = get<double>(), y = get<double>(), z = get<double>();
    return {x, y, z};
  }
  Eigen::Quaterniond get_quaternion() {
    const double x = get<double>(), y = get<double>(), z = get<double>(), w = get<double>();
    return {w, x, y, z};
  }
  std::string get_text() {
    const auto length = get<std::uint16_t>();
    if (length > kMaxEventText || length > bytes_.size()) {
      ok_ = false;
      return {};
    }
    std::string text(bytes_.begin(), bytes_.begin() + length);
    bytes_ = bytes_.subspan(length);
    return text;
  }
  Field get_field() {
    Field field;
    field.name = get_text();
    field.unit = get_text();
    switch (static_cast<FieldType>(get<std::uint8_t>())) {
      case FieldType::quantity:
        field.value = get<double>();
        return field;
      case FieldType::count:
        field.value = get<std::int64_t>();
        return field;
      case FieldType::word:
        field.value = get_text();
        return field;
    }
    ok_ = false;
    return field;
  }
  bool ok() const { return ok_; }
  /// Everything was there, sensible, and nothing is left.
  bool finished() const { return ok_ && bytes_.empty(); }

private:
  std::span<const std::uint8_t> bytes_;
  bool ok_ = true;
};

}  // namespace stylet::recording::format
