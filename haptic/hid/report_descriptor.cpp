#include "haptic/hid/report_descriptor.h"

#include <algorithm>

namespace stylet::haptic::hid {
namespace {

// Item types and tags: the high six bits of the prefix byte (HID 1.11, 6.2.2.4 to 6.2.2.8).
enum Tag : std::uint8_t {
  kInputTag = 0x80,
  kOutputTag = 0x90,
  kFeatureTag = 0xB0,
  kCollection = 0xA0,
  kEndCollection = 0xC0,
  kUsagePage = 0x04,
  kLogicalMinimum = 0x14,
  kLogicalMaximum = 0x24,
  kPhysicalMinimum = 0x34,
  kPhysicalMaximum = 0x44,
  kUnitExponent = 0x54,
  kUnit = 0x64,
  kReportSize = 0x74,
  kReportId = 0x84,
  kReportCount = 0x94,
  kPush = 0xA4,
  kPop = 0xB4,
  kUsage = 0x08,
  kUsageMinimum = 0x18,
  kUsageMaximum = 0x28,
  kDesignatorIndex = 0x38,
  kDesignatorMinimum = 0x48,
  kDesignatorMaximum = 0x58,
  kStringIndex = 0x78,
  kStringMinimum = 0x88,
  kStringMaximum = 0x98,
  kDelimiter = 0xA8,
};
constexpr std::uint8_t kLongItem = 0xFE;

struct Item {
  std::size_t offset = 0;
  std::uint8_t tag = 0;
  std::uint8_t size = 0;  ///< of the data: 0, 1, 2 or 4
  std::uint32_t data = 0;

