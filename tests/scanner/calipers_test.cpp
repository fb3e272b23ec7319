// Distances on the image, against what is known of probes and of the image's own pixels.
#include "engine/gpu/device.h"
#include "engine/picture/png_bytes.h"
#include "engine/scanner/live_scanner.h"
#include "engine/view/offscreen.h"
#include "tests/ultrasound/phantom.h"

#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

namespace stylet::scanner {
namespace {

using Act = Point::Act;

TEST(Calipers, ClickAndClickOrDragSetTwoPoints) {
  Calipers calipers;
  calipers.press({0, 0.01});
  calipers.release({0.0001, 0.01}, 0.001);
  EXPECT_TRUE(calipers.under_way()) << "a click";
  EXPECT_TRUE(calipers.distances().empty()) << "its second point is not set";
  calipers.move({0, 0.02});
  EXPECT_NEAR(calipers.measures()[0].distance(), 0.01, 1e-12) << "follows the pointer";
  calipers.press({0.03, 0.05});
  calipers.release({0.03, 0.05}, 0.001);
  calipers.move({1, 1});
  ASSERT_EQ(calipers.distances().size(), 1U);
  EXPECT_NEAR(calipers.distances()[0], 0.05, 1e-12) << "3, 4, 5";
  EXPECT_EQ(distance_text(calipers.measures()[0]), "50.0 mm");
  calipers.press({0, 0});
  calipers.move({0, 0.004});
  calipers.release({0, 0.006}, 0.001);
  ASSERT_EQ(calipers.distances().size(), 2U);
  EXPECT_NEAR(calipers.distances()[1], 0.006, 1e-12) << "a drag";
}

TEST(Calipers, AreTakenAwayOneByOneAndTheOldestGoesWhereThereAreTooMany) {
  Calipers calipers;
  calipers.remove_last();
  for (int i = 0; i < 9; ++i) {
    calipers.press({0, 0});
    calipers.press({0.001 * (i + 1), 0});
  }
  ASSERT_EQ(calipers.distances().size(), Calipers::kMost);
  EXPECT_NEAR(calipers.distances().front(), 0.002, 1e-12);
  calipers.press({0, 0});
  calipers.remove_last();
  EXPECT_FALSE(calipers.under_way());
  calipers.remove_last();
  EXPECT_NEAR(calipers.distances().back(), 0.008, 1e-12);
  calipers.clear();
  EXPECT_TRUE(calipers.measures().empty());
}

/// Echo everywhere: the image is lit to its edges.
content::Scene lit_block(bool convex) {
  content::Scene scene = test::block_phantom([](const Eigen::Vector3f&) { return test::kBright; });
  scene.probe.convex = convex;
  scene.probe.scan_lines = 96;
  scene.probe.samples = 256;
  return scene;
}

/// First and last of what is lit in a row or a column of the bare image, as shares of it.
struct Lit {
  double first = -1, last = -1;
};
template <typename At>
Lit lit(int count, const At& brightness) {
  Lit lit;
  for (int i = 0; i < count; ++i) {
    if (brightness(i) < 8) continue;
    if (lit.first < 0) lit.first = static_cast<double>(i) / count;
    lit.last = static_cast<double>(i + 1) / count;
  }
  return lit;
}
Lit lit_row(const picture::Picture& image, int y) {
  const int scale = image.width - 20;  // its marks are lit too
  return lit(image.width, [&](int x) { return x < scale ? image.at(x, y)[0] : 0; });
}
Lit lit_column(const picture::Picture& image, int x) {
  return lit(image.height, [&](int y) { return image.at(x, y)[0]; });
}

/// Gets the bare images.
struct Bare final : ImageWatcher {
  void imaged(const state::FrameState&, const ultrasound::SectorGeometry&, const picture::Picture& bare) override {
    image = bare;
  }
  picture::Picture image;
};

struct Measuring {
  explicit Measuring(const content::Scene& measured)
      : scene(measured), scanner(device, scene, ScannerConsole(scene.probe)) {
    scanner.watch(&bare);
    scanner.draw(state);
  }
  /// Between two points of the screen, shares of its size. @return m
  double measure(double from_x, double from_y, double to_x, double to_y) {
    scanner.apply(Point{Act::press, from_x, from_y}, 0);
    scanner.apply(Point{Act::release, to_x, to_y}, 0);
    return scanner.calipers().distances().back();
  }
  double metres_per_pixel() const { return scanner.in_view().metres_per_pixel; }

