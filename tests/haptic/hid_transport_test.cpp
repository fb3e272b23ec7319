#include "haptic/hid/hid_transport.h"

#include "haptic/hid/hid_devices.h"
#include "tests/support/hid/mock_hid_node.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include <array>
#include <atomic>
#include <cerrno>
#include <cstring>
#include <vector>

namespace stylet::haptic::hid {
namespace {

using support::MockHidBus;
using support::MockHidNode;

/// Counts its reports: [1, counter of 32 bits, low byte first]. Takes every output; feature 4 holds a byte.
class CountingFirmware final : public support::MockFirmware {
public:
  std::vector<std::uint8_t> descriptor() const override {
    return {0x06, 0x00, 0xFF, 0x09, 0x01, 0xA1, 0x01, 0x85, 0x01, 0x09, 0x02, 0x15, 0x00, 0x26, 0xFF, 0x00,
            0x75, 0x08, 0x95, 0x04, 0x81, 0x02, 0x85, 0x04, 0x09, 0x03, 0x95, 0x01, 0xB1, 0x02, 0xC0};
  }
  std::size_t input(std::int64_t, std::span<std::uint8_t> report) override {
    if (made == last || made - taken >= ahead) return 0;
    report[0] = 1;
    std::memcpy(&report[1], &made, sizeof made);
    ++made;
    return 5;
  }
  int output(std::int64_t, std::span<const std::uint8_t> report) override {
    written.emplace_back(report.begin(), report.end());
    return 0;
  }
  int set_feature(std::int64_t, std::span<const std::uint8_t> report) override {
    if (report[0] != 4 || report.size() != 2) return EINVAL;
    feature = report[1];
    return 0;
  }
  int get_feature(std::span<std::uint8_t> report) override {
    if (report[0] != 4 || report.size() < 2) return -EINVAL;
    report[1] = feature;
    return 2;
  }

  std::uint32_t made = 0;
  std::uint32_t last = 0xFFFFFFFF;
  std::uint32_t ahead = 0xFFFFFFFF;     // most reports under way
  std::atomic<std::uint32_t> taken{0};  // by the host
  std::uint8_t feature = 7;
  std::vector<std::vector<std::uint8_t>> written;
};

class HidTransportTest : public testing::Test {
protected:
  using Buffer = std::array<std::uint8_t, kReadBuffer>;
  static std::uint32_t counter(const Buffer& report) {
    std::uint32_t value = 0;
    std::memcpy(&value, &report[1], sizeof value);
    return value;
  }