  std::int32_t as_signed() const {
    if (size == 1) return static_cast<std::int8_t>(data);
    if (size == 2) return static_cast<std::int16_t>(data);
    return static_cast<std::int32_t>(data);
  }
};

/// A bound of a range as written: whether it is signed is known only once both bounds are.
struct Bound {
  std::int64_t as_signed = 0;
  std::int64_t as_unsigned = 0;
};

struct Range {
  std::int64_t min = 0;
  std::int64_t max = 0;
};

/// A maximum such as 25 FF beside a minimum of 0 means 255: devices do so although the items are signed by the rule.
Range range_of(const Bound& min, const Bound& max) {
  return {min.as_signed, min.as_signed < 0 ? max.as_signed : max.as_unsigned};
}

struct GlobalState {
  std::uint32_t usage_page = 0;
  Bound logical_min, logical_max, physical_min, physical_max;
  std::int32_t unit_exponent = 0;
  std::uint32_t unit = 0;
  std::uint32_t report_size = 0;
  std::uint32_t report_count = 0;
  std::uint8_t report_id = 0;
};

struct DeclaredUsages {
  UsageRange range;
  bool extended = false;  ///< four bytes: it brought its own page
};

struct LocalState {
  std::vector<DeclaredUsages> usages;
  std::uint32_t usage_count = 0;
  std::optional<Item> minimum;
  bool in_delimiter = false;
  int alternatives = 0;  ///< sets of delimiters so far: only the first counts
};

std::string hex(std::uint32_t value) {
  static const char* digits = "0123456789ABCDEF";
  std::string text;
  do {
    text.insert(text.begin(), digits[value & 15]);
    value >>= 4;
  } while (value != 0);
  return "0x" + text;
}

class Parser {
public:
  explicit Parser(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  ReportDescriptor parse() {
    if (bytes_.empty()) throw DescriptorError(0, "it is empty");
    if (bytes_.size() > kMaxDescriptorBytes) {
      throw DescriptorError(kMaxDescriptorBytes, "it has " + std::to_string(bytes_.size()) + " bytes, at most " +
                                                     std::to_string(kMaxDescriptorBytes) + " are allowed");
    }
    for (at_ = 0; at_ < bytes_.size();) {
      if (const std::optional<Item> item = next()) handle(*item);
    }
    if (local_.in_delimiter) throw DescriptorError(at_, "a Delimiter is still open at the end");
    if (!open_.empty()) {
      throw DescriptorError(at_, std::to_string(open_.size()) + " Collection(s) still open at the end");
    }
    return std::move(out_);
  }

private:
  [[noreturn]] void refuse(const Item& item, const std::string& text) const {
    throw DescriptorError(item.offset, text);
  }

  void warn(std::size_t offset, std::string text) {
    out_.warnings.push_back({static_cast<std::uint32_t>(offset), std::move(text)});
  }

  /// Nothing: a long item was skipped.
  std::optional<Item> next() {
    Item item{.offset = at_};
    const std::uint8_t prefix = bytes_[at_++];
    const std::size_t left = bytes_.size() - at_;
    if (prefix == kLongItem) {
      if (left < 2 || left - 2 < bytes_[at_]) refuse(item, "a long item runs past the end");
      warn(item.offset, "long item skipped");
      at_ += 2 + static_cast<std::size_t>(bytes_[at_]);
      return {};
    }
    item.tag = prefix & 0xFC;
    item.size = (prefix & 3) == 3 ? 4 : prefix & 3;
    if (left < item.size) {
      refuse(item, "item " + hex(prefix) + " needs " + std::to_string(item.size) + " byte(s) of data, " +
                       std::to_string(left) + " are left");
    }
    for (int k = 0; k < item.size; ++k) item.data |= static_cast<std::uint32_t>(bytes_[at_ + k]) << (8 * k);
    at_ += item.size;
    return item;
  }

  void handle(const Item& item) {
    switch (item.tag & 0x0C) {
      case 0x00:
        return handle_main(item);
      case 0x04:
        return handle_global(item);
      case 0x08:
        return handle_local(item);
      default:
        return warn(item.offset, "item " + hex(item.tag) + " is of the reserved type, skipped");
    }
  }

  void handle_main(const Item& item) {
    place_usages_on_last_page();
    switch (item.tag) {
      case kInputTag:
        add_fields(item, ReportType::kInput);
        break;
      case kOutputTag:
        add_fields(item, ReportType::kOutput);
        break;
      case kFeatureTag:
        add_fields(item, ReportType::kFeature);
        break;
      case kCollection:
        open_collection(item);
        break;
      case kEndCollection:
        if (open_.empty()) refuse(item, "End Collection without a Collection");
        open_.pop_back();
        break;
      default:
        warn(item.offset, "main item " + hex(item.tag) + " is reserved, skipped");
    }
    if (local_.in_delimiter) refuse(item, "a Delimiter is still open at a main item");
    local_ = {};
  }

  void handle_global(const Item& item) {
    const Bound bound{item.as_signed(), item.data};
    switch (item.tag) {
      case kUsagePage:
        if (item.data > 0xFFFF) refuse(item, "Usage Page " + hex(item.data) + " is above 0xFFFF");
        global_.usage_page = item.data;
        break;
      case kLogicalMinimum:
        global_.logical_min = bound;
        break;
      case kLogicalMaximum:
        global_.logical_max = bound;
        break;
      case kPhysicalMinimum:
        global_.physical_min = bound;
        break;
      case kPhysicalMaximum:
        global_.physical_max = bound;
        break;
      case kUnitExponent:
        // A nibble in two's complement (6.2.2.7); some devices write a signed byte.
        global_.unit_exponent = item.data <= 0xF ? static_cast<std::int32_t>(item.data ^ 8) - 8 : item.as_signed();
        break;
      case kUnit:
        global_.unit = item.data;
        break;
      case kReportSize:
        if (item.data > kMaxFieldBits) {
          refuse(item,
                 "Report Size " + std::to_string(item.data) + " is above " + std::to_string(kMaxFieldBits) + " bits");
        }
        global_.report_size = item.data;
        break;
      case kReportCount:
        if (item.data > kMaxUsagesPerItem) {
          refuse(item,
                 "Report Count " + std::to_string(item.data) + " is above " + std::to_string(kMaxUsagesPerItem));
        }
        global_.report_count = item.data;
        break;
      case kReportId:
        if (item.data == 0 || item.data > 255) {
          refuse(item, "Report ID " + std::to_string(item.data) + " is not one of 1 to 255");
        }
        global_.report_id = static_cast<std::uint8_t>(item.data);
        if (!out_.reports.empty() && out_.reports.front().id == 0) {
          warn(item.offset, "a Report ID comes after fields without one");
        }
        break;
      case kPush:
        if (pushed_.size() == kMaxPushDepth) {
          refuse(item, "Push more than " + std::to_string(kMaxPushDepth) + " deep");
        }
        pushed_.push_back(global_);
        break;
      case kPop:
        if (pushed_.empty()) refuse(item, "Pop without a Push");
        global_ = pushed_.back();
        pushed_.pop_back();
        break;
      default:
        warn(item.offset, "global item " + hex(item.tag) + " is reserved, skipped");
    }
  }

  void handle_local(const Item& item) {
    if (item.tag == kDelimiter) {
      if (item.data != 0) {
        if (local_.in_delimiter) refuse(item, "a Delimiter inside a Delimiter");
        local_.in_delimiter = true;
        ++local_.alternatives;
      } else {
        if (!local_.in_delimiter) refuse(item, "a Delimiter is closed that was not opened");
        local_.in_delimiter = false;
      }
      return;
    }
    // Sets of delimiters are alternative usages for the same value, best first.
    const bool ignored = local_.alternatives > 1;
    switch (item.tag) {
      case kUsage:
        if (!ignored) add_usages(item, item.data, item.data, item.size > 2);
        break;
      case kUsageMinimum:
        if (!ignored) local_.minimum = item;
        break;
      case kUsageMaximum:
        if (!ignored) add_usage_range(item);
        break;
      case kDesignatorIndex:
      case kDesignatorMinimum:
      case kDesignatorMaximum:
      case kStringIndex:
      case kStringMinimum:
      case kStringMaximum:
        break;
      default:
        warn(item.offset, "local item " + hex(item.tag) + " is reserved, skipped");
    }
  }

  void add_usage_range(const Item& max) {
    const Item min = local_.minimum.value_or(Item{.offset = max.offset});
    std::uint32_t first = min.data;
    std::uint32_t last = max.data;
    const bool extended = min.size > 2 || max.size > 2;
    if (extended) {
      // Where only one of them brings a page it is meant for both.
      if (min.size <= 2) first = usage(last >> 16, first & 0xFFFF);
      if (max.size <= 2) last = usage(first >> 16, last & 0xFFFF);
    }
    if (last < first || last >> 16 != first >> 16) {
      return warn(max.offset, "usages " + hex(first) + " to " + hex(last) + " are no range, skipped");
    }
    add_usages(max, first, last, extended);
  }

  void add_usages(const Item& item, std::uint32_t first, std::uint32_t last, bool extended) {
    const std::uint32_t room = kMaxUsagesPerItem - local_.usage_count;
    if (room == 0) refuse(item, "more than " + std::to_string(kMaxUsagesPerItem) + " usages for one main item");
    if (last - first >= room) {
      warn(item.offset, "usages above " + std::to_string(kMaxUsagesPerItem) + " for one main item dropped");
      last = first + room - 1;
    }
    if (!extended) {
      first = usage(global_.usage_page, first & 0xFFFF);
      last = usage(global_.usage_page, last & 0xFFFF);
    }
    local_.usages.push_back({{first, last}, extended});
    local_.usage_count += last - first + 1;
  }

  /// A Usage Page that comes after the usages counts for them too (6.2.2.8), unless one of them was declared under
  /// it: then the pages take turns, and each usage has the one before it. As the kernel does.
  void place_usages_on_last_page() {
    for (auto declared = local_.usages.rbegin(); declared != local_.usages.rend(); ++declared) {
      if (declared->extended) continue;
      if (declared->range.first >> 16 == global_.usage_page) break;
      declared->range.first = usage(global_.usage_page, declared->range.first & 0xFFFF);
      declared->range.last = usage(global_.usage_page, declared->range.last & 0xFFFF);
    }
  }

  void open_collection(const Item& item) {
    if (open_.size() == kMaxCollectionDepth) {
      refuse(item, "Collections more than " + std::to_string(kMaxCollectionDepth) + " deep");
    }
    const std::int32_t parent = open_.empty() ? -1 : open_.back();
    open_.push_back(static_cast<std::int32_t>(out_.collections.size()));
    out_.collections.push_back({.type = static_cast<std::uint8_t>(item.data),
                                .usage = local_.usages.empty() ? 0 : local_.usages.front().range.first,
                                .parent = parent});
  }

  Report& report_of(ReportType type) {
    for (Report& report : out_.reports) {
      if (report.type == type && report.id == global_.report_id) return report;
    }
    return out_.reports.emplace_back(Report{.type = type, .id = global_.report_id});
  }

  Usage application() const {
    for (auto index = open_.rbegin(); index != open_.rend(); ++index) {
      const Collection& collection = out_.collections[*index];
      if (collection.type == kApplicationCollection) return collection.usage;
    }
    return 0;
  }

  void add_fields(const Item& item, ReportType type) {
    const Range logical = range_of(global_.logical_min, global_.logical_max);
    const Range physical = range_of(global_.physical_min, global_.physical_max);
    if (logical.max < logical.min) {
      refuse(item, "Logical Maximum " + std::to_string(logical.max) + " is below Logical Minimum " +
                       std::to_string(logical.min));
    }
    Report& report = report_of(type);
    Field field{.type = type,
                .report_id = global_.report_id,
                .flags = item.data,
                .bit_offset = report.bits,
                .bit_size = global_.report_size,
                .count = global_.report_count,
                .logical_min = logical.min,
                .logical_max = logical.max,
                .physical_min = physical.min,
                .physical_max = physical.max,
                .unit = global_.unit,
                .unit_exponent = global_.unit_exponent,
                .collection = open_.empty() ? -1 : open_.back(),
                .application = application(),
                .item = static_cast<std::uint32_t>(out_.items.size())};
    report.bits += field.bit_size * field.count;
    if (report.bits > (kMaxReportBytes - 1) * 8) {
      refuse(item, std::string(name_of(type)) + " report " + std::to_string(report.id) + " is longer than " +
                       std::to_string(kMaxReportBytes) + " bytes");
    }
    out_.items.push_back({.byte_offset = static_cast<std::uint32_t>(item.offset),
                          .first_range = static_cast<std::uint32_t>(out_.usage_ranges.size()),
                          .range_count = static_cast<std::uint32_t>(local_.usages.size()),
                          .element_count = field.count});
    for (const DeclaredUsages& declared : local_.usages) out_.usage_ranges.push_back(declared.range);
    if (field.count == 0 || field.bit_size == 0) return;

    const bool elements = field.is(kVariable) && !local_.usages.empty();
    if (out_.fields.size() + (elements ? field.count : 1) > kMaxFields) {
      refuse(item, "more than " + std::to_string(kMaxFields) + " fields");
    }
    if (!elements) {
      if (!local_.usages.empty()) field.usage = local_.usages.front().range.first;
      out_.fields.push_back(field);
      return;
    }
    std::size_t at = 0;  // which range the next element takes its usage from
    Usage next = local_.usages.front().range.first;
    const std::uint32_t count = field.count;
    field.count = 1;
    for (std::uint32_t k = 0; k < count; ++k, field.bit_offset += field.bit_size) {
      field.usage = next;
      out_.fields.push_back(field);
      // The last usage counts for all elements left (6.2.2.8).
      if (next != local_.usages[at].range.last) {
        ++next;
      } else if (at + 1 < local_.usages.size()) {
        next = local_.usages[++at].range.first;
      }
    }
  }

  std::span<const std::uint8_t> bytes_;
  std::size_t at_ = 0;
  GlobalState global_;
  std::vector<GlobalState> pushed_;
  LocalState local_;
  std::vector<std::int32_t> open_;  ///< collections, outermost first
  ReportDescriptor out_;
};

}  // namespace

const char* name_of(ReportType type) {
  if (type == ReportType::kInput) return "input";
  return type == ReportType::kOutput ? "output" : "feature";
}

DescriptorError::DescriptorError(std::size_t byte_offset, const std::string& text)
    : std::runtime_error("report descriptor, byte " + std::to_string(byte_offset) + ": " + text),
      byte_offset_(byte_offset) {}

const Report* ReportDescriptor::report(ReportType type, std::uint8_t id) const {
  const auto found =
      std::ranges::find_if(reports, [&](const Report& report) { return report.type == type && report.id == id; });
  return found == reports.end() ? nullptr : &*found;
}

bool ReportDescriptor::within(const Field& field, Usage collection_usage) const {
  for (std::int32_t k = field.collection; k >= 0; k = collections[k].parent) {
    if (collections[k].usage == collection_usage) return true;
  }
  return false;
}

std::span<const UsageRange> ReportDescriptor::usages_of(const Field& field) const {
  const MainItem& item = items[field.item];
  return std::span(usage_ranges).subspan(item.first_range, item.range_count);
}

std::optional<Usage> ReportDescriptor::selected(const Field& array, std::int64_t value) const {
  if (value < array.logical_min || value > array.logical_max) return {};
  auto index = static_cast<std::uint64_t>(value - array.logical_min);
  for (const UsageRange& range : usages_of(array)) {
    const std::uint64_t size = range.last - range.first + std::uint64_t{1};
    if (index < size) return range.first + static_cast<Usage>(index);
    index -= size;
  }
  return {};
}

std::optional<std::int64_t> ReportDescriptor::selector(const Field& array, Usage usage) const {
  std::int64_t value = array.logical_min;
  for (const UsageRange& range : usages_of(array)) {
    if (usage >= range.first && usage <= range.last) {
      value += usage - range.first;
      if (value > array.logical_max) return {};
      return value;
    }
    value += range.last - range.first + std::int64_t{1};
  }
  return {};
}

ReportDescriptor parse_report_descriptor(std::span<const std::uint8_t> bytes) {
  return Parser(bytes).parse();
}

}  // namespace stylet::haptic::hid
