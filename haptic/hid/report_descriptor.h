// What a HID device says of its reports: a report descriptor read into fields (HID 1.11, chapters 5, 6.2.2 and 8).
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

namespace stylet::haptic::hid {

/// What a value means: usage page << 16 | usage (HID Usage Tables). 0: nothing was said.
using Usage = std::uint32_t;

constexpr Usage usage(std::uint32_t page, std::uint32_t id) {
  return page << 16 | id;
}

struct UsageRange {
  Usage first = 0;
  Usage last = 0;  ///< inclusive, of the same page
};

enum class ReportType : std::uint8_t { kInput, kOutput, kFeature };

/// "input", "output" or "feature".
const char* name_of(ReportType type);

/// Bits of Field::flags (HID 1.11, 6.2.2.5).
enum FieldFlag : std::uint32_t {
  kConstant = 0x001,
  kVariable = 0x002,  ///< clear: an array, whose elements hold indices into the usages
  kRelative = 0x004,
  kWraps = 0x008,
  kNonLinear = 0x010,
  kNoPreferredState = 0x020,
  kNullState = 0x040,  ///< a value outside the logical range means: no value
  kVolatile = 0x080,
  kBufferedBytes = 0x100,
};

/// Where one value lies in a report: an element of a variable, a whole array, or padding.
struct Field {
  ReportType type = ReportType::kInput;
  std::uint8_t report_id = 0;    ///< 0: the reports are not numbered
  std::uint32_t flags = 0;       ///< of FieldFlag
  std::uint32_t bit_offset = 0;  ///< from the first bit after the report id
  std::uint32_t bit_size = 0;    ///< of one element, at most 256
  std::uint32_t count = 1;       ///< elements that follow each other: more than one in arrays and padding only
  Usage usage = 0;               ///< of an array the first; 0: padding
  std::int64_t logical_min = 0;  ///< below 0: the value is signed, two's complement
  std::int64_t logical_max = 0;
  std::int64_t physical_min = 0;  ///< both 0: the same as the logical range
  std::int64_t physical_max = 0;
  std::uint32_t unit = 0;          ///< as written: nibbles of system, length, mass, time, ...
  std::int32_t unit_exponent = 0;  ///< power of ten
  std::int32_t collection = -1;    ///< innermost, in ReportDescriptor::collections; -1: none
  Usage application = 0;           ///< usage of the innermost application collection; 0: none
  std::uint32_t item = 0;          ///< the main item that made it, in ReportDescriptor::items

  bool is(FieldFlag flag) const { return (flags & flag) != 0; }
  bool padding() const { return usage == 0; }
  bool array() const { return !padding() && !is(kVariable); }
};

struct Collection {
  std::uint8_t type = 0;  ///< 0 physical, 1 application, 2 logical, 3 report, 4 named array, ...
  Usage usage = 0;
  std::int32_t parent = -1;  ///< in ReportDescriptor::collections; -1: outermost
};

inline constexpr std::uint8_t kPhysicalCollection = 0;
inline constexpr std::uint8_t kApplicationCollection = 1;
inline constexpr std::uint8_t kLogicalCollection = 2;

/// An Input, Output or Feature item: what the kernel calls a field.
struct MainItem {
  std::uint32_t byte_offset = 0;    ///< of the item in the descriptor
  std::uint32_t first_range = 0;    ///< its usages, in the order declared: in ReportDescriptor::usage_ranges
  std::uint32_t range_count = 0;    ///< there may be fewer or more usages than elements
  std::uint32_t element_count = 0;  ///< Report Count
};

struct Report {
  ReportType type = ReportType::kInput;
  std::uint8_t id = 0;
  std::uint32_t bits = 0;  ///< without the id

  /// As sent: with the id byte where the reports are numbered.
  std::size_t bytes() const { return (bits + 7) / 8 + (id != 0 ? 1 : 0); }
};

struct DescriptorWarning {
  std::uint32_t byte_offset = 0;
  std::string text;  ///< one line
};

struct ReportDescriptor {
  std::vector<Field> fields;  ///< in the order declared: in each report by ascending bit
  std::vector<Collection> collections;
  std::vector<MainItem> items;
  std::vector<UsageRange> usage_ranges;
  std::vector<Report> reports;  ///< in order of their first item
  std::vector<DescriptorWarning> warnings;

  /// nullptr: not declared.
  const Report* report(ReportType type, std::uint8_t id) const;
  /// Whether a collection with this usage holds the field, however deep.
  bool within(const Field& field, Usage collection_usage) const;
  /// The usages of the main item of a field.
  std::span<const UsageRange> usages_of(const Field& field) const;
  /// What an element of an array means that holds `value`; nothing where it selects none.
  std::optional<Usage> selected(const Field& array, std::int64_t value) const;
  /// What an element of an array must hold to mean `usage`; nothing where it cannot.
  std::optional<std::int64_t> selector(const Field& array, Usage usage) const;
};

/// Limits, those of the Linux kernel where it has one (include/linux/hid.h).
inline constexpr std::size_t kMaxDescriptorBytes = 4096;
inline constexpr std::size_t kMaxReportBytes = 16384;  ///< with the id; as Linux
inline constexpr std::uint32_t kMaxFieldBits = 256;
inline constexpr std::uint32_t kMaxUsagesPerItem = 12288;
inline constexpr std::size_t kMaxPushDepth = 4;
inline constexpr std::size_t kMaxCollectionDepth = 256;
inline constexpr std::size_t kMaxFields = 65536;

/// A descriptor that breaks the rules. what() is one line and names the byte.
class DescriptorError : public std::runtime_error {
public:
  DescriptorError(std::size_t byte_offset, const std::string& text);
  /// Of the item that is wrong, or the size of the descriptor where its end is.
  std::size_t byte_offset() const { return byte_offset_; }

private:
  std::size_t byte_offset_;
};

/// Throws DescriptorError. What is reserved or long is skipped with a warning.
ReportDescriptor parse_report_descriptor(std::span<const std::uint8_t> bytes);

}  // namespace stylet::haptic::hid