  gpu::Device device;
  content::Scene scene;
  state::FrameState state = test::at_rest(scene);
  Bare bare;
  LiveScanner scanner;
};

TEST(Calipers, OfALinearProbeMeasureItsFaceAndDepthAtAnyScale) {
  content::Scene scene = lit_block(false);
  scene.probe.width = 0.04;
  Measuring rig(scene);
  for (const double depth : {0.04, 0.06, 0.1}) {
    rig.scanner.apply(SetDepth{depth}, 0);
    rig.scanner.draw(rig.state);
    const Lit row = lit_row(rig.bare.image, 240), column = lit_column(rig.bare.image, 320);
    const double pixels = 3 * rig.metres_per_pixel();  // an edge to a pixel each, the last sample's cell
    EXPECT_NEAR(rig.measure(row.first, 0.5, row.last, 0.5), 0.04, pixels) << depth;
    EXPECT_NEAR(rig.measure(0.5, column.first, 0.5, column.last), depth, pixels) << depth;
    EXPECT_NEAR(rig.measure(row.first, column.first, row.last, column.last), std::hypot(0.04, depth), 2 * pixels);
  }
}

TEST(Calipers, OfAConvexProbeMeasureItsSectorAtAnyScale) {
  content::Scene scene = lit_block(true);
  scene.probe.radius = 0.05;
  scene.probe.field_of_view = 0.9;
  Measuring rig(scene);
  for (const double depth : {0.08, 0.12}) {
    rig.scanner.apply(SetDepth{depth}, 0);
    rig.scanner.draw(rig.state);
    const Lit column = lit_column(rig.bare.image, 320);
    const double pixels = 3 * rig.metres_per_pixel();
    EXPECT_NEAR(rig.measure(0.5, column.first, 0.5, column.last), depth, pixels);
    // The sector is widest where its outer lines end: a chord of the circle of all that is `depth` from the face.
    double widest = 0;
    for (int y = 0; y < 480; ++y) {
      const Lit row = lit_row(rig.bare.image, y);
      if (row.first >= 0 && row.last - row.first > widest) {
        widest = row.last - row.first;
        rig.measure(row.first, (y + 0.5) / 480, row.last, (y + 0.5) / 480);
      }
    }
    EXPECT_NEAR(rig.scanner.calipers().distances().back(), 2 * (0.05 + depth) * std::sin(0.45), 2 * pixels) << depth;
  }
}

TEST(Calipers, StayOnAFrozenImageAndGoWithIt) {
  Measuring rig(lit_block(true));
  rig.scanner.apply(Freeze{}, 0);
  rig.scanner.draw(rig.state);
  const std::uint64_t images = rig.scanner.images();
  const auto screen = [&] {
    rig.state.time_s += 1;
    rig.scanner.draw(rig.state);
    return view::read_picture(rig.device, rig.scanner.screen()).rgba;
  };
  const auto plain = screen();
  const double measured = rig.measure(0.45, 0.4, 0.55, 0.4);
  EXPECT_NE(screen(), plain) << "it is shown";
  rig.scanner.apply(SetDepth{0.02, true}, 0);
  screen();
  EXPECT_EQ(rig.scanner.calipers().distances(), std::vector{measured});
  EXPECT_EQ(rig.scanner.images(), images) << "the image stays";
  rig.scanner.apply(RemoveMeasure{}, 0);
  EXPECT_TRUE(rig.scanner.calipers().measures().empty());
  rig.measure(0.45, 0.4, 0.55, 0.4);
  rig.scanner.apply(Freeze{}, 0);
  EXPECT_TRUE(rig.scanner.calipers().measures().empty()) << "what was measured is gone";
}

TEST(Calipers, MakeNoImage) {
  Measuring rig(lit_block(false));
  const std::uint64_t images = rig.scanner.images();
  rig.scanner.apply(Point{Act::press, 0.4, 0.4}, 0);
  for (int i = 0; i < 5; ++i) {
    rig.scanner.apply(Point{Act::move, 0.4 + 0.01 * i, 0.4}, 0);
    rig.scanner.draw(rig.state);
  }
  EXPECT_EQ(rig.scanner.images(), images) << "a pointer that moves costs none";
}

TEST(SavedImages, AreTheScreenWithItsMeasures) {
  Measuring rig(lit_block(true));
  rig.scanner.apply(SaveImage{}, 0);
  rig.scanner.draw(rig.state);
  EXPECT_EQ(rig.scanner.note(), "no image can be saved now") << "nobody keeps them";
  SavedImages saved;
  rig.scanner.keep_images(&saved);
  rig.scanner.say("", 0);
  rig.scanner.draw(rig.state);
  const picture::Picture plain = view::read_picture(rig.device, rig.scanner.screen());
  rig.scanner.apply(SaveImage{}, 0);
  ASSERT_EQ(saved.size(), 1U);
  EXPECT_EQ(saved[0].png, picture::png_bytes(plain)) << "what the trainee sees";
  EXPECT_EQ(saved[0].depth, rig.scanner.console().controls().depth);
  EXPECT_EQ(saved[0].metres_per_pixel, rig.metres_per_pixel());
  rig.scanner.draw(rig.state);
  EXPECT_EQ(rig.scanner.note(), "image saved as ultrasound-01.png");
  const double measured = rig.measure(0.4, 0.4, 0.6, 0.4);
  rig.scanner.apply(SaveImage{}, 0);
  ASSERT_EQ(saved.size(), 2U);
  EXPECT_EQ(saved[1].distances, std::vector{measured});
  EXPECT_NE(saved[1].png, saved[0].png);
  saved.resize(kMostSavedImages);
  rig.scanner.apply(SaveImage{}, 0);
  EXPECT_EQ(saved.size(), kMostSavedImages);
  EXPECT_EQ(saved_image_name(12), "ultrasound-12.png");
}

}  // namespace
}  // namespace stylet::scanner
