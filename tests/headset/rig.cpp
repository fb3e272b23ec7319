#include "tests/headset/rig.h"

#include <cstdlib>

namespace stylet::tests {

void use_mock_runtime() {
  setenv("XR_RUNTIME_JSON", STYLET_MOCK_OPENXR_MANIFEST, 1);
}

void use_no_runtime() {
  setenv("XR_RUNTIME_JSON", "/nonexistent/runtime.json", 1);
}

Rig::Rig(const mock::Script& script, const headset::HeadsetSettings& settings) {
  use_mock_runtime();
  mock::play(script);
  runtime_.emplace();
  device_.emplace(gpu::DeviceSettings{.message_counter = &messages_, .maker = &*runtime_});
  grey_.emplace(two_eyes(*device_, script.width, script.height,
                         std::vector<std::uint8_t>(8UL * script.width * script.height, 128)));
  headset_.emplace(*runtime_, *device_, settings);
}

std::optional<headset::HeadsetFrame> Rig::turn(const gpu::Image* picture) {
  headset_->poll();
  const std::optional<headset::HeadsetFrame> frame = headset_->begin_frame();
  if (frame) headset_->end_frame(picture != nullptr ? picture : &*grey_);
  return frame;
}

headset::HeadsetFrame Rig::turn_until_focused() {
  for (int i = 0; i < 10; ++i) {
    const auto frame = turn();
    if (frame && headset_->focused()) return *frame;
  }
  ADD_FAILURE() << "the session never came to its focus: " << headset_->reason();
  return {};
}

void Rig::expect_clean(std::size_t refused) {
  headset_.reset();
  grey_.reset();
  device_.reset();
  runtime_.reset();
  EXPECT_EQ(mock::report().errors.size(), refused);
  if (refused == 0)
    for (const std::string& error : mock::report().errors) ADD_FAILURE() << error;
  for (const std::string& leak : mock::report().leaks) ADD_FAILURE() << "left behind: " << leak;
  EXPECT_EQ(messages_.load(), 0U) << "Vulkan validation";
}

gpu::Image two_eyes(gpu::Device& device, std::uint32_t width, std::uint32_t height,
                    const std::vector<std::uint8_t>& both) {
  gpu::Image image(device, {.width = width,
                            .height = height,
                            .layers = 2,
                            .format = VK_FORMAT_R8G8B8A8_SRGB,
                            .usage = VK_IMAGE_USAGE_TRANSFER_SRC_BIT | VK_IMAGE_USAGE_TRANSFER_DST_BIT});
  gpu::run_now(device, [&](gpu::Commands& commands) { commands.upload(image, std::as_bytes(std::span(both))); });
  return image;
}

Eigen::Isometry3d isometry(const XrPosef& pose) {
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  out.translate(Eigen::Vector3d(pose.position.x, pose.position.y, pose.position.z));
  out.rotate(Eigen::Quaterniond(pose.orientation.w, pose.orientation.x, pose.orientation.y, pose.orientation.z)
                 .normalized());
  return out;
}

}  // namespace stylet::tests
