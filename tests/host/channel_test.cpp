#include "haptic/host/channel.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <array>
#include <cstdint>
#include <cstring>
#include <memory>
#include <thread>

namespace stylet::haptic::host {
namespace {

TEST(ReportRing, GivesEachReportOnceAndInOrder) {
  const auto ring = std::make_unique<ReportRing>();
  std::uint64_t next = 0;
  std::array<std::uint8_t, 31> out{};
  EXPECT_EQ(ring->take(next, out), 0u);
  for (std::uint8_t k = 1; k <= 40; ++k) {
    const std::array<std::uint8_t, 3> report{k, 2, 3};
    ASSERT_TRUE(ring->put(report));
  }
  for (std::uint8_t k = 1; k <= 40; ++k) {
    ASSERT_EQ(ring->take(next, out), 3u);
    EXPECT_EQ(out[0], k);
  }
  EXPECT_EQ(ring->take(next, out), 0u);
  EXPECT_FALSE(ring->wait(next, 0));
  EXPECT_FALSE(ring->put(std::array<std::uint8_t, 32>{}));
}

TEST(ReportRing, OvertakenItGoesOnWithWhatThereIs) {
  const auto ring = std::make_unique<ReportRing>();
  std::uint64_t next = 0;
  std::array<std::uint8_t, 31> out{};
  for (int k = 1; k <= 1000; ++k)
    ASSERT_TRUE(ring->put(std::array<std::uint8_t, 2>{static_cast<std::uint8_t>(k), 0}));
  ASSERT_EQ(ring->take(next, out), 2u);
  EXPECT_EQ(next, 1000u - ReportRing::kMost + 2);
  EXPECT_EQ(out[0], static_cast<std::uint8_t>(next));
}

/// Each report holds one number four times: a torn one would hold two.
TEST(ReportRing, NothingTornComesOut) {
  const auto ring = std::make_unique<ReportRing>();
  constexpr std::uint32_t kReports = 200'000;
  std::jthread writer([&] {
    for (std::uint32_t k = 1; k <= kReports; ++k) {
      std::array<std::uint8_t, 28> report{};
      for (int part = 0; part < 7; ++part) std::memcpy(report.data() + 4 * part, &k, 4);
      ring->put(report);
    }
  });
  std::uint64_t next = 0;
  std::array<std::uint8_t, 31> out{};
  std::uint32_t last = 0;
  while (last < kReports) {
    if (ring->take(next, out) == 0) {
      ring->wait(next, 10'000'000);
      continue;
    }
    std::uint32_t first = 0;
    std::memcpy(&first, out.data(), 4);
    ASSERT_GT(first, last);
    for (int part = 0; part < 7; ++part) ASSERT_EQ(std::memcmp(&first, out.data() + 4 * part, 4), 0);
    last = first;
  }
}

TEST(SharedChannel, AnotherVersionIsRefused) {
  const SharedChannel channel;
  channel->version.store(Channel::kVersion + 1);
  EXPECT_THROW(SharedChannel{dup(channel.file())}, std::runtime_error);
  channel->version.store(Channel::kVersion);
  const SharedChannel other(dup(channel.file()));
  put_text(channel->name, std::string(1000, 'x'));
  EXPECT_EQ(text_of(other->name).size(), Channel::kText - 1);
}

}  // namespace
}  // namespace stylet::haptic::host
