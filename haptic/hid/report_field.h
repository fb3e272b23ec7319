// One value of a report: bits out of bytes and into them, and what the number means in SI units.
#pragma once

#include "haptic/hid/report_descriptor.h"

#include <cstdint>
#include <optional>
#include <span>

namespace stylet::haptic::hid {

/// Exponents of the base units of a quantity. Plain angles are counted: rad and rad/s are told from 1 and 1/s.
struct Dimension {
  std::int8_t length = 0;
  std::int8_t mass = 0;
  std::int8_t time = 0;
  std::int8_t angle = 0;
  bool other = false;  ///< temperature, current or light too

  friend bool operator==(const Dimension&, const Dimension&) = default;
};

inline constexpr Dimension kNumber{};
inline constexpr Dimension kMetres{.length = 1};
inline constexpr Dimension kRadians{.angle = 1};
inline constexpr Dimension kSeconds{.time = 1};
inline constexpr Dimension kNewtons{.length = 1, .mass = 1, .time = -2};
inline constexpr Dimension kNewtonMetres{.length = 2, .mass = 1, .time = -2};

struct SiUnit {
  Dimension dimension{};
  double factor = 1;  ///< SI units in one of these
};

/// Unit and Unit Exponent (HID 1.11, 6.2.2.7). Nothing: the unit is reserved, a vendor's, or out of all proportion.
/// Without a unit it is a number, times the power of ten.
std::optional<SiUnit> si_unit(std::uint32_t unit, std::int32_t exponent);

/// physical = logical * scale + offset, in SI units.
struct Conversion {
  Dimension dimension{};
  double scale = 1;
  double offset = 0;

  double physical(std::int64_t logical) const { return static_cast<double>(logical) * scale + offset; }
  /// Rounded, not clamped. 0 where the scale is 0 or the value is not finite or beyond 2^53.
  std::int64_t logical(double physical) const;
};

/// How a field's logical range maps onto its physical one, end to end (5.8). A unit that cannot be used counts as
/// none.
Conversion conversion_of(const Field& field);

/// The value of element `index` of a field, at most 32 bits; wider elements give their low 32 bits.
/// @param data  the report without its id; bits beyond its end read as 0
/// @realtime
std::int64_t extract(std::span<const std::uint8_t> data, const Field& field, std::uint32_t index = 0);

/// Puts the low bits of `value` in place and touches no other bit; what lies beyond the end of `data` is dropped, and
/// elements wider than 32 bits get zeros above.
/// @realtime
void insert(std::span<std::uint8_t> data, const Field& field, std::int64_t value, std::uint32_t index = 0);

/// Whether the value is within the logical range: outside it there is no value (null state) or a wrong one.
inline bool in_range(const Field& field, std::int64_t value) {
  return value >= field.logical_min && value <= field.logical_max;
}

}  // namespace stylet::haptic::hid