  MockHidBus bus;
  CountingFirmware firmware;
  Buffer buffer{};
};

TEST_F(HidTransportTest, DeviceIsListedWithItsNamesAndDescriptor) {
  const MockHidNode node(bus, firmware, {.number = 3, .identity = {.vendor_id = 0xCAFE, .serial = "S7"}});
  const std::vector<HidDeviceSummary> devices = list_hid_devices();
  ASSERT_FALSE(devices.empty());
  EXPECT_EQ(devices[0].path, "/dev/hidraw3");
  EXPECT_EQ(devices[0].vendor_id, 0xCAFE);
  EXPECT_EQ(devices[0].manufacturer, "Stylet");
  EXPECT_EQ(devices[0].serial_number, "S7");
  EXPECT_EQ(report_descriptor("/dev/hidraw3"), firmware.descriptor());
}

TEST_F(HidTransportTest, TenThousandReportsArriveOnceAndInOrder) {
  firmware.last = 10'000;
  firmware.ahead = 50;  // what a machine under load cannot take in time is another test's
  MockHidNode node(bus, firmware, {.rate_hz = 8000, .streaming = false, .most_behind = 50});
  HidTransport transport("/dev/hidraw0");
  node.set_streaming(true);
  for (std::uint32_t i = 0; i < firmware.last; ++i) {
    ASSERT_EQ(transport.read(buffer, 2000), 5) << i;
    ASSERT_EQ(counter(buffer), i);
    firmware.taken = i + 1;
  }
  EXPECT_EQ(transport.read(buffer, 5), 0);
}

TEST_F(HidTransportTest, EveryWriteArrivesOnceAndInOrderWhileReportsStream) {
  MockHidNode node(bus, firmware);
  HidTransport transport("/dev/hidraw0");
  constexpr int kWrites = 1000;
  for (int i = 0; i < kWrites; ++i) {
    ASSERT_GT(transport.read(buffer, 2000), 0);
    ASSERT_TRUE(transport.write(std::array<std::uint8_t, 3>{2, static_cast<std::uint8_t>(i), 9}));
  }
  node.with_device([&] {
    ASSERT_EQ(firmware.written.size(), kWrites);
    for (int i = 0; i < kWrites; ++i) {
      EXPECT_EQ(firmware.written[i], (std::vector<std::uint8_t>{2, static_cast<std::uint8_t>(i), 9}));
    }
  });
}

TEST_F(HidTransportTest, FeaturesAreSetAndRead) {
  MockHidNode node(bus, firmware);
  HidTransport transport("/dev/hidraw0");
  std::array<std::uint8_t, 2> feature{4, 0};
  EXPECT_EQ(transport.get_feature(feature), 2);
  EXPECT_EQ(feature[1], 7);
  EXPECT_TRUE(transport.set_feature(std::array<std::uint8_t, 2>{4, 200}));
  feature = {4, 0};
  EXPECT_EQ(transport.get_feature(feature), 2);
  EXPECT_EQ(feature[1], 200);
  feature = {9, 0};
  EXPECT_EQ(transport.get_feature(feature), -1);
  EXPECT_FALSE(transport.set_feature(std::array<std::uint8_t, 2>{9, 1}));
}

// The kernel's ring has 63 places and drops what comes when it is full: after a stall the oldest reports are left.
TEST_F(HidTransportTest, UnreadReportsAreTheOldestSixtyThree) {
  MockHidNode node(bus, firmware);
  HidTransport transport("/dev/hidraw0");
  ASSERT_EQ(transport.read(buffer, 2000), 5);
  const std::uint32_t first = counter(buffer);
  ASSERT_TRUE(node.wait([&] { return firmware.made > first + 300; }));
  for (std::uint32_t i = 1; i <= 63; ++i) {
    ASSERT_EQ(transport.read(buffer, 0), 5);
    EXPECT_EQ(counter(buffer), first + i);
  }
  ASSERT_EQ(transport.read(buffer, 2000), 5);
  EXPECT_GT(counter(buffer), first + 300);
}

TEST_F(HidTransportTest, ShortAndLongReportsComeAsTheyAre) {
  MockHidNode node(bus, firmware, {.streaming = false});
  HidTransport transport("/dev/hidraw0");
  ASSERT_EQ(transport.read(buffer, 0), 0);
  for (const std::size_t size :
       {std::size_t{1}, std::size_t{4}, std::size_t{200}, std::size_t{4096}, std::size_t{16'384}}) {
    node.inject(std::vector<std::uint8_t>(size, 9));
    EXPECT_EQ(transport.read(buffer, 1000), static_cast<int>(size));
  }
}

TEST_F(HidTransportTest, UnpluggedDeviceEndsReadAndWrite) {
  MockHidNode node(bus, firmware);
  HidTransport transport("/dev/hidraw0");
  ASSERT_GT(transport.read(buffer, 2000), 0);
  node.unplug();
  int n = 0;
  for (int i = 0; i < 100 && n >= 0; ++i) n = transport.read(buffer, 1000);
  EXPECT_EQ(n, -1);
  EXPECT_FALSE(transport.write(std::array<std::uint8_t, 3>{2, 0, 0}));
  EXPECT_TRUE(list_hid_devices().empty());
  EXPECT_THROW(HidTransport{"/dev/hidraw0"}, HidError);

  node.plug(1);
  HidTransport again("/dev/hidraw1");
  EXPECT_GT(again.read(buffer, 2000), 0);
}

TEST_F(HidTransportTest, ErrorsSayWhatToDo) {
  MockHidNode node(bus, firmware, {.identity = {.vendor_id = 0xCAFE, .product_id = 0x0007}});
  node.refuse_open(EACCES);
  const auto message = [](const std::string& path) -> std::string {
    try {
      HidTransport{path};
    } catch (const HidError& error) {
      return error.what();
    }
    return "";
  };
  const std::string denied = message("/dev/hidraw0");
  EXPECT_NE(denied.find("/dev/hidraw0: no permission"), std::string::npos) << denied;
  EXPECT_NE(denied.find("ATTRS{idVendor}==\"cafe\", ATTRS{idProduct}==\"0007\""), std::string::npos) << denied;
  const std::string absent = message("/dev/hidraw9");
  EXPECT_NE(absent.find("/dev/hidraw9: cannot be opened"), std::string::npos) << absent;
  EXPECT_THROW(report_descriptor("/dev/hidraw9"), HidError);
}

}  // namespace
}  // namespace stylet::haptic::hid
