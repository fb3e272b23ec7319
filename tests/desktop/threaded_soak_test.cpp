// A session in real time for minutes, recorded, drawn and watched: memory stays as it is but for the force curve,
// nothing is lost.
//
// STYLET_THREADED_SOAK_MINUTES: 5 if unset. Run by tools/test.sh --all.
#include "engine/desktop/desktop_view.h"
#include "engine/readers/scenario.h"
#include "engine/recording/recording.h"
#include "engine/session/live_session.h"
#include "engine/session/recorded_stylus.h"
#include "engine/view/overlay.h"
#include "tests/session/soak.h"
#include "tests/support/temporary_folder.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <thread>
#include <vector>

namespace stylet::desktop {
namespace {

constexpr double kPressEvery = 2;      // s
constexpr double kFramePeriod = 0.25;  // s: drawing is to leave the loops their time on two cores

/// A motion without end, with a button that goes down and up.
class PressingHand final : public haptic::Device {
public:
  explicit PressingHand(tests::RepeatedMotion motion) : motion_(std::move(motion)) {}
  std::string name() const override { return motion_.name(); }
  haptic::DeviceLimits limits() const override { return motion_.limits(); }
  haptic::StylusSample read(double now_s) override {
    haptic::StylusSample sample = motion_.read(now_s);
    sample.buttons = static_cast<std::uint32_t>(now_s / kPressEvery) % 2;
    changes_ += sample.buttons != before_ ? 1 : 0;
    before_ = sample.buttons;
    return sample;
  }
  void write(const Eigen::Vector3d&, const Eigen::Vector3d&) override {}
  /// Haptic thread, or after it has ended.
  int changes() const { return changes_; }

private:
  tests::RepeatedMotion motion_;
  std::uint32_t before_ = 0;
  int changes_ = 0;
};

TEST(ThreadedSoak, MemoryStaysNothingIsLostAndValidationIsSilent) {
  const double duration_s = 60 * tests::minutes("STYLET_THREADED_SOAK_MINUTES", 5);
  const support::TemporaryFolder folder;
  const content::Scene scene = readers::load_scene(readers::find_scenario("liver_biopsy"));
  PressingHand hand(tests::RepeatedMotion(session::recorded_stylus(scene.motion), 1 / scene.rates.simulation_hz));
  std::atomic<std::uint32_t> messages{0};
  gpu::Device device({.validation = true, .message_counter = &messages});
  session::LiveSession live(scene, hand, {.duration_s = duration_s, .recording = folder / "session.rec"});
  view::Overlay overlay(device, VK_FORMAT_R8G8B8A8_SRGB);
  const gpu::Image image(device, {.width = 480,
                                  .height = 300,
                                  .format = VK_FORMAT_R8G8B8A8_SRGB,
                                  .usage = gpu::kTargetUsage | VK_IMAGE_USAGE_TRANSFER_DST_BIT});
  DesktopView desktop(device, scene, live, {.arrangement = {.scanner = scanner::ScannerConsole(scene.probe)}});
  // MiB, every 10 s of the second half: by then all has been seen and solved once. Without the force curve: every
  // step of it goes into memory reserved at the start, which gets its pages as it is used.
  std::vector<double> resident;
  const double curve_mib_per_s = scene.rates.haptic_hz * sizeof(figures::ForceSample) / 1048576;
  live.start();
  for (double next_s = 0; !live.finished(); next_s += kFramePeriod) {
    overlay.begin({.width = 480, .height = 300, .dt_s = kFramePeriod});
    ASSERT_TRUE(desktop.handle({}));
    desktop.draw(480, 300, kFramePeriod);
    gpu::run_now(device, [&](gpu::Commands& commands) {
      commands.clear(image, {0, 0, 0, 1});
      overlay.draw(commands, image);
    });
    const double now_s = live.time_s();
    if (now_s > 0.5 * duration_s + 10 * static_cast<double>(resident.size())) {
      resident.push_back(tests::resident_mib() - now_s * curve_mib_per_s);
      std::printf("%5.0f s  resident %.1f MiB and the force curve\n", now_s, resident.back());
      std::fflush(stdout);
    }
    if (now_s < next_s) std::this_thread::sleep_for(std::chrono::duration<double>(next_s - now_s));
  }
  const session::RunStatistics run = live.stop();
  EXPECT_EQ(messages.load(), 0u) << "validation messages";
  EXPECT_EQ(
      run.needle_flags & (physics::kNeedleRowOverflow | physics::kNeedleSolveFailed | physics::kNeedleNonFinite), 0u);
  if (resident.size() > 2) {
    std::printf("grown by %.1f MiB in %.0f s\n", tests::growth(resident),
                10 * static_cast<double>(resident.size() - 1));
    EXPECT_LT(tests::growth(resident), 4);
  }

  const recording::Recording recording = recording::read_recording(folder / "session.rec");
  EXPECT_TRUE(recording.complete()) << recording.condition();
  EXPECT_EQ(recording.haptic.size(), run.haptic.steps);
  EXPECT_EQ(recording.simulation.size(), run.simulation.steps);
  const auto presses = std::count_if(recording.events.begin(), recording.events.end(),
                                     [](const recording::EventRecord& event) { return event.name == "buttons"; });
  EXPECT_EQ(presses, hand.changes());
  EXPECT_NEAR(static_cast<double>(presses), duration_s / kPressEvery, 2);
  std::printf("%.0f s, %llu haptic steps, %llu deadlines missed, %zu events\n", run.duration_s,
              static_cast<unsigned long long>(run.haptic.steps),
              static_cast<unsigned long long>(run.haptic.missed_deadlines), recording.events.size());
}

}  // namespace
}  // namespace stylet::desktop
