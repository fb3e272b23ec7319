#include "tools/bench/view.h"

#include "engine/desktop/desktop_view.h"
#include "engine/files/error.h"
#include "engine/readers/scenario.h"
#include "engine/session/live_session.h"
#include "engine/session/recorded_stylus.h"
#include "engine/view/composition.h"
#include "engine/view/overlay.h"
#include "tools/bench/samples.h"

#include <fmt/format.h>

#include <cstdio>
#include <ctime>
#include <filesystem>
#include <functional>
#include <string>
#include <utility>
#include <vector>

namespace stylet::bench {
namespace {

constexpr int kWidth = 1280, kHeight = 720;         // of the window
constexpr int kEyeWidth = 1440, kEyeHeight = 1600;  // of an eye, as headsets of today ask for about
constexpr double kFrom = 8;                         // s: the needle is in the liver
constexpr double kFrame = 1.0 / 30;                 // s of the session between two pictures

/// Of all threads of the process, ms.
double processor_time_ms() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

using Passes = std::vector<gpu::Timestamps::Span>;

/// Frames of one kind.
class Cost {
public:
  explicit Cost(std::string name) : name_(std::move(name)) {}

  /// @param draw  draws a frame and returns when it is done
  void measure(const std::function<Passes()>& draw) {
    const double before = processor_time_ms();
    Passes passes;
    wall_.time([&] { passes = draw(); });
    cpu_.add(processor_time_ms() - before);
    double sum = 0;
    for (const gpu::Timestamps::Span& pass : passes) {
      of(pass.name).add(1e3 * pass.seconds);
      sum += 1e3 * pass.seconds;
    }
    gpu_.add(sum);
  }

  void add_to(Report& report, const std::string& note) const {
    report.add({name_ + ".cpu", cpu_.average(), "ms", {}, {}, {}, note});
    report.add({name_ + ".gpu", gpu_.median(), "ms", {}, {}, {}, "time stamps"});
    for (const auto& [pass, times] : passes_) {
      report.add({name_ + ".gpu." + pass,
                  times.median(),
                  "ms",
                  {},
                  {},
                  {},
                  fmt::format("in {} of {} frames", times.count(), gpu_.count())});
    }
    report.add(
        {name_ + ".fps", 1e6 / wall_.average(), "1/s", {}, {}, {}, "of these pictures alone, one after the other"});
  }

private:
  Samples& of(const std::string& pass) {
    for (auto& [name, samples] : passes_) {
      if (name == pass) return samples;
    }
    return passes_.emplace_back(pass, Samples{}).second;
  }

