// The parser against two others, on descriptors of real devices: the Linux kernel's own (its debugfs text), and the
// table beside each descriptor.
#include "tests/haptic/hid_corpus.h"
#include "haptic/hid/report_descriptor.h"
#include "haptic/hid/report_field.h"
#include "tests/support/sanitized.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>
#include <sstream>

namespace stylet::haptic::hid {
namespace {

using support::hid_corpus;
using support::hid_descriptors;

/// One name a thing and one thing a name: the kernel prints names, the parser gives numbers.
class Dictionary {
public:
  void expect_pair(std::uint32_t number, const std::string& name, const std::string& where) {
    EXPECT_EQ(names_.try_emplace(number, name).first->second, name) << where;
    EXPECT_EQ(numbers_.try_emplace(name, number).first->second, number) << where << ": " << name;
  }
  std::size_t size() const { return names_.size(); }

private:
  std::map<std::uint32_t, std::string> names_;
  std::map<std::string, std::uint32_t> numbers_;
};

struct KernelField {
  ReportType type = ReportType::kInput;
  int report_id = 0;
  std::map<std::string, std::string> values{};  ///< such as "Report Size" -> "16"
  std::vector<std::string> usages{};
  int number(const std::string& key, int otherwise) const {
    const auto found = values.find(key);
    return found == values.end() ? otherwise : std::stoi(found->second);
  }
};

std::vector<KernelField> read_kernel_fields(const std::filesystem::path& path) {
  std::ifstream file(path);
  std::vector<KernelField> fields;
  KernelField report;
  for (std::string line; std::getline(file, line);) {
    if (line.find("--->") != std::string::npos) break;
    line.erase(0, line.find_first_not_of(' '));
    // Reports without a number: "INPUT[INPUT]".
    if (line.ends_with("PUT]") || line.ends_with("FEATURE]"))
      line.insert(line.find('['), line.find('(') == std::string::npos ? "(0)" : "");
    const auto open = line.find('(');
    const auto close = line.rfind(')');
    if (open == std::string::npos) {
      if (!line.empty()) fields.back().usages.push_back(line);
      continue;
    }
    const std::string key = line.substr(0, open);
    const std::string value = line.substr(open + 1, close - open - 1);
    if (key == "INPUT" || key == "OUTPUT" || key == "FEATURE") {
      report = {.type = key == "INPUT"    ? ReportType::kInput
                        : key == "OUTPUT" ? ReportType::kOutput
                                          : ReportType::kFeature,
                .report_id = std::stoi(value)};
    } else if (key == "Field") {
      fields.push_back(report);
    } else {
      fields.back().values[key] = value;
    }
  }
  return fields;
}

/// The words of the kernel for the flags of a main item.
std::string flag_words(const Field& field) {
  std::string words;
  if (field.is(kConstant)) words += " Constant";
  words += field.is(kVariable) ? " Variable" : " Array";
  words += field.is(kRelative) ? " Relative" : " Absolute";
  if (field.is(kWraps)) words += " Wrap";
  if (field.is(kNonLinear)) words += " NonLinear";
  if (field.is(kNoPreferredState)) words += " NoPreferredState";
  if (field.is(kNullState)) words += " NullState";
  if (field.is(kVolatile)) words += " Volatile";
  if (field.is(kBufferedBytes)) words += " BufferedByte";
  return words + " ";
}

std::vector<Usage> listed_usages(const ReportDescriptor& descriptor, const Field& field) {
  std::vector<Usage> usages;
  for (const UsageRange& range : descriptor.usages_of(field)) {
    for (Usage u = range.first;; ++u) {
      usages.push_back(u);
      if (u == range.last) break;
    }
  }
  // The kernel lists the last usage again for every element left.
  const std::size_t count = descriptor.items[field.item].element_count;
  if (usages.size() < count) usages.resize(count, usages.back());
  return usages;
}

/// The first field of every main item that the kernel keeps.
std::vector<Field> item_heads(const ReportDescriptor& descriptor) {
  std::vector<Field> heads;
  for (const Field& field : descriptor.fields) {
    if (!field.padding() && (heads.empty() || heads.back().item != field.item)) heads.push_back(field);
  }
  return heads;
}

Usage enclosing(const ReportDescriptor& descriptor, const Field& field, std::uint8_t type) {
  for (std::int32_t k = field.collection; k >= 0; k = descriptor.collections[k].parent) {
    if (descriptor.collections[k].type == type) return descriptor.collections[k].usage;
  }
  return 0;
}

TEST(HidCorpus, AgreesWithTheKernelOnEveryField) {
  if (hid_corpus().empty()) GTEST_SKIP() << "STYLET_TEST_DATA has no hid";
  Dictionary usage_names;
  Dictionary units;
  int files = 0;
  int fields = 0;
  int values = 0;
  for (const auto& [name, bytes] : hid_descriptors()) {
    const auto path = hid_corpus() / (name + ".kernel.txt");
    if (!std::filesystem::exists(path)) continue;
    ++files;
    const ReportDescriptor descriptor = parse_report_descriptor(bytes);
    std::vector<Field> ours = item_heads(descriptor);
    for (const KernelField& theirs : read_kernel_fields(path)) {
      const auto same_place = [&](const Field& f) {
        return f.type == theirs.type && f.report_id == theirs.report_id &&
               f.bit_offset == static_cast<std::uint32_t>(theirs.number("Report Offset", -1));
      };
      const auto found = std::find_if(ours.begin(), ours.end(), same_place);
      const std::string where = name + " " + name_of(theirs.type) + " " + std::to_string(theirs.report_id) + " bit " +
                                std::to_string(theirs.number("Report Offset", -1));
      ASSERT_NE(found, ours.end()) << where;
      const Field field = *found;
      ours.erase(found);
      ++fields;
      const auto expect_number = [&](const std::string& key, std::int64_t value, int otherwise) {
        // The kernel holds ranges in 32 bits.
        EXPECT_EQ(theirs.number(key, otherwise), static_cast<std::int32_t>(value)) << where << ": " << key;
        ++values;
      };
      expect_number("Report Size", field.bit_size, -1);
      expect_number("Report Count", descriptor.items[field.item].element_count, -1);
      expect_number("Unit Exponent", field.unit_exponent, 0);
      // A range of one value is not printed.
      if (field.logical_min != field.logical_max) {
        expect_number("Logical Minimum", field.logical_min, 0);
        expect_number("Logical Maximum", field.logical_max, 0);
      }
      if (field.physical_min != field.physical_max) {
        expect_number("Physical Minimum", field.physical_min, 0);
        expect_number("Physical Maximum", field.physical_max, 0);
      }
      EXPECT_EQ(theirs.values.at("Flags"), flag_words(field)) << where;
      const auto unit = theirs.values.find("Unit");
      EXPECT_EQ(unit == theirs.values.end(), field.unit == 0) << where;
      if (unit != theirs.values.end() && unit->second != "Invalid") {
        units.expect_pair(field.unit, unit->second, where);
      }
      const std::pair<const char*, std::uint8_t> kinds[] = {{"Physical", kPhysicalCollection},
                                                            {"Application", kApplicationCollection},
                                                            {"Logical", kLogicalCollection}};
      for (const auto& [key, type] : kinds) {
        const Usage collection = enclosing(descriptor, field, type);
        const auto printed = theirs.values.find(key);
        if (printed == theirs.values.end()) {
          EXPECT_EQ(collection, 0U) << where << ": " << key;
        } else {
          usage_names.expect_pair(collection, printed->second, where);
        }
        ++values;
      }
      EXPECT_EQ(field.application, enclosing(descriptor, field, kApplicationCollection)) << where;
      const std::vector<Usage> usages = listed_usages(descriptor, field);
      ASSERT_EQ(theirs.usages.size(), usages.size()) << where;
      for (std::size_t k = 0; k < usages.size(); ++k) usage_names.expect_pair(usages[k], theirs.usages[k], where);
      values += static_cast<int>(usages.size()) + 2;
    }
    EXPECT_TRUE(ours.empty()) << name << ": " << ours.size() << " field(s) that the kernel has not";
  }
  EXPECT_GT(files, 0);
  std::printf("%d files, %d fields, %d values the same; %zu usages, %zu units under one name each\n", files, fields,
              values, usage_names.size(), units.size());
}

std::string flag_letters(const Field& field) {
  std::string letters;
  letters += field.is(kConstant) ? 'C' : 'D';
  letters += field.is(kVariable) ? 'V' : 'A';
  letters += field.is(kRelative) ? 'R' : 'A';
  if (field.is(kNullState) && !field.array()) letters += 'N';
  return letters;
}

/// The tables name the outermost.
Usage outermost_application(const ReportDescriptor& descriptor, const Field& field) {
  Usage usage = 0;
  for (std::int32_t k = field.collection; k >= 0; k = descriptor.collections[k].parent) {
    if (descriptor.collections[k].type == kApplicationCollection) usage = descriptor.collections[k].usage;
  }
  return usage;
}

/// A row of the tables: all columns but the name.
std::string row_of(const ReportDescriptor& descriptor, const Field& field) {
  char text[256];
  std::string size = std::to_string(field.bit_size);
  char usages[32];
  std::snprintf(usages, sizeof usages, "%08x", field.usage);
  std::string usage_text = usages;
  if (field.array()) {
    size += "x" + std::to_string(field.count);
    Usage first = ~0U;
    Usage last = 0;
    for (const UsageRange& range : descriptor.usages_of(field)) {
      first = std::min(first, range.first);
      last = std::max(last, range.last);
    }
    std::snprintf(usages, sizeof usages, "%08x-%08x", first, last);
    usage_text = usages;
  }
  std::snprintf(text, sizeof text, "%c %d %u %s %s %lld %lld %lld %lld %x %d %s %08x",
                static_cast<char>(std::toupper(name_of(field.type)[0])), field.report_id, field.bit_offset,
                size.c_str(), usage_text.c_str(), static_cast<long long>(field.logical_min),
                static_cast<long long>(field.logical_max), static_cast<long long>(field.physical_min),
                static_cast<long long>(field.physical_max), field.unit, field.unit_exponent,
                flag_letters(field).c_str(), outermost_application(descriptor, field));
  return text;
}

TEST(HidCorpus, AgreesWithTheTablesOnEveryField) {
  if (hid_corpus().empty()) GTEST_SKIP() << "STYLET_TEST_DATA has no hid";
  int rows = 0;
  for (const auto& [name, bytes] : hid_descriptors()) {
    const ReportDescriptor descriptor = parse_report_descriptor(bytes);
    std::multiset<std::string> ours;
    for (const Field& field : descriptor.fields) {
      if (!field.padding()) ours.insert(row_of(descriptor, field));
    }
    std::multiset<std::string> theirs;
    std::ifstream file(hid_corpus() / (name + ".expect.tsv"));
    std::string line;
    std::getline(file, line);
    while (std::getline(file, line)) {
      std::istringstream columns(line);
      std::string row;
      std::string column;
      for (int k = 0; std::getline(columns, column, '\t'); ++k) {
        if (k == 5) continue;
        if (k > 0) row += ' ';
        row += column;
      }
      theirs.insert(row);
      ++rows;
    }
    std::vector<std::string> missing;
    std::vector<std::string> surplus;
    std::ranges::set_difference(theirs, ours, std::back_inserter(missing));
    std::ranges::set_difference(ours, theirs, std::back_inserter(surplus));
    if (!missing.empty()) ADD_FAILURE() << name << ": " << missing.size() << " missing, such as " << missing.front();
    if (!surplus.empty()) ADD_FAILURE() << name << ": " << surplus.size() << " too many, such as " << surplus.front();
  }
  EXPECT_GT(rows, 0);
  std::printf("%d rows the same\n", rows);
}

TEST(HidCorpus, BitsOfTheFieldsAddUpToTheReport) {
  if (hid_corpus().empty()) GTEST_SKIP() << "STYLET_TEST_DATA has no hid";
  for (const auto& [name, bytes] : hid_descriptors()) {
    const ReportDescriptor descriptor = parse_report_descriptor(bytes);
    for (const Report& report : descriptor.reports) {
      std::uint32_t end = 0;
      for (const Field& field : descriptor.fields) {
        if (field.type != report.type || field.report_id != report.id) continue;
        EXPECT_EQ(field.bit_offset, end) << name << ": a gap or an overlap";
        end += field.bit_size * field.count;
      }
      EXPECT_EQ(end, report.bits) << name;
    }
  }
}

TEST(HidCorpus, WhatIsPutInIsTakenOut) {
  if (hid_corpus().empty()) GTEST_SKIP() << "STYLET_TEST_DATA has no hid";
  std::mt19937 random(1);
  for (const auto& [name, bytes] : hid_descriptors()) {
    const ReportDescriptor descriptor = parse_report_descriptor(bytes);
    for (const Report& report : descriptor.reports) {
      std::vector<std::uint8_t> data((report.bits + 7) / 8);
      for (auto& byte : data) byte = static_cast<std::uint8_t>(random());
      std::vector<std::pair<const Field*, std::int64_t>> written;
      for (const Field& field : descriptor.fields) {
        if (field.type != report.type || field.report_id != report.id || field.bit_size > 32) continue;
        for (std::uint32_t k = 0; k < field.count; ++k) {
          const auto span = static_cast<std::uint64_t>(1) << field.bit_size;
          const std::int64_t lowest = field.logical_min < 0 ? -static_cast<std::int64_t>(span / 2) : 0;
          const std::int64_t value = lowest + static_cast<std::int64_t>(random() % span);
          insert(data, field, value, k);
          if (k + 1 == field.count) written.emplace_back(&field, value);
        }
      }
      for (const auto& [field, value] : written) {
        ASSERT_EQ(extract(data, *field, field->count - 1), value) << name << " bit " << field->bit_offset;
      }
    }
  }
}

/// Whatever the parser accepts must hold together.
void expect_sound(const ReportDescriptor& descriptor) {
  for (const Field& field : descriptor.fields) {
    const Report* report = descriptor.report(field.type, field.report_id);
    ASSERT_NE(report, nullptr);
    ASSERT_LE(field.bit_offset + field.bit_size * field.count, report->bits);
    ASSERT_LE(field.logical_min, field.logical_max);
    ASSERT_LT(field.collection, static_cast<std::int32_t>(descriptor.collections.size()));
  }
}

TEST(HidCorpus, NoPrefixAndNoWrongByteBreaksTheParser) {
  if (hid_corpus().empty()) GTEST_SKIP() << "STYLET_TEST_DATA has no hid";
  int accepted = 0;
  int refused = 0;
  const auto attempt = [&](std::span<const std::uint8_t> bytes) {
    try {
      expect_sound(parse_report_descriptor(bytes));
      ++accepted;
    } catch (const DescriptorError& error) {
      EXPECT_LE(error.byte_offset(), bytes.size());
      EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
      ++refused;
    }
  };
  std::mt19937 random(2);
  const std::size_t stride = support::kSanitized ? 23 : 1;
  for (const auto& [name, bytes] : hid_descriptors()) {
    for (std::size_t k = 0; k < bytes.size(); k += stride) attempt(std::span(bytes).first(k));
    std::vector<std::uint8_t> wrong = bytes;
    for (std::size_t k = 0; k < bytes.size(); k += stride) {
      wrong[k] = static_cast<std::uint8_t>(bytes[k] ^ (1 + random() % 255));
      attempt(wrong);
      wrong[k] = bytes[k];
    }
  }
  EXPECT_GT(accepted, 0);
  EXPECT_GT(refused, 0);
  std::printf("%d accepted, %d refused\n", accepted, refused);
}

}  // namespace
}  // namespace stylet::haptic::hid
