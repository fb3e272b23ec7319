#include "haptic/hid/report_descriptor.h"
#include "haptic/hid/report_field.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <initializer_list>
#include <numbers>

namespace stylet::haptic::hid {
namespace {

ReportDescriptor parse(std::initializer_list<std::uint8_t> bytes) {
  return parse_report_descriptor(std::vector<std::uint8_t>(bytes));
}

/// A refusal as "offset: text".
std::string refusal(const std::vector<std::uint8_t>& bytes) {
  try {
    parse_report_descriptor(bytes);
  } catch (const DescriptorError& error) {
    const std::string text = error.what();
    const std::string prefix = "report descriptor, byte ";
    EXPECT_TRUE(text.starts_with(prefix + std::to_string(error.byte_offset()) + ": ")) << text;
    return text.substr(prefix.size());
  }
  return "accepted";
}

// The mouse of HID 1.11, appendix E.10, with report 1 instead of an unnumbered one.
const std::initializer_list<std::uint8_t> kMouse = {
    0x05, 0x01, 0x09, 0x02, 0xA1, 0x01, 0x85, 0x01, 0x09, 0x01, 0xA1, 0x00, 0x05, 0x09, 0x19, 0x01, 0x29, 0x03,
    0x15, 0x00, 0x25, 0x01, 0x95, 0x03, 0x75, 0x01, 0x81, 0x02, 0x95, 0x01, 0x75, 0x05, 0x81, 0x01, 0x05, 0x01,
    0x09, 0x30, 0x09, 0x31, 0x15, 0x81, 0x25, 0x7F, 0x75, 0x08, 0x95, 0x02, 0x81, 0x06, 0xC0, 0xC0};

TEST(ReportDescriptor, ReadsTheMouseOfTheSpecification) {
  const ReportDescriptor mouse = parse(kMouse);
  ASSERT_EQ(mouse.fields.size(), 6U);
  EXPECT_EQ(mouse.fields[2].usage, usage(0x09, 3));
  EXPECT_EQ(mouse.fields[2].bit_offset, 2U);
  EXPECT_TRUE(mouse.fields[3].padding());
  EXPECT_EQ(mouse.fields[3].bit_size, 5U);
  const Field& y = mouse.fields[5];
  EXPECT_EQ(y.usage, usage(0x01, 0x31));
  EXPECT_EQ(y.bit_offset, 16U);
  EXPECT_EQ(y.logical_min, -127);
  EXPECT_TRUE(y.is(kRelative));
  EXPECT_EQ(y.application, usage(0x01, 0x02));
  EXPECT_TRUE(mouse.within(y, usage(0x01, 0x01)));
  EXPECT_FALSE(mouse.within(y, usage(0x01, 0x06)));
  ASSERT_NE(mouse.report(ReportType::kInput, 1), nullptr);
  EXPECT_EQ(mouse.report(ReportType::kInput, 1)->bytes(), 4U);
  EXPECT_EQ(mouse.report(ReportType::kOutput, 1), nullptr);
  EXPECT_TRUE(mouse.warnings.empty());
}

TEST(ReportDescriptor, TheLastUsageCountsForTheElementsLeft) {
  const auto d = parse({0x05, 0x01, 0x09, 0x30, 0x09, 0x31, 0x25, 0x01, 0x75, 0x08, 0x95, 0x04, 0x81, 0x02});
  ASSERT_EQ(d.fields.size(), 4U);
  EXPECT_EQ(d.fields[0].usage, usage(1, 0x30));
  for (int k = 1; k < 4; ++k) EXPECT_EQ(d.fields[k].usage, usage(1, 0x31));
}

TEST(ReportDescriptor, SurplusUsagesAreNoFields) {
  const auto d = parse({0x05, 0x01, 0x19, 0x30, 0x29, 0x35, 0x25, 0x01, 0x75, 0x08, 0x95, 0x02, 0x81, 0x02});
  ASSERT_EQ(d.fields.size(), 2U);
  EXPECT_EQ(d.report(ReportType::kInput, 0)->bytes(), 2U);
}

TEST(ReportDescriptor, AUsagePageAfterTheUsageCountsForIt) {
  const auto d = parse({0x05, 0x01, 0x09, 0x30, 0x05, 0x0D, 0x75, 0x08, 0x95, 0x01, 0x81, 0x02});
  EXPECT_EQ(d.fields[0].usage, usage(0x0D, 0x30));
}

TEST(ReportDescriptor, PagesThatTakeTurnsKeepTheirUsages) {
  const auto d = parse({0x05, 0x01, 0x09, 0x30, 0x05, 0x0D, 0x09, 0x42, 0x75, 0x08, 0x95, 0x02, 0x81, 0x02});
  EXPECT_EQ(d.fields[0].usage, usage(0x01, 0x30));
  EXPECT_EQ(d.fields[1].usage, usage(0x0D, 0x42));
}

TEST(ReportDescriptor, AUsageOfFourBytesBringsItsPage) {
  const auto d = parse({0x05, 0x01, 0x0B, 0x42, 0x00, 0x0D, 0x00, 0x75, 0x08, 0x95, 0x01, 0x81, 0x02});
  EXPECT_EQ(d.fields[0].usage, usage(0x0D, 0x42));
}

TEST(ReportDescriptor, OfAlternativesTheFirstIsTaken) {
  const auto d = parse({0x05, 0x01, 0xA9, 0x01, 0x09, 0x30, 0xA9, 0x00, 0xA9, 0x01,
                        0x09, 0x31, 0xA9, 0x00, 0x75, 0x08, 0x95, 0x01, 0x81, 0x02});
  EXPECT_EQ(d.fields[0].usage, usage(1, 0x30));
  EXPECT_EQ(d.usages_of(d.fields[0]).size(), 1U);
}

TEST(ReportDescriptor, PushAndPopKeepTheGlobals) {
  const auto d = parse({0x05, 0x01, 0x75, 0x08, 0x95, 0x01, 0xA4, 0x75, 0x10, 0x55,
                        0x0E, 0x09, 0x30, 0x81, 0x02, 0xB4, 0x09, 0x31, 0x81, 0x02});
  EXPECT_EQ(d.fields[0].bit_size, 16U);
  EXPECT_EQ(d.fields[0].unit_exponent, -2);
  EXPECT_EQ(d.fields[1].bit_size, 8U);
  EXPECT_EQ(d.fields[1].unit_exponent, 0);
}

TEST(ReportDescriptor, AMaximumIsSignedWhereTheMinimumIs) {
  const auto max = [](std::uint8_t min, std::uint8_t raw) {
    return parse({0x05, 0x01, 0x09, 0x30, 0x15, min, 0x25, raw, 0x75, 0x08, 0x95, 0x01, 0x81, 0x02})
        .fields[0]
        .logical_max;
  };
  EXPECT_EQ(max(0, 0xFF), 255);
  EXPECT_EQ(max(0x80, 0xFF), -1);
  // Whichever comes first.
  const auto d = parse({0x05, 0x01, 0x09, 0x30, 0x25, 0xFF, 0x15, 0x00, 0x75, 0x08, 0x95, 0x01, 0x81, 0x02});
  EXPECT_EQ(d.fields[0].logical_max, 255);
}

TEST(ReportDescriptor, ArraysSelectUsages) {
  const auto d = parse(
      {0x05, 0x0F, 0x09, 0x97, 0x19, 0x9A, 0x29, 0x9C, 0x15, 0x01, 0x25, 0x04, 0x75, 0x08, 0x95, 0x02, 0x91, 0x00});
  ASSERT_EQ(d.fields.size(), 1U);
  const Field& array = d.fields[0];
  EXPECT_TRUE(array.array());
  EXPECT_EQ(array.count, 2U);
  EXPECT_EQ(d.selected(array, 1), usage(0x0F, 0x97));
  EXPECT_EQ(d.selected(array, 4), usage(0x0F, 0x9C));
  EXPECT_FALSE(d.selected(array, 0));
  EXPECT_FALSE(d.selected(array, 5));
  EXPECT_EQ(d.selector(array, usage(0x0F, 0x9B)), 3);
  EXPECT_FALSE(d.selector(array, usage(0x0F, 0x98)));
}

TEST(ReportDescriptor, OneIdInThreeTypesIsThreeReports) {
  const auto d = parse({0x05, 0x01, 0x85, 0x07, 0x75, 0x08, 0x95, 0x01, 0x09, 0x30, 0x81, 0x02,
                        0x95, 0x02, 0x09, 0x30, 0x91, 0x02, 0x95, 0x03, 0x09, 0x30, 0xB1, 0x02});
  EXPECT_EQ(d.report(ReportType::kInput, 7)->bytes(), 2U);
  EXPECT_EQ(d.report(ReportType::kOutput, 7)->bytes(), 3U);
  EXPECT_EQ(d.report(ReportType::kFeature, 7)->bytes(), 4U);
}

TEST(ReportDescriptor, WhatIsReservedIsSkippedWithAWarning) {
  const auto d = parse({0x05, 0x01, 0xFE, 0x02, 0x55, 0xAA, 0xBB, 0xC5, 0x00, 0x0D, 0x01, 0xB9,
                        0x01, 0xD1, 0x01, 0x75, 0x08, 0x95, 0x01, 0x09, 0x30, 0x81, 0x02});
  ASSERT_EQ(d.warnings.size(), 5U);
  EXPECT_EQ(d.warnings[0].byte_offset, 2U);
  EXPECT_EQ(d.warnings[0].text, "long item skipped");
  EXPECT_EQ(d.warnings[4].byte_offset, 13U);
  EXPECT_EQ(d.fields[0].usage, usage(1, 0x30));
}

TEST(ReportDescriptor, IsRefusedAtTheByteThatIsWrong) {
  using Bytes = std::vector<std::uint8_t>;
  EXPECT_EQ(refusal({}), "0: it is empty");
  EXPECT_EQ(refusal(Bytes(4097, 0xC0)), "4096: it has 4097 bytes, at most 4096 are allowed");
  EXPECT_EQ(refusal({0x05, 0x01, 0x26, 0x01}), "2: item 0x26 needs 2 byte(s) of data, 1 are left");
  EXPECT_EQ(refusal({0x05, 0x01, 0xFE, 0x05, 0x00, 0x00}), "2: a long item runs past the end");
  EXPECT_EQ(refusal({0x05, 0x01, 0xC0}), "2: End Collection without a Collection");
  EXPECT_EQ(refusal({0xA1, 0x01, 0xA1, 0x00}), "4: 2 Collection(s) still open at the end");
  EXPECT_EQ(refusal({0xB4}), "0: Pop without a Push");
  EXPECT_EQ(refusal({0xA4, 0xA4, 0xA4, 0xA4, 0xA4}), "4: Push more than 4 deep");
  EXPECT_EQ(refusal({0x85, 0x00}), "0: Report ID 0 is not one of 1 to 255");
  EXPECT_EQ(refusal({0x86, 0x00, 0x01}), "0: Report ID 256 is not one of 1 to 255");
  EXPECT_EQ(refusal({0x76, 0x01, 0x01}), "0: Report Size 257 is above 256 bits");
  EXPECT_EQ(refusal({0x96, 0x01, 0x30}), "0: Report Count 12289 is above 12288");
  EXPECT_EQ(refusal({0x15, 0x05, 0x25, 0x04, 0x81, 0x02}), "4: Logical Maximum 4 is below Logical Minimum 5");
  // Of 4064 bytes each: four inputs fit.
  Bytes longest{0x85, 0x09, 0x76, 0x00, 0x01, 0x95, 0x7F, 0xB1, 0x02, 0x81, 0x02, 0x81, 0x02, 0x81, 0x02, 0x81, 0x02};
  EXPECT_EQ(parse_report_descriptor(longest).report(ReportType::kInput, 9)->bytes(), 16'257U);
  longest.insert(longest.end(), {0x81, 0x02});
  EXPECT_EQ(refusal(longest), "17: input report 9 is longer than 16384 bytes");
  EXPECT_EQ(refusal({0xA9, 0x01, 0xA9, 0x01}), "2: a Delimiter inside a Delimiter");
  EXPECT_EQ(refusal({0xA9, 0x00}), "0: a Delimiter is closed that was not opened");
  EXPECT_EQ(refusal({0xA9, 0x01}), "2: a Delimiter is still open at the end");
  EXPECT_EQ(refusal({0x07, 0x00, 0x00, 0x01, 0x00}), "0: Usage Page 0x10000 is above 0xFFFF");
  Bytes nested;
  for (int k = 0; k < 257; ++k) nested.insert(nested.end(), {0xA1, 0x00});
  EXPECT_EQ(refusal(nested), "512: Collections more than 256 deep");
}

TEST(ReportDescriptor, HugeDemandsAreRefusedBeforeTheyAreMet) {
  // 12288 bits a report, as many reports as fit.
  std::vector<std::uint8_t> bytes = {0x05, 0x01, 0x75, 0x01, 0x96, 0x00, 0x30};
  for (int id = 1; id < 256; ++id)
    bytes.insert(bytes.end(), {0x85, static_cast<std::uint8_t>(id), 0x09, 0x30, 0x81, 0x02});
  EXPECT_THAT(refusal(bytes), ::testing::HasSubstr("more than 65536 fields"));
}

TEST(ReportField, BitsAtAnyPlaceAreTakenOut) {
  const std::vector<std::uint8_t> data = {0x21, 0x43, 0x65, 0x87, 0xA9, 0xCB};
  const auto at = [&](std::uint32_t offset, std::uint32_t size, std::int64_t min) {
    return extract(data, {.bit_offset = offset, .bit_size = size, .logical_min = min});
  };
  EXPECT_EQ(at(0, 8, 0), 0x21);
  EXPECT_EQ(at(4, 8, 0), 0x32);
  EXPECT_EQ(at(8, 16, 0), 0x6543);
  EXPECT_EQ(at(4, 32, 0), 0x98765432);
  EXPECT_EQ(at(7, 32, 0), (0xA987654321 >> 7) & 0xFFFFFFFF);
  EXPECT_EQ(at(31, 1, 0), 1);
  EXPECT_EQ(at(31, 1, -1), -1);
  EXPECT_EQ(at(16, 16, -1), static_cast<std::int16_t>(0x8765));
  EXPECT_EQ(at(44, 8, 0), 0x0C) << "beyond the end: zeros";
  EXPECT_EQ(at(4000, 32, -1), 0);
}

TEST(ReportField, InsertTouchesNoOtherBit) {
  for (std::uint32_t size = 1; size <= 32; ++size) {
    for (std::uint32_t offset = 0; offset < 17; ++offset) {
      std::vector<std::uint8_t> data(8, 0xFF);
      const Field field{.bit_offset = offset, .bit_size = size};
      insert(data, field, 0);
      int ones = 0;
      for (const std::uint8_t byte : data) ones += std::popcount(byte);
      EXPECT_EQ(ones, 64 - static_cast<int>(size));
      EXPECT_EQ(extract(data, field), 0);
      insert(data, field, -1);
      EXPECT_EQ(data, std::vector<std::uint8_t>(8, 0xFF));
    }
  }
  std::vector<std::uint8_t> data(1);
  insert(data, {.bit_offset = 4, .bit_size = 16}, 0xFFFF);
  EXPECT_EQ(data[0], 0xF0);
}

TEST(ReportField, UnitsBecomeSi) {
  const auto expect = [](std::uint32_t unit, int exponent, Dimension dimension, double factor) {
    const auto si = si_unit(unit, exponent);
    ASSERT_TRUE(si);
    EXPECT_EQ(si->dimension, dimension) << unit;
    EXPECT_NEAR(si->factor, factor, 1e-12 * factor) << unit;
  };
  expect(0x11, -1, kMetres, 1e-3);
  expect(0x13, -3, kMetres, 25.4e-6);
  expect(0x14, 0, kRadians, std::numbers::pi / 180);
  expect(0x12, 0, kRadians, 1);
  expect(0x1001, -4, kSeconds, 1e-4);
  expect(0x1003, -3, kSeconds, 1e-3);
  expect(0xE111, 5, kNewtons, 1);
  expect(0xE111, 2, kNewtons, 1e-3);
  expect(0xE121, 7, kNewtonMetres, 1);
  expect(0, 0, kNumber, 1);
  EXPECT_FALSE(si_unit(0x0F, 0));
  EXPECT_FALSE(si_unit(0x11, 300));
}

TEST(ReportField, LogicalEndsAreThePhysicalEnds) {
  // 5.8 of the specification: a resolution of 400 to the inch.
  const Field field{.logical_min = -127,
                    .logical_max = 127,
                    .physical_min = -3175,
                    .physical_max = 3175,
                    .unit = 0x13,
                    .unit_exponent = -4};
  const Conversion conversion = conversion_of(field);
  EXPECT_EQ(conversion.dimension, kMetres);
  EXPECT_NEAR(conversion.physical(127), 0.3175 * 0.0254, 1e-15);
  EXPECT_NEAR(conversion.physical(0), 0, 1e-15);
  EXPECT_NEAR(1 / conversion.scale, 400 / 0.0254, 1e-6);
  for (int k = -127; k <= 127; ++k) EXPECT_EQ(conversion.logical(conversion.physical(k)), k);
}

TEST(ReportField, WithoutAPhysicalRangeTheLogicalOneCounts) {
  const Conversion conversion =
      conversion_of({.logical_min = 0, .logical_max = 1000, .unit = 0x11, .unit_exponent = -3});
  EXPECT_NEAR(conversion.physical(1000), 0.01, 1e-15);
}

TEST(ReportField, OffsetsAndReversedRangesAreFollowed) {
  const Conversion conversion =
      conversion_of({.logical_min = 0, .logical_max = 255, .physical_min = 10, .physical_max = -10});
  EXPECT_NEAR(conversion.physical(0), 10, 1e-12);
  EXPECT_NEAR(conversion.physical(255), -10, 1e-12);
  EXPECT_EQ(conversion_of({.physical_min = 3, .physical_max = 3, .unit_exponent = 0}).logical(1e300), 0);
}

}  // namespace
}  // namespace stylet::haptic::hid