  std::string name_;
  Samples cpu_, gpu_, wall_;  // wall_ in us
  std::vector<std::pair<std::string, Samples>> passes_;
};

/// A folder for the recording that nobody reads.
class ScratchFolder {
public:
  ScratchFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "stylet-bench-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) throw files::ContentError(name + ": cannot be made; set TMPDIR");
    path_ = name;
  }
  ~ScratchFolder() {
    std::error_code error;
    std::filesystem::remove_all(path_, error);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  std::filesystem::path operator/(const char* name) const { return path_ / name; }

private:
  std::filesystem::path path_;
};

}  // namespace

Report bench_view(const BenchOptions& options) {
  gpu::Device device;
  const int frames = options.quick ? 5 : 40;
  const auto say = [](const std::string& what) { std::fputs(("bench view: " + what + "\n").c_str(), stderr); };
  say(fmt::format("on {}, {} frames a case", device.identity().name, frames));
  const content::Scene scene = readers::load_scene(readers::find_scenario("liver_biopsy"));
  haptic::RecordedDevice hand = session::recorded_stylus(scene.motion);
  const ScratchFolder folder;
  session::LiveSession session(scene, hand,
                               {.duration_s = 1e3, .lockstep = true, .recording = folder / "session.rec"});
  session.start();
  say(fmt::format("{:.0f} s of the session", kFrom));
  for (double t = 0; t < kFrom; t += 1.0 / 30) session.advance(1.0 / 30);

  const auto made = [&](int width, int height) {
    return gpu::ImageSettings{.width = static_cast<std::uint32_t>(width),
                              .height = static_cast<std::uint32_t>(height),
                              .format = VK_FORMAT_R8G8B8A8_SRGB,
                              .usage = gpu::kTargetUsage | VK_IMAGE_USAGE_TRANSFER_DST_BIT};
  };
  const gpu::Image target(device, made(kWidth, kHeight));
  view::Overlay overlay(device, target.format());
  view::Composition composition(device);
  desktop::DesktopView desktop(device, scene, session,
                               {.arrangement = {.scanner = scanner::ScannerConsole(scene.probe)}});
  double frame_s = 0.02;  // that a frame is said to have taken
  const auto draw = [&]() -> Passes {
    overlay.begin({.width = kWidth, .height = kHeight, .dt_s = kFrame});
    desktop.handle({});
    desktop.draw(kWidth, kHeight, frame_s);
    gpu::run_now(device, [&](gpu::Commands& commands) {
      composition.record(
          commands, target,
          {.scene = &desktop.scene(),
           .ultrasound = &desktop.scanner_screen(),
           .overlay = &overlay,
           .layout = {.scene = {0, 0, kWidth, kHeight}, .ultrasound = desktop.scanner_place(), .plot = {}}});
    });
    Passes passes = desktop.pass_times();
    for (gpu::Timestamps::Span& pass : composition.pass_times()) passes.push_back(std::move(pass));
    return passes;
  };
  Report report;
  const std::string on = fmt::format("on {}", device.identity().name);
  say("the window");
  for (int i = 0; i < 3; ++i) draw();  // compiles the pipelines
  Cost window("view.window");
  for (int i = 0; i < frames; ++i) {
    session.advance(kFrame);
    window.measure(draw);
  }
  window.add_to(report, fmt::format("{} x {}, {}", kWidth, kHeight, on));

  say("nothing moves");
  Cost still("view.still");
  for (int i = 0; i < frames; ++i) still.measure(draw);
  still.add_to(report, "the same while the session stands: its pictures are put together, no more");

  say("fewer pixels");
  frame_s = 0.5;  // so slow that it is drawn as coarsely as it ever is
  const auto width = [&] { return desktop.scene().settings().width; };
  for (int i = 0; i < 20; ++i) draw();
  Cost coarse("view.coarse");
  for (int i = 0; i < frames; ++i) {
    session.advance(kFrame);
    coarse.measure(draw);
  }
  coarse.add_to(report, fmt::format("the window where frames are slow: {} pixels wide, enlarged", width()));

  state::FrameState state = session.frames().make_frame();
  const auto next = [&] {
    session.advance(kFrame);
    session.frames().sample(session.time_s(), state);
  };
  say("the scanner");
  scanner::LiveScanner scanner(device, scene, scanner::ScannerConsole(scene.probe));
  Cost ultrasound("view.ultrasound");
  for (int i = -1; i < frames; ++i) {
    next();
    next();  // long enough for the scanner's next image to be due
    const auto image = [&] {
      scanner.draw(state);
      return scanner.pass_times();
    };
    i < 0 ? void(image()) : ultrasound.measure(image);
  }
  ultrasound.add_to(report, fmt::format("{} x {}, preset clinical", 640, 480));

  say("stereo");
  const int eye_width = options.quick ? kEyeWidth / 4 : kEyeWidth,
            eye_height = options.quick ? kEyeHeight / 4 : kEyeHeight;
  render::Renderer eyes(device, scene, {.width = eye_width, .height = eye_height, .views = 2});
  Cost stereo("view.stereo");
  for (int i = -1; i < std::max(frames / 8, 3); ++i) {
    next();
    const auto both = [&] {
      eyes.render(state, scene.camera, {.plane = scanner.in_view(), .screen = &scanner.screen()});
      return eyes.stage_times();
    };
    i < 0 ? void(both()) : stereo.measure(both);
  }
  stereo.add_to(report, fmt::format("2 x {} x {}, 4 samples a pixel", eye_width, eye_height));
  session.stop();
  return report;
}

}  // namespace stylet::bench
