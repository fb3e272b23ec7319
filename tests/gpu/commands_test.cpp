#include "engine/gpu/commands.h"

#include <gtest/gtest.h>

#include "shaders/test_fill.comp.h"
#include "shaders/test_sum.comp.h"

namespace stylet::gpu {
namespace {

constexpr std::uint32_t kSide = 20;
constexpr std::uint32_t kCells = kSide * kSide * kSide;
constexpr std::array<std::uint32_t, 3> kGroups{(kSide + 15) / 16, (kSide + 7) / 8, kSide};

struct Push {
  std::uint32_t side = kSide;
  float scale = 0.5F;
};

struct GpuCommands : testing::Test {
  std::atomic<std::uint32_t> messages{0};
  Device device{{.validation = true, .message_counter = &messages}};
  Buffer squares{device, kCells * 4, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT};
  Image gradient{
      device,
      {.width = kSide, .height = kSide, .depth = kSide, .format = VK_FORMAT_R32_SFLOAT, .usage = kStorageUsage}};
  ComputePipeline fill{device,
                       test_fill_comp,
                       {.slots = {Slot::storage_buffer, Slot::storage_image}, .push_constant_bytes = sizeof(Push)}};
};

TEST_F(GpuCommands, KernelWritesBufferAndVolume) {
  run_now(device, [&](Commands& commands) {
    commands.dispatch(fill, {write(0, squares), write(1, gradient)}, kGroups, Push{});
  });
  const auto index_squared = read_back<std::uint32_t>(device, squares);
  const auto values = read_back<float>(device, gradient);
  ASSERT_EQ(index_squared.size(), kCells);
  ASSERT_EQ(values.size(), kCells);
  for (std::uint32_t i = 0; i < kCells; ++i) {
    ASSERT_EQ(index_squared[i], i * i);
    const std::uint32_t x = i % kSide, y = i / kSide % kSide, z = i / kSide / kSide;
    ASSERT_EQ(values[i], 0.5F * static_cast<float>(x + 10 * y + 100 * z));
  }
  EXPECT_EQ(messages.load(), 0u);
}

TEST_F(GpuCommands, PassesInOneSubmissionSeeEachOthersResults) {
  const Sampler nearest(device, {.filter = VK_FILTER_NEAREST});
  const Buffer sums(device, kCells * 4, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT);
  const ComputePipeline sum(device, test_sum_comp,
                            {.slots = {Slot::storage_buffer, Slot::sampled_image, Slot::storage_buffer},
                             .push_constant_bytes = sizeof(Push)});
  FrameRing ring(device);
  for (int frame = 0; frame < 4; ++frame) {
    Commands& commands = ring.next();
    commands.fill(squares, 0xffffffffu);
    commands.clear(gradient, {-1, 0, 0, 0});
    commands.dispatch(fill, {write(0, squares), write(1, gradient)}, kGroups, Push{});
    commands.dispatch(sum, {read(0, squares), sample(1, gradient, nearest), write(2, sums)}, kGroups, Push{});
    commands.submit();
  }
  const auto result = read_back<float>(device, sums);
  for (std::uint32_t i = 0; i < kCells; ++i) {
    const std::uint32_t x = i % kSide, y = i / kSide % kSide, z = i / kSide / kSide;
    ASSERT_EQ(result[i], static_cast<float>(i * i) + 0.5F * static_cast<float>(x + 10 * y + 100 * z)) << i;
  }
  EXPECT_EQ(messages.load(), 0u);
}

TEST_F(GpuCommands, UploadComesBackUnchanged) {
  std::vector<float> volume(kCells);
  for (std::uint32_t i = 0; i < kCells; ++i) volume[i] = static_cast<float>(i) - 17.25F;
  run_now(device, [&](Commands& commands) { commands.upload(gradient, std::as_bytes(std::span(volume))); });
  EXPECT_EQ(read_back<float>(device, gradient), volume);
  EXPECT_THROW(
      run_now(device,
              [&](Commands& commands) { commands.upload(gradient, std::as_bytes(std::span(volume).first(7))); }),
      GpuError);
  EXPECT_EQ(messages.load(), 0u);
}

TEST_F(GpuCommands, UploadLargerThanAStagingBlockWorks) {
  std::vector<std::uint32_t> words(3u << 20);
  for (std::uint32_t i = 0; i < words.size(); ++i) words[i] = i * 2654435761u;
  const Buffer buffer(device, words.size() * 4, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT);
  run_now(device, [&](Commands& commands) {
    commands.upload(buffer, std::as_bytes(std::span(words).first(1000)));
    commands.upload(buffer, std::as_bytes(std::span(words)));
  });
  EXPECT_EQ(read_back<std::uint32_t>(device, buffer), words);
  EXPECT_EQ(messages.load(), 0u);
}

TEST_F(GpuCommands, TimestampsOfNamedSpansAreNotNegative) {
  Timestamps timestamps(device, 4);
  run_now(device, [&](Commands& commands) {
    timestamps.reset(commands);
    timestamps.mark(commands, "start");
    commands.dispatch(fill, {write(0, squares), write(1, gradient)}, kGroups, Push{});
    timestamps.mark(commands, "fill");
  });
  const auto spans = timestamps.read();
  ASSERT_EQ(spans.size(), 1u);
  EXPECT_EQ(spans[0].name, "fill");
  EXPECT_GE(spans[0].seconds, 0);
  EXPECT_LT(spans[0].seconds, 60);
  EXPECT_EQ(messages.load(), 0u);
}

TEST_F(GpuCommands, ImageBeyondTheDevicesLimitsIsRefusedWithASentence) {
  EXPECT_THROW(Image(device, {.width = 1u << 20, .height = 1u << 20}), GpuError);
  EXPECT_EQ(messages.load(), 0u);
}

// Proof that silence means something: a hazard on purpose is reported.
TEST_F(GpuCommands, ValidationSeesAMissingBarrier) {
  const Buffer other(device, kCells * 4, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT);
  run_now(device, [&](Commands& commands) {
    const VkBufferCopy region{0, 0, kCells * 4};
    vkCmdFillBuffer(commands.handle(), squares.handle(), 0, VK_WHOLE_SIZE, 1);
    vkCmdCopyBuffer(commands.handle(), squares.handle(), other.handle(), 1, &region);
  });
  EXPECT_GT(messages.load(), 0u);
}

}  // namespace
}  // namespace stylet::gpu
