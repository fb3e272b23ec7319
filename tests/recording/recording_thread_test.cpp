#include "engine/recording/recording.h"
#include "engine/recording/recording_writer.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <thread>

namespace stylet::recording {
namespace {

/// For the other thread. On a busy machine one that yields comes back last, one that slept comes back first.
constexpr std::chrono::microseconds kLetRun{20};

TEST(RecordingWriter, TwoThreadsAndTheBackgroundLoseNothing) {
  const support::TemporaryFolder folder;
  const std::filesystem::path path = folder / "threads.rec";
  constexpr std::uint64_t kSteps = 20'000;
  {
    RecordingWriter writer(path, {}, std::size_t{4} << 20);
    writer.start_background();
    std::thread haptic([&] {
      for (std::uint64_t k = 0; k < kSteps; ++k) {
        HapticStepRecord record;
        record.step = k;
        record.patch_epoch = k ^ 0x5555;
        writer.haptic().add(record);
      }
    });
    std::thread simulation([&] {
      for (std::uint64_t k = 0; k < kSteps / 20; ++k) {
        SimulationStepRecord record;
        record.step = k;
        writer.simulation().add(record);
      }
    });
    haptic.join();
    simulation.join();
    writer.finish();
  }
  const Recording r = read_recording(path);
  EXPECT_TRUE(r.complete()) << r.condition();
  ASSERT_EQ(r.haptic.size(), kSteps);
  ASSERT_EQ(r.simulation.size(), kSteps / 20);
  for (std::uint64_t k = 0; k < kSteps; ++k) {
    ASSERT_EQ(r.haptic[k].step, k);
    ASSERT_EQ(r.haptic[k].patch_epoch, k ^ 0x5555);
  }
}

TEST(ByteRing, KeepsMessagesWholeWhileItWrapsAround) {
  ByteRing ring(256);  // wraps every few messages
  std::thread producer([&] {
    for (std::uint32_t k = 0; k < 30'000; ++k) {
      // Length 1 to 60, then so many bytes of the same value.
      const auto length = static_cast<std::uint8_t>(1 + k % 60);
      std::vector<std::uint8_t> message(1u + length, static_cast<std::uint8_t>(k));
      message[0] = length;
      while (!ring.push(message)) std::this_thread::sleep_for(kLetRun);
    }
  });
  std::vector<std::uint8_t> drained;
  std::uint32_t next = 0;
  int torn = 0;
  while (next < 30'000) {
    drained.clear();
    ring.drain(drained);
    if (drained.empty()) std::this_thread::sleep_for(kLetRun);
    for (std::size_t at = 0; at < drained.size(); at += 1u + drained[at], ++next) {
      if (drained[at] != 1 + next % 60 || at + drained[at] >= drained.size()) {
        ++torn;
        break;
      }
      for (std::size_t i = 1; i <= drained[at]; ++i)
        torn += drained[at + i] != static_cast<std::uint8_t>(next) ? 1 : 0;
    }
    if (torn > 0) break;
  }
  EXPECT_EQ(torn, 0);
  if (torn > 0) std::_Exit(1);  // the producer would wait for ever
  producer.join();
}

}  // namespace
}  // namespace stylet::recording
