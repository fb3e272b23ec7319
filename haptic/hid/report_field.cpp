#include "haptic/hid/report_field.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

namespace stylet::haptic::hid {
namespace {

/// A nibble of the unit: two's complement.
std::int8_t nibble(std::uint32_t unit, int index) {
  return static_cast<std::int8_t>(static_cast<int>((unit >> (4 * index) & 0xF) ^ 8) - 8);
}

constexpr std::uint32_t kWidest = 32;

}  // namespace

std::optional<SiUnit> si_unit(std::uint32_t unit, std::int32_t exponent) {
  if (exponent < -16 || exponent > 16) return {};
  const double power = std::pow(10.0, exponent);
  if (unit == 0) return SiUnit{.factor = power};
  const std::uint32_t system = unit & 0xF;
  if (system < 1 || system > 4) return {};
  const bool rotation = system == 2 || system == 4;
  const bool english = system >= 3;
  const std::int8_t length = nibble(unit, 1);
  SiUnit si{.dimension = {.mass = nibble(unit, 2), .time = nibble(unit, 3)}, .factor = power};
  (rotation ? si.dimension.angle : si.dimension.length) = length;
  si.dimension.other = (unit >> 16) != 0;
  if (rotation) {
    if (english) si.factor *= std::pow(std::numbers::pi / 180, length);
  } else {
    si.factor *= std::pow(english ? 0.0254 : 0.01, length);
  }
  si.factor *= std::pow(english ? 14.593902937 : 1e-3, si.dimension.mass);  // slug, gram
  return si;
}

std::int64_t Conversion::logical(double physical) const {
  const double value = std::round((physical - offset) / scale);
  return std::abs(value) < 9007199254740992.0 ? static_cast<std::int64_t>(value) : 0;
}

Conversion conversion_of(const Field& field) {
  const SiUnit unit = si_unit(field.unit, field.unit_exponent).value_or(SiUnit{});
  Conversion conversion{.dimension = unit.dimension, .scale = unit.factor};
  const bool same = field.physical_min == 0 && field.physical_max == 0;
  if (same || field.logical_min == field.logical_max) return conversion;
  const double logical_span = static_cast<double>(field.logical_max - field.logical_min);
  const double physical_span = static_cast<double>(field.physical_max - field.physical_min);
  conversion.scale = unit.factor * physical_span / logical_span;
  conversion.offset = unit.factor * static_cast<double>(field.physical_min) -
                      conversion.scale * static_cast<double>(field.logical_min);
  return conversion;
}

std::int64_t extract(std::span<const std::uint8_t> data, const Field& field, std::uint32_t index) {
  const std::uint32_t width = std::min(field.bit_size, kWidest);
  const std::size_t first = field.bit_offset + static_cast<std::size_t>(index) * field.bit_size;
  std::uint64_t bits = 0;
  // 32 bits at any alignment lie in five bytes.
  for (std::size_t k = 0; k < 5; ++k) {
    const std::size_t byte = first / 8 + k;
    if (byte < data.size()) bits |= static_cast<std::uint64_t>(data[byte]) << (8 * k);
  }
  bits = bits >> (first % 8) & ((std::uint64_t{1} << width) - 1);
  if (field.logical_min >= 0 || width == 0) return static_cast<std::int64_t>(bits);
  const std::uint64_t sign = std::uint64_t{1} << (width - 1);
  return static_cast<std::int64_t>(bits ^ sign) - static_cast<std::int64_t>(sign);
}

void insert(std::span<std::uint8_t> data, const Field& field, std::int64_t value, std::uint32_t index) {
  const std::uint64_t bits = static_cast<std::uint64_t>(value) & 0xFFFFFFFFU;
  const std::size_t first = field.bit_offset + static_cast<std::size_t>(index) * field.bit_size;
  for (std::uint32_t k = 0; k < field.bit_size;) {
    const std::size_t at = first + k;
    const std::uint32_t take = std::min<std::uint32_t>(8 - at % 8, field.bit_size - k);
    if (at / 8 >= data.size()) return;
    const std::uint64_t part = k < kWidest ? bits >> k : 0;
    const auto mask = static_cast<std::uint8_t>(((1U << take) - 1) << (at % 8));
    data[at / 8] =
        static_cast<std::uint8_t>((data[at / 8] & ~mask) | (static_cast<std::uint32_t>(part << (at % 8)) & mask));
    k += take;
  }
}

}  // namespace stylet::haptic::hid
