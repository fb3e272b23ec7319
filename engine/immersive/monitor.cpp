#include "engine/immersive/monitor.h"

namespace stylet::immersive {
namespace {

constexpr double kScale = 1.9;

}  // namespace

Monitor::Monitor(gpu::Device& device)
    : device_(device),
      picture_(device, {.width = kWidth,
                        .height = kHeight,
                        .format = VK_FORMAT_R8G8B8A8_SRGB,
                        .usage = gpu::kTargetUsage | VK_IMAGE_USAGE_TRANSFER_DST_BIT}),
      overlay_(device, VK_FORMAT_R8G8B8A8_SRGB, kScale),
      ring_(device) {}

Monitor::~Monitor() {
  device_.settle();  // the last frame may still be drawn, or seen by the renderer
}

void Monitor::begin(double dt_s) {
  overlay_.begin({.width = kWidth, .height = kHeight, .dt_s = dt_s});
}

void Monitor::end() {
  gpu::Commands& commands = ring_.next();
  commands.clear(picture_, {0.006F, 0.009F, 0.012F, 1});
  overlay_.draw(commands, picture_);
  commands.submit();
}

}  // namespace stylet::immersive
