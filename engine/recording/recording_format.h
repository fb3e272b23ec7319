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
inline constexpr std::size_t kMaxPayload = 512;
inline constexpr std::size_t kMaxRecord = kFrontBytes + kMaxPayload + kChecksumBytes;

/// Payloads of fixed size; an event is 2 numbers, 2 lengths and its texts.
inline constexpr std::size_t kHapticStepBytes = 8 + 8 + 8 + 7 * 8 + 4 + 1 + 8;
inline constexpr std::size_t kSimulationStepBytes = 8 + 8 + 8 + 1 + 1 + 8 + 7 * 8;
inline constexpr std::size_t kHashBytes = 1 + 1 + 8 + 8;
inline constexpr std::size_t kMinEventBytes = 8 + 8 + 2 + 2;
inline constexpr std::size_t kEndBytes = 8 + 8 + 8;
static_assert(kMinEventBytes + 2 * kMaxEventText <= kMaxPayload);

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
  /// Fills in length and checksum.
  std::span<const std::uint8_t> finish() {
    const auto length = static_cast<std::uint32_t>(size_ - kFrontBytes);
    std::memcpy(&bytes_[1], &length, sizeof length);
    put(files::crc32c({bytes_.data(), size_}));
    return {bytes_.data(), size_};
  }

private:
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
  /// Everything was there, sensible, and nothing is left.
  bool finished() const { return ok_ && bytes_.empty(); }

private:
  std::span<const std::uint8_t> bytes_;
  bool ok_ = true;
};

}  // namespace stylet::recording::format
