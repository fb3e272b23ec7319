// A small session led by mouse and keyboard, and its pictures without a window.
#pragma once

#include "engine/desktop/desktop_view.h"
#include "engine/procedures/biopsy/plan.h"
#include "engine/readers/scenario.h"
#include "engine/session/live_session.h"
#include "engine/training/training_session.h"
#include "engine/view/overlay.h"
#include "tests/readers/small_scenario.h"
#include "tests/support/temporary_folder.h"

#include <atomic>
#include <cstdint>
#include <limits>

namespace stylet::desktop {

inline const content::Scene& small_scene() {
  static const content::Scene scene = [] {
    readers::test::SmallScenario small;
    small.scenario["labels"]["spacing_mm"] = 4;
    content::Scene loaded = readers::load_scene(small.write());
    loaded.probe.scan_lines = 48;
    loaded.probe.samples = 128;
    auto plan = std::make_shared<procedures::biopsy::Plan>();
    plan->samples = 3;
    loaded.exercise.plan = plan;
    return loaded;
  }();
  return scene;
}

inline haptic::MouseWorkspace workspace() {
  return {.entry = {0.1, 0, 0.05}, .axis = -Eigen::Vector3d::UnitZ(), .right = Eigen::Vector3d::UnitX()};
}

/// A mouse that can be pulled out.
class PluggedMouse final : public haptic::Device {
public:
  std::string name() const override { return mouse.name(); }
  haptic::DeviceLimits limits() const override { return mouse.limits(); }
  haptic::StylusSample read(double now_s) override {
    haptic::StylusSample sample = mouse.read(now_s);
    sample.valid = sample.valid && plugged;
    return sample;
  }
  void write(const Eigen::Vector3d& force, const Eigen::Vector3d& torque) override { mouse.write(force, torque); }

  haptic::MouseDevice mouse{workspace()};
  std::atomic<bool> plugged{true};
};

/// Started; stopped where it goes.
struct Running {
  explicit Running(gpu::Device& device, int width = 160, int height = 120, bool with_course = false)
      : live(small_scene(), stylus,
             {.duration_s = std::numeric_limits<double>::infinity(),
              .recording = folder / "session.rec",
              .probe = &probe,
              .listeners = {&course.watch()}}),
        image(device, {.width = static_cast<std::uint32_t>(width),
                       .height = static_cast<std::uint32_t>(height),
                       .format = VK_FORMAT_R8G8B8A8_SRGB,
                       .usage = gpu::kTargetUsage | VK_IMAGE_USAGE_TRANSFER_DST_BIT}),
        desktop(device, small_scene(), live,
                {.mouse = &stylus.mouse,
                 .probe = &probe,
                 .arrangement = {.scanner = scanner::ScannerConsole(small_scene().probe)},
                 .course = with_course ? &course : nullptr}) {
    live.start();
  }
  ~Running() { stop(); }
  /// @return of the session
  session::RunStatistics stop() {
    if (stopped) return {};
    stopped = true;
    course.end(live);
    return live.stop();
  }

  support::TemporaryFolder folder;
  PluggedMouse stylus;
  session::HeldProbe probe{small_scene()};
  training::TrainingSession course{small_scene(), {}};
  session::LiveSession live;
  gpu::Image image;
  DesktopView desktop;
  bool stopped = false;
};

}  // namespace stylet::desktop
