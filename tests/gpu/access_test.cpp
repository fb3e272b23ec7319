// The tracker is the only thing between two passes that share an image: the layers of Debian 12 do not see every
// hazard, so its rules are checked here without a device.
#include "engine/gpu/access.h"

#include <gtest/gtest.h>

namespace stylet::gpu {
namespace {

TEST(AccessTracker, ReadAfterWriteWaitsForTheWriteAndMakesItVisible) {
  AccessTracker tracker;
  tracker.use(kComputeWrite);
  const auto barrier = tracker.use(kDrawSample);
  ASSERT_TRUE(barrier);
  EXPECT_EQ(barrier->src_stages, kComputeWrite.stages);
  EXPECT_EQ(barrier->src_access, kComputeWrite.access);
  EXPECT_EQ(barrier->dst_stages, kDrawSample.stages);
  EXPECT_EQ(barrier->dst_access, kDrawSample.access);
  EXPECT_EQ(barrier->old_layout, VK_IMAGE_LAYOUT_GENERAL);
  EXPECT_EQ(barrier->new_layout, VK_IMAGE_LAYOUT_SHADER_READ_ONLY_OPTIMAL);
}

TEST(AccessTracker, SecondReadInTheSameStageNeedsNothing) {
  AccessTracker tracker;
  tracker.use(kTransferWrite);
  tracker.use(kComputeSample);
  EXPECT_FALSE(tracker.use(kComputeSample));
}

TEST(AccessTracker, ReadInANewStageStillSeesTheWrite) {
  AccessTracker tracker;  // a buffer: no layouts
  const Access write{kComputeWrite.stages, kComputeWrite.access, VK_IMAGE_LAYOUT_UNDEFINED};
  tracker.use(write);
  tracker.use(kIndexRead);
  const auto barrier = tracker.use(kIndirectRead);
  ASSERT_TRUE(barrier);
  EXPECT_EQ(barrier->src_stages, write.stages);
  EXPECT_EQ(barrier->src_access, write.access);
  EXPECT_EQ(barrier->dst_stages, kIndirectRead.stages);
}

TEST(AccessTracker, WriteWaitsForEveryReader) {
  AccessTracker tracker;
  tracker.use(kComputeWrite);
  tracker.use({VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT, VK_ACCESS_2_SHADER_STORAGE_READ_BIT, VK_IMAGE_LAYOUT_GENERAL});
  tracker.use({VK_PIPELINE_STAGE_2_VERTEX_SHADER_BIT, VK_ACCESS_2_SHADER_STORAGE_READ_BIT, VK_IMAGE_LAYOUT_GENERAL});
  const auto barrier = tracker.use(kComputeWrite);
  ASSERT_TRUE(barrier);
  EXPECT_EQ(barrier->src_stages & VK_PIPELINE_STAGE_2_VERTEX_SHADER_BIT, VK_PIPELINE_STAGE_2_VERTEX_SHADER_BIT);
  EXPECT_EQ(barrier->src_stages & VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT, VK_PIPELINE_STAGE_2_COMPUTE_SHADER_BIT);
}

TEST(AccessTracker, WriteAfterReadWithoutAWriteWaitsForTheReader) {
  AccessTracker tracker;
  tracker.use(kIndexRead);
  const auto barrier = tracker.use({kComputeWrite.stages, kComputeWrite.access, VK_IMAGE_LAYOUT_UNDEFINED});
  ASSERT_TRUE(barrier);
  EXPECT_EQ(barrier->src_stages, kIndexRead.stages);
}

TEST(AccessTracker, LayoutChangeBetweenReadsIsAWrite) {
  AccessTracker tracker;
  tracker.use(kComputeWrite);
  tracker.use(kTransferRead);
  const auto barrier = tracker.use(kDrawSample);
  ASSERT_TRUE(barrier);
  EXPECT_EQ(barrier->src_stages & kTransferRead.stages, kTransferRead.stages);
  EXPECT_EQ(barrier->old_layout, VK_IMAGE_LAYOUT_TRANSFER_SRC_OPTIMAL);
  // A third stage must wait for that transition, not only for the compute write long before it.
  const auto third = tracker.use(kComputeSample);
  ASSERT_TRUE(third);
  EXPECT_NE(third->src_stages & kDrawStages, 0u);
}

TEST(AccessTracker, DiscardStartsFromUndefinedButStillWaits) {
  AccessTracker tracker;
  tracker.use(kColourAttachment);
  tracker.use(kTransferRead);
  const auto barrier = tracker.use(kColourAttachment, true);
  ASSERT_TRUE(barrier);
  EXPECT_EQ(barrier->old_layout, VK_IMAGE_LAYOUT_UNDEFINED);
  EXPECT_EQ(barrier->src_stages & kTransferRead.stages, kTransferRead.stages);
}

TEST(AccessTracker, FirstUseOfABufferNeedsNoBarrier) {
  AccessTracker tracker;
  EXPECT_FALSE(tracker.use({kTransferWrite.stages, kTransferWrite.access, VK_IMAGE_LAYOUT_UNDEFINED}));
}

}  // namespace
}  // namespace stylet::gpu
