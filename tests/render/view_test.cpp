// Where frames go: composed for a video, shown in a window (skipped without a display), and the camera's orbit.
#include "engine/picture/panes.h"
#include "engine/picture/smooth_edges.h"
#include "engine/view/composition.h"
#include "engine/view/offscreen.h"
#include "engine/view/orbit.h"
#include "engine/view/window.h"

#include <gtest/gtest.h>
#include <imgui.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

namespace stylet::view {
namespace {

bool overlap(const picture::Pane& a, const picture::Pane& b) {
  return a.x < b.x + b.width && b.x < a.x + a.width && a.y < b.y + b.height && b.y < a.y + a.height;
}

TEST(Panes, NeverOverlapNorLeaveTheFrame) {
  for (int width : {1, 64, 333, 1280, 1921})
    for (int height : {1, 48, 720, 1081})
      for (bool with_plot : {true, false}) {
        const picture::PaneLayout layout = picture::PaneLayout::of(width, height, with_plot);
        for (const picture::Pane& pane : {layout.scene, layout.ultrasound, layout.plot}) {
          EXPECT_GE(pane.x, 0);
          EXPECT_GE(pane.y, 0);
          EXPECT_LE(pane.x + pane.width, width);
          EXPECT_LE(pane.y + pane.height, height);
        }
        EXPECT_FALSE(overlap(layout.scene, layout.ultrasound));
        EXPECT_FALSE(overlap(layout.ultrasound, layout.plot));
      }
}

TEST(Panes, PictureKeepsItsAspectAndMeanWhenItShrinks) {
  picture::Picture stripes(400, 100);
  for (int y = 0; y < 100; ++y)
    for (int x = 0; x < 400; ++x)
      for (int c = 0; c < 3; ++c) stripes.at(x, y)[c] = x % 2 == 0 ? 200 : 0;
  picture::Picture frame(90, 90, {10, 20, 30, 255});
  picture::draw_fitted(frame, {0, 0, 90, 90}, stripes);
  const picture::Pane fit = picture::fitted({0, 0, 90, 90}, 400, 100);
  EXPECT_EQ(fit.width, 90);
  EXPECT_EQ(fit.height, 23);
  // One-pixel stripes blend to their mean instead of aliasing; round about, the frame is as it was.
  for (int y = fit.y; y < fit.y + fit.height; ++y)
    for (int x = 2; x < 88; ++x) EXPECT_NEAR(frame.at(x, y)[0], 100, 12);
  EXPECT_EQ(frame.at(45, fit.y - 1)[1], 20);
  EXPECT_EQ(frame.at(45, fit.y + fit.height)[2], 30);
}

TEST(Panes, PictureOfTheRightSizeIsCopiedExactly) {
  picture::Picture picture(40, 30);
  for (std::size_t i = 0; i < picture.rgba.size(); ++i) picture.rgba[i] = static_cast<std::uint8_t>(i * 37);
  picture::Picture frame(40, 30);
  picture::draw_fitted(frame, {0, 0, 40, 30}, picture);
  EXPECT_EQ(frame.rgba, picture.rgba);
}

TEST(Panes, ComposedFrameShowsEachPictureInItsPane) {
  const picture::Picture frame =
      picture::compose(640, 360, picture::Picture(100, 90, {200, 0, 0, 255}),
                       picture::Picture(60, 40, {0, 200, 0, 255}), picture::Picture(60, 40, {0, 0, 200, 255}));
  const picture::PaneLayout layout = picture::PaneLayout::of(640, 360, true);
  const auto centre = [&](const picture::Pane& pane) {
    return frame.at(pane.x + pane.width / 2, pane.y + pane.height / 2);
  };
  EXPECT_EQ(centre(layout.scene)[0], 200);
  EXPECT_EQ(centre(layout.ultrasound)[1], 200);
  EXPECT_EQ(centre(layout.plot)[2], 200);
}

TEST(Orbit, TurnsRoundWhatIsLookedAt) {
  const content::Camera camera{.eye = {0, 0, 0.5}, .look_at = {0, 0.1, 0}, .up = Eigen::Vector3d::UnitY()};
  const double distance = (camera.eye - camera.look_at).norm();
  const content::Camera turned = orbited(camera, 0.7, 0.2);
  EXPECT_NEAR((turned.eye - turned.look_at).norm(), distance, 1e-12);
  EXPECT_GT(turned.eye.x(), 0.1);
  EXPECT_GT(turned.eye.y(), camera.eye.y());
  EXPECT_NEAR((orbited(turned, -0.7, -0.2).eye - camera.eye).norm(), 0, 1e-12);
  const content::Camera above = orbited(camera, 0, 10);  // never over the pole
  EXPECT_LT((above.eye - above.look_at).normalized().y(), 0.999);
  EXPECT_NEAR((orbited(camera, 0, 0, 0.5).eye - camera.look_at).norm(), distance / 2, 1e-12);
}

/// Share of a pixel whose middle is at (x, y), of side 1, below the line y = at + slope x: the mean over a grid.
double below(double x, double y, double at, double slope) {
  int count = 0;
  for (int j = 0; j < 16; ++j)
    for (int i = 0; i < 16; ++i) {
      const double u = x + (i + 0.5) / 16 - 0.5, v = y + (j + 0.5) / 16 - 0.5;
      count += v > at + slope * u ? 1 : 0;
    }
  return count / 256.0;
}

TEST(Composition, AnEnlargedSceneHasNoStepsInItsEdgesAndAnotherStaysAsItIs) {
  std::atomic<std::uint32_t> messages{0};
  {
    gpu::Device device({.validation = true, .message_counter = &messages});
    const auto image = [&](std::uint32_t size) {
      return gpu::Image(device, {.width = size,
                                 .height = size,
                                 .format = VK_FORMAT_R8G8B8A8_SRGB,
                                 .usage = gpu::kTargetUsage | VK_IMAGE_USAGE_TRANSFER_DST_BIT});
    };
    constexpr int kSmall = 60, kLarge = 100;
    constexpr double kRatio = static_cast<double>(kLarge) / kSmall;
    const gpu::Image scene = image(kSmall), same = image(kSmall), large = image(kLarge);
    Composition composition(device);
    for (const double slope : {0.18, 0.45, 0.8}) {
      picture::Picture steps(kSmall, kSmall, {40, 40, 40, 255});  // as drawn without antialiasing
      for (int y = 0; y < kSmall; ++y)
        for (int x = 0; x < kSmall; ++x)
          if (y + 0.5 > 8.3 + slope * (x + 0.5)) std::fill_n(steps.at(x, y), 3, std::uint8_t{200});
      const auto shown_in = [&](const gpu::Image& target) {
        const int size = static_cast<int>(target.extent().width);
        gpu::run_now(device, [&](gpu::Commands& commands) {
          commands.upload(scene, std::as_bytes(std::span(steps.rgba)));
          composition.record(commands, target, {.scene = &scene, .layout = {.scene = {0, 0, size, size}}});
        });
        return read_picture(device, target);
      };
      EXPECT_EQ(shown_in(same).rgba, steps.rgba);
      // Off a true edge, in pixels of the scene: the way that column's sum of brightness says the edge is at.
      const picture::Picture shown = shown_in(large);
      double sum = 0;
      for (int x = 10; x < kLarge - 10; ++x) {
        double bright = 0, wanted = 0;
        for (int y = 0; y < kLarge; ++y) {
          bright += (shown.at(x, y)[0] - 40) / 160.0;
          wanted += below(x + 0.5, y + 0.5, 8.3 * kRatio, slope);
        }
        sum += std::pow((bright - wanted) / kRatio, 2);
      }
      const double off = std::sqrt(sum / (kLarge - 20));
      EXPECT_LT(off, 0.2) << "slope " << slope;
    }
  }
  EXPECT_EQ(messages.load(), 0u);
}

TEST(Composition, AnEnlargedSceneThatLeavesBarsIsSmoothedTooAndTheyAreTheSame) {
  gpu::Device device;
  const auto image = [&](std::uint32_t width, std::uint32_t height) {
    return gpu::Image(device, {.width = width,
                               .height = height,
                               .format = VK_FORMAT_R8G8B8A8_SRGB,
                               .usage = gpu::kTargetUsage | VK_IMAGE_USAGE_TRANSFER_DST_BIT});
  };
  // As a window of 1024 x 640 drawn at 0.85: rounded, its shape is not quite the window's.
  const gpu::Image scene = image(87, 54), same = image(103, 54), large = image(104, 64);
  picture::Picture steps(87, 54, {40, 40, 40, 255});
  for (int y = 0; y < 54; ++y)
    for (int x = 0; x < 87; ++x)
      if (y + 0.5 > 8.3 + 0.18 * (x + 0.5)) std::fill_n(steps.at(x, y), 3, std::uint8_t{200});
  Composition composition(device);
  const auto shown_in = [&](const gpu::Image& target) {
    const VkExtent3D size = target.extent();
    gpu::run_now(device, [&](gpu::Commands& commands) {
      commands.upload(scene, std::as_bytes(std::span(steps.rgba)));
      composition.record(commands, target,
                         {.scene = &scene,
                          .layout = {.scene = {0, 0, static_cast<int>(size.width), static_cast<int>(size.height)}}});
    });
    return read_picture(device, target);
  };
  const picture::Picture beside = shown_in(same);
  EXPECT_EQ(composition.pass_times().size(), 1U) << "not enlarged";
  const picture::Picture shown = shown_in(large);
  EXPECT_EQ(composition.pass_times().size(), 2U) << "smoothed";
  EXPECT_EQ(*beside.at(0, 20), 14) << "a bar";
  EXPECT_TRUE(std::equal(shown.at(103, 20), shown.at(103, 20) + 4, beside.at(0, 20))) << "the same bar";
  EXPECT_EQ(*shown.at(50, 4), 40);
  EXPECT_EQ(*shown.at(50, 60), 200);
}

TEST(Composition, TellsWhatSmoothingCostsBesideTheRest) {
  gpu::Device device;
  const auto image = [&](std::uint32_t size) {
    return gpu::Image(device, {.width = size,
                               .height = size,
                               .format = VK_FORMAT_R8G8B8A8_SRGB,
                               .usage = gpu::kTargetUsage | VK_IMAGE_USAGE_TRANSFER_DST_BIT});
  };
  const gpu::Image scene = image(256), same = image(256), large = image(400);
  Composition composition(device);
  EXPECT_TRUE(composition.pass_times().empty());
  const auto passes_into = [&](const gpu::Image& target) {
    const int size = static_cast<int>(target.extent().width);
    gpu::run_now(device, [&](gpu::Commands& commands) {
      commands.clear(scene, {0.5F, 0.5F, 0.5F, 1});
      composition.record(commands, target, {.scene = &scene, .layout = {.scene = {0, 0, size, size}}});
    });
    std::vector<std::string> names;
    for (const gpu::Timestamps::Span& pass : composition.pass_times()) {
      EXPECT_GE(pass.seconds, 0) << pass.name;
      names.push_back(pass.name);
    }
    return names;
  };
  using Names = std::vector<std::string>;
  EXPECT_EQ(passes_into(large), (Names{"smooth_edges", "compose"}));
  EXPECT_EQ(passes_into(same), Names{"compose"}) << "it is not smoothed";
}

TEST(Composition, BytesOfAnUltrasoundImageMeanSrgbWhateverItsFormatSaysAndHoweverTheSceneIsDrawn) {
  std::atomic<std::uint32_t> messages{0};
  {
    gpu::Device device({.validation = true, .message_counter = &messages});
    const gpu::ImageSettings whole{.width = 120,
                                   .height = 90,
                                   .format = VK_FORMAT_R8G8B8A8_SRGB,
                                   .usage = gpu::kTargetUsage | VK_IMAGE_USAGE_TRANSFER_DST_BIT};
    gpu::ImageSettings smaller = whole, swapped = whole;
    smaller.width = 80;
    smaller.height = 60;
    swapped.format = VK_FORMAT_B8G8R8A8_SRGB;
    const gpu::Image scene(device, whole), small(device, smaller), target(device, whole),
        as_on_screens(device, swapped);
    const gpu::Image plain(device, {.width = 60, .height = 60, .usage = gpu::kStorageUsage});
    const gpu::Image encoded(device, {.width = 60,
                                      .height = 60,
                                      .format = VK_FORMAT_R8G8B8A8_SRGB,
                                      .usage = gpu::kTextureUsage | VK_IMAGE_USAGE_TRANSFER_SRC_BIT});
    const picture::Picture red(120, 90, {180, 0, 20, 255}), small_red(80, 60, {180, 0, 20, 255});
    picture::Picture steps(60, 60, {0, 0, 0, 255});
    for (int y = 0; y < 60; ++y)
      for (int x = 0; x < 60; ++x) std::fill_n(steps.at(x, y), 3, static_cast<std::uint8_t>(4 * x));
    gpu::run_now(device, [&](gpu::Commands& commands) {
      commands.upload(scene, std::as_bytes(std::span(red.rgba)));
      commands.upload(small, std::as_bytes(std::span(small_red.rgba)));
      commands.upload(plain, std::as_bytes(std::span(steps.rgba)));
      commands.upload(encoded, std::as_bytes(std::span(steps.rgba)));
    });
    Composition composition(device);
    for (const gpu::Image* of_scene : {&scene, &small}) {
      const auto composed = [&](const gpu::Image& ultrasound, const gpu::Image& onto) {
        gpu::run_now(device, [&](gpu::Commands& commands) {
          composition.record(commands, onto,
                             {.scene = of_scene,
                              .ultrasound = &ultrasound,
                              .layout = {.scene = {0, 0, 120, 90}, .ultrasound = {80, 10, 30, 30}, .plot = {}}});
        });
        picture::Picture picture(120, 90);
        picture.rgba = gpu::read_back<std::uint8_t>(device, onto, 0);
        if (onto.format() == VK_FORMAT_B8G8R8A8_SRGB)
          for (std::size_t i = 0; i < picture.rgba.size(); i += 4) std::swap(picture.rgba[i], picture.rgba[i + 2]);
        return picture;
      };
      const picture::Picture shown = composed(encoded, target);
      EXPECT_EQ(shown.rgba, composed(plain, target).rgba);
      EXPECT_EQ(shown.rgba, composed(encoded, as_on_screens).rgba);
      EXPECT_EQ(shown.at(0, 0)[0], 180) << "the scene fills the frame";
      EXPECT_EQ(shown.at(0, 0)[2], 20);
      EXPECT_EQ(shown.at(119, 89)[0], 180);
      EXPECT_NEAR(shown.at(94, 25)[1], 4 * 29, 3) << "the middle of the image";
    }
  }
  EXPECT_EQ(messages.load(), 0u);
}

struct OnDisplay : testing::Test {
  void SetUp() override {
    if (std::getenv("DISPLAY") == nullptr && std::getenv("WAYLAND_DISPLAY") == nullptr)
      GTEST_SKIP() << "no display; run under xvfb-run -a -s \"-screen 0 1280x1024x24\"";
  }
};

TEST_F(OnDisplay, WindowShowsBothPanesAndFollowsItsSize) {
  std::atomic<std::uint32_t> messages{0};
  {
    Display display;
    gpu::Device device(
        {.validation = true, .message_counter = &messages, .window_extensions = display.vulkan_extensions()});
    // A 3-D view of the sRGB value 180 red, an ultrasound image whose bytes are 90 grey, and a blue plot.
    const gpu::Image scene(device, {.width = 320,
                                    .height = 240,
                                    .format = VK_FORMAT_R8G8B8A8_SRGB,
                                    .usage = gpu::kTargetUsage | VK_IMAGE_USAGE_TRANSFER_DST_BIT});
    const gpu::Image ultrasound(device, {.width = 160, .height = 120, .usage = gpu::kStorageUsage});
    const picture::Picture red(320, 240, {180, 0, 0, 255}), grey(160, 120, {90, 90, 90, 255}),
        blue(50, 40, {0, 0, 140, 255});
    gpu::run_now(device, [&](gpu::Commands& commands) {
      commands.upload(scene, std::as_bytes(std::span(red.rgba)));
      commands.upload(ultrasound, std::as_bytes(std::span(grey.rgba)));
    });
    Window window(display, device, {.width = 400, .height = 300, .frames_per_second = 0, .capture = true});
    const auto show = [&](int frames) {
      for (int i = 0; i < frames; ++i) {
        EXPECT_FALSE(window.poll().close);
        window.present(scene, &ultrasound, &blue);
      }
    };
    const auto check_panes = [&] {
      const picture::Picture shown = window.last_frame();
      ASSERT_EQ(shown.width, window.width());
      const picture::PaneLayout layout = picture::PaneLayout::of(shown.width, shown.height, true);
      const auto centre = [&](const picture::Pane& p) { return shown.at(p.x + p.width / 2, p.y + p.height / 2); };
      EXPECT_NEAR(centre(layout.scene)[0], 180, 2);
      EXPECT_NEAR(centre(layout.ultrasound)[1], 90, 2);
      EXPECT_NEAR(centre(layout.plot)[2], 140, 2);
    };
    show(5);
    EXPECT_EQ(window.width(), 400);
    check_panes();
    window.resize(520, 340);
    for (int i = 0; i < 200 && window.width() != 520; ++i) show(1);
    EXPECT_EQ(window.width(), 520);
    EXPECT_EQ(window.height(), 340);
    show(3);
    check_panes();
  }
  EXPECT_EQ(messages.load(), 0u);
}

TEST_F(OnDisplay, PanelsLieOverTheSceneInAWindowOfAnySize) {
  std::atomic<std::uint32_t> messages{0};
  {
    Display display;
    gpu::Device device(
        {.validation = true, .message_counter = &messages, .window_extensions = display.vulkan_extensions()});
    const gpu::Image scene(device, {.width = 320,
                                    .height = 240,
                                    .format = VK_FORMAT_R8G8B8A8_SRGB,
                                    .usage = gpu::kTargetUsage | VK_IMAGE_USAGE_TRANSFER_DST_BIT});
    const picture::Picture red(320, 240, {180, 0, 0, 255});
    gpu::run_now(device,
                 [&](gpu::Commands& commands) { commands.upload(scene, std::as_bytes(std::span(red.rgba))); });
    Window window(display, device, {.width = 400, .height = 300, .frames_per_second = 0, .capture = true});
    EXPECT_GT(window.content_scale(), 0);
    Overlay overlay(device, window.format(), window.content_scale());
    const auto show = [&] {
      EXPECT_FALSE(window.poll().close);
      overlay.begin({.width = window.width(), .height = window.height()});
      ImGui::SetNextWindowPos({0, 0});
      ImGui::SetNextWindowSize({100, 100});
      ImGui::Begin("panel", nullptr, ImGuiWindowFlags_NoDecoration);
      ImGui::End();
      window.present(scene, {scene, {window.width() - 60, 0, 60, 45}}, overlay);
    };
    const auto check = [&] {
      const picture::Picture shown = window.last_frame();
      ASSERT_EQ(shown.width, window.width());
      EXPECT_LT(shown.at(50, 50)[0], 120) << "the panel is dark";
      EXPECT_NEAR(shown.at(shown.width / 2, shown.height / 2)[0], 180, 2) << "nothing lies there";
    };
    for (int i = 0; i < 4; ++i) show();
    check();
    window.resize(520, 390);
    for (int i = 0; i < 200 && window.width() != 520; ++i) show();
    EXPECT_EQ(window.width(), 520);
    for (int i = 0; i < 4; ++i) show();
    check();
  }
  EXPECT_EQ(messages.load(), 0u);
}

TEST_F(OnDisplay, AWindowIsNotLargerThanTheScreen) {
  Display display;
  gpu::Device device({.window_extensions = display.vulkan_extensions()});
  constexpr int kLarge = 8192;
  const Window window(display, device,
                      {.width = kLarge,
                       .height = kLarge,
                       .least_width = kLarge / 2,
                       .least_height = kLarge / 2,
                       .frames_per_second = 0});
  const WindowPlacement placement = window.placement();
  EXPECT_LT(placement.width, kLarge / 2);
  EXPECT_LT(placement.height, kLarge / 2);
  EXPECT_GT(placement.width, 0);
  EXPECT_EQ(window.width(), placement.width) << "it is drawn in the size that it has";
}

TEST_F(OnDisplay, DeviceWithoutWindowExtensionsIsRefused) {
  Display display;
  gpu::Device device;
  EXPECT_THROW(Window(display, device), gpu::GpuError);
}

TEST(Display, WithoutOneSaysToGoHeadless) {
  if (std::getenv("DISPLAY") != nullptr || std::getenv("WAYLAND_DISPLAY") != nullptr)
    GTEST_SKIP() << "there is a display";
  try {
    const Display display;
    FAIL() << "opened a display that is not there";
  } catch (const gpu::GpuError& error) {
    EXPECT_NE(std::string(error.what()).find("--view headless"), std::string::npos) << error.what();
  }
}

/// A half-plane, white where nx x + ny y > d: each pixel by its middle alone, or by the mean of 16 x 16 points.
picture::Picture half_plane(double nx, double ny, double d, int points) {
  picture::Picture picture(96, 64);
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      int in = 0;
      for (int k = 0; k < points * points; ++k) {
        const double px = x + (k % points + 0.5) / points, py = y + (k / points + 0.5) / points;
        in += nx * px + ny * py > d ? 1 : 0;
      }
      for (int c = 0; c < 3; ++c) picture.at(x, y)[c] = static_cast<std::uint8_t>(40 + 160 * in / (points * points));
    }
  }
  return picture;
}

