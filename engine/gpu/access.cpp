#include "engine/gpu/access.h"

namespace stylet::gpu {

bool Access::writes() const {
  constexpr VkAccessFlags2 kWrites = VK_ACCESS_2_SHADER_STORAGE_WRITE_BIT | VK_ACCESS_2_SHADER_WRITE_BIT |
                                     VK_ACCESS_2_TRANSFER_WRITE_BIT | VK_ACCESS_2_COLOR_ATTACHMENT_WRITE_BIT |
                                     VK_ACCESS_2_DEPTH_STENCIL_ATTACHMENT_WRITE_BIT | VK_ACCESS_2_HOST_WRITE_BIT |
                                     VK_ACCESS_2_MEMORY_WRITE_BIT;
  return (access & kWrites) != 0;
}

std::optional<Dependency> AccessTracker::use(const Access& next, bool discard) {
  // A layout change writes the image, so it must wait for readers like any write.
  const bool changes_layout = next.layout != VK_IMAGE_LAYOUT_UNDEFINED && next.layout != layout_;
  const bool ordered_write = next.writes() || changes_layout;
  const bool fresh = write_stages_ == 0 && read_stages_ == 0;
  const bool visible = (next.stages & ~read_stages_) == 0 && (next.access & ~read_access_) == 0;

  std::optional<Dependency> barrier;
  if (ordered_write ? !(fresh && !changes_layout) : (write_stages_ != 0 && !visible)) {
    Dependency d;
    d.src_stages = write_stages_ | (ordered_write ? read_stages_ : VkPipelineStageFlags2{0});
    d.src_access = write_access_;
    d.old_layout = discard ? VK_IMAGE_LAYOUT_UNDEFINED : layout_;
    d.dst_stages = next.stages;
    d.dst_access = next.access;
    d.new_layout = next.layout != VK_IMAGE_LAYOUT_UNDEFINED ? next.layout : layout_;
    barrier = d;
  }

  if (next.writes()) {
    write_stages_ = next.stages;
    write_access_ = next.access;
    read_stages_ = 0;
    read_access_ = 0;
  } else if (changes_layout) {
    // The transition itself is the last write; it is ordered before, and visible to, the stages of `next` only.
    write_stages_ = next.stages;
    write_access_ = VK_ACCESS_2_NONE;
    read_stages_ = next.stages;
    read_access_ = next.access;
  } else {
    read_stages_ |= next.stages;
    read_access_ |= next.access;
  }
  if (next.layout != VK_IMAGE_LAYOUT_UNDEFINED) layout_ = next.layout;
  return barrier;
}

void AccessTracker::assume(const Access& state) {
  layout_ = state.layout;
  write_stages_ = state.stages;
  write_access_ = state.access;
  read_stages_ = 0;
  read_access_ = 0;
}

}  // namespace stylet::gpu