TEST(SmoothEdges, BringsSlantingEdgesNearToWhatManySamplesShow) {
  for (const auto& [nx, ny, d] :
       {std::tuple(1.0, 0.17, 50.0), {0.12, 1.0, 30.0}, {0.6, 0.5, 45.0}, {-0.3, 1.0, 10.0}}) {
    const picture::Picture exact = half_plane(nx, ny, d, 16);
    picture::Picture smooth = half_plane(nx, ny, d, 1);
    const auto error = [&](const picture::Picture& picture) {
      double sum = 0;
      for (int y = 1; y + 1 < picture.height; ++y)
        for (int x = 1; x + 1 < picture.width; ++x) sum += std::pow(picture.at(x, y)[0] - exact.at(x, y)[0], 2);
      return std::sqrt(sum);
    };
    const double before = error(smooth);
    picture::smooth_edges(smooth);
    // Least is gained near 45 degrees, where edges have no length to go by.
    EXPECT_LT(error(smooth), 0.6 * before) << nx << " " << ny;
  }
  picture::Picture flat(32, 32, {90, 120, 60, 255});
  for (int i = 0; i < 32; ++i) flat.at(i, 16)[1] = 124;  // no edge: half a step of a screen
  const picture::Picture before = flat;
  picture::smooth_edges(flat);
  EXPECT_EQ(flat.rgba, before.rgba);
}

}  // namespace
}  // namespace stylet::view
