#include "engine/figures/plot.h"

#include "engine/figures/canvas.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace stylet::figures {
namespace {

constexpr Colour kWhite{255, 255, 255};
constexpr Colour kBlack{0, 0, 0};

picture::Picture white(int width, int height) {
  picture::Picture image(width, height);
  Canvas(image).fill({0, 0, static_cast<double>(width), static_cast<double>(height)}, kWhite);
  return image;
}

/// Ink of a black drawing on white, in whole black pixels.
double ink(const picture::Picture& image) {
  double sum = 0;
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) sum += (255 - image.rgba[i]) / 255.0;
  return sum;
}

TEST(Canvas, InkOfALineIsItsAreaAtAnyAngle) {
  for (const double angle : {0.0, 0.3, 0.785, 1.2, 1.5707}) {
    picture::Picture image = white(200, 200);
    const PixelPoint end{100.3 + 80 * std::cos(angle), 20.7 + 80 * std::sin(angle)};
    Canvas(image).line({100.3, 20.7}, end, 3, kBlack);
    // A rectangle of 80 x 3 and two half discs. Coverage is sampled at pixel centres, so at 45 degrees, where these
    // lie in few distances from the line, it is 2 % off.
    const double area = 80 * 3 + std::acos(-1.0) * 1.5 * 1.5;
    EXPECT_NEAR(ink(image), area, 0.025 * area) << angle;
  }
}

TEST(Canvas, StrokeThatCrossesItselfIsNotDrawnTwice) {
  picture::Picture image = white(60, 60);
  const Colour half{0, 0, 0, 128};
  const PixelPoint cross[] = {{10, 10}, {50, 50}, {50, 10}, {10, 50}, {50, 50}};
  Canvas(image).polyline(cross, 5, half);
  for (std::size_t i = 0; i < image.rgba.size(); i += 4) ASSERT_GE(image.rgba[i], 126);
  EXPECT_EQ(image.at(30, 30)[0], 127);
}

TEST(Canvas, NothingIsDrawnOutsideImageOrClip) {
  picture::Picture image = white(40, 40);
  Canvas canvas(image);
  canvas.clip({10, 10, 20, 20});
  canvas.line({-1e6, 15}, {1e6, 15}, 4, kBlack);
  canvas.disc({12, 12}, 30, kBlack);
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 40; ++x) {
      const bool inside = x >= 10 && x < 20 && y >= 10 && y < 20;
      ASSERT_EQ(image.at(x, y)[0] < 255, inside) << x << ' ' << y;
    }
  }
  canvas.unclip();
  const PixelPoint gap[] = {{std::nan(""), 3}, {5, 5}, {std::numeric_limits<double>::infinity(), 5}};
  canvas.polyline(gap, 2, kBlack);
  EXPECT_EQ(image.at(5, 5)[0], 255);
}

TEST(Canvas, TurnedTextIsTheSameTextReadingUpwards) {
  const Font font = Font::load();
  if (font.empty()) GTEST_SKIP() << font.warning();
  picture::Picture upright = white(120, 40), turned = white(40, 120);
  Canvas(upright).text(font, "Fl 7", {10, 20}, 24, kBlack);
  Canvas(turned).text(font, "Fl 7", {20, 110}, 24, kBlack, Align::left, /*turned=*/true);
  EXPECT_GT(ink(upright), 50);
  for (int y = 0; y < 40; ++y) {
    for (int x = 0; x < 120; ++x) ASSERT_EQ(upright.at(x, y)[0], turned.at(y, 119 - x)[0]) << x << ' ' << y;
  }
}

TEST(Canvas, AlignmentPutsTheTextWhereItSays) {
  const Font font = Font::load();
  if (font.empty()) GTEST_SKIP() << font.warning();
  const auto columns = [&](Align align) {
    picture::Picture image = white(200, 40);
    Canvas(image).text(font, "HHHH", {100, 20}, 20, kBlack, align);
    int first = 200, last = -1;
    for (int x = 0; x < 200; ++x) {
      for (int y = 0; y < 40; ++y) {
        if (image.at(x, y)[0] > 128) continue;
        first = std::min(first, x);
        last = std::max(last, x);
      }
    }
    return std::pair(first, last);
  };
  const double width = font.width("HHHH", 20);
  EXPECT_NEAR(columns(Align::left).first, 100, 3);
  EXPECT_NEAR(columns(Align::right).second, 100, 3);
  EXPECT_NEAR(columns(Align::centre).first, 100 - width / 2, 3);
  EXPECT_NEAR(columns(Align::centre).second, 100 + width / 2, 3);
}

TEST(Font, MissingFileGivesAWarningAndNoText) {
  const Font font = Font::load("/no/such/font.ttf");
  EXPECT_TRUE(font.empty());
  EXPECT_NE(font.warning().find("/no/such/font.ttf"), std::string::npos);
  picture::Picture image = white(20, 20);
  Canvas(image).text(font, "abc", {10, 10}, 12, kBlack);
  EXPECT_EQ(ink(image), 0);
  EXPECT_EQ(font.width("abc", 12), 0);
}

TEST(Plot, TicksAreRoundAndWithinTheRange) {
  for (const auto& [min, max] : {std::pair(0.0, 1.0), {-3.7, 12.2}, {0.0013, 0.0019}, {-1e9, 3e9}, {99.9, 100.1}}) {
    for (const int count : {2, 5, 10}) {
      const std::vector<double> ticks = nice_ticks(min, max, count);
      ASSERT_LE(ticks.size(), static_cast<std::size_t>(count));
      for (const double t : ticks) {
        EXPECT_GE(t, min - 1e-9 * (max - min));
        EXPECT_LE(t, max + 1e-9 * (max - min));
      }
      if (ticks.size() < 2) continue;
      const double step = ticks[1] - ticks[0];
      const double mantissa = step / std::pow(10, std::floor(std::log10(step * (1 + 1e-6))));
      EXPECT_TRUE(std::min({std::abs(mantissa - 1), std::abs(mantissa - 2), std::abs(mantissa - 5)}) < 1e-3) << step;
    }
  }
  EXPECT_GE(nice_ticks(0, 1, 10).size(), 5u);
  EXPECT_TRUE(nice_ticks(1, 1, 5).empty());
  EXPECT_TRUE(nice_ticks(0, std::nan(""), 5).empty());
}

/// Centre of the pixels near a colour.
PixelPoint centre_of(const picture::Picture& image, Colour colour, int* count = nullptr) {
  double sx = 0, sy = 0;
  int n = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const std::uint8_t* p = image.at(x, y);
      if (std::abs(p[0] - colour.r) + std::abs(p[1] - colour.g) + std::abs(p[2] - colour.b) > 12) continue;
      sx += x + 0.5;
      sy += y + 0.5;
      ++n;
    }
  }
  if (count != nullptr) *count = n;
  return {sx / n, sy / n};
}

PlotPanel dot_panel(double x, double y) {
  PlotPanel panel;
  panel.x = {.label = "x", .min = 0, .max = 10};
  panel.y = {.label = "y", .min = -1, .max = 1};
  panel.dots = {{x, y, {255, 0, 0}}};
  return panel;
}

TEST(Plot, PointsAreMappedLinearlyOntoTheAxes) {
  const Font font = Font::load();
  const PlotSettings settings{.width = 600, .height = 400};
  const auto place = [&](double x, double y) {
    const PlotPanel panel = dot_panel(x, y);
    return centre_of(draw_plot({&panel, 1}, settings, font), {255, 0, 0});
  };
  const PixelPoint a = place(2, -0.5), b = place(5, 0), c = place(8, 0.5);
  EXPECT_GT(b.x - a.x, 100);
  EXPECT_NEAR(b.x - a.x, c.x - b.x, 0.5);
  EXPECT_GT(a.y - b.y, 50);  // up is more
  EXPECT_NEAR(a.y - b.y, b.y - c.y, 0.5);
}

TEST(Plot, LongCurveLooksTheSameAsAFewOfItsPoints) {
  // A curve of 200,000 points is reduced to what the pixels show; a spike of a single point must stay.
  PlotPanel dense;
  dense.x = {.label = "", .min = 0, .max = 1};
  dense.y = {.label = "", .min = 0, .max = 1};
  PlotSeries series{.label = {}, .x = {}, .y = {}, .colour = {255, 0, 0}, .width = 3};
  for (int i = 0; i <= 200'000; ++i) {
    series.x.push_back(i / 200'000.0);
    series.y.push_back(i == 100'000 ? 0.9 : 0.2);
  }
  dense.series = {series};
  PlotPanel sparse = dense;
  sparse.series[0].x = {0, 0.5, 0.5, 0.5, 1};
  sparse.series[0].y = {0.2, 0.2, 0.9, 0.2, 0.2};
  const PlotSettings settings{.width = 500, .height = 300};
  int dense_count = 0, sparse_count = 0;
  centre_of(draw_plot({&dense, 1}, settings, Font()), {255, 0, 0}, &dense_count);
  centre_of(draw_plot({&sparse, 1}, settings, Font()), {255, 0, 0}, &sparse_count);
  EXPECT_GT(sparse_count, 1000);
  EXPECT_NEAR(dense_count, sparse_count, 0.03 * sparse_count);
}

TEST(Plot, DegenerateDataStillGivesAFigure) {
  const Font font = Font::load();
  const double nan = std::nan("");
  const double inf = std::numeric_limits<double>::infinity();
  for (const auto& [x, y] : {std::pair<std::vector<double>, std::vector<double>>{{}, {}},
                             {{1}, {2}},
                             {{1, 1}, {0, 0}},
                             {{nan, nan}, {nan, 1}},
                             {{0, 1, 2}, {1e308, -1e308, inf}},
                             {{1e9, 1e9 + 1e-7}, {5e-324, 0}},
                             {{0, 1, 2}, {1}}}) {
    PlotPanel panel;
    panel.series = {{.label = "a", .x = x, .y = y, .colour = {255, 0, 0}}};
    panel.markers = {{nan, "n"}, {1, "one"}};
    panel.dots = {{inf, 0, {}}};
    const picture::Picture image = draw_plot({&panel, 1}, {.width = 300, .height = 200}, font);
    EXPECT_EQ(image.rgba.size(), 300u * 200 * 4);
  }
  PlotPanel panel;
  EXPECT_EQ(draw_plot({&panel, 1}, {.width = 20, .height = 10}, font).width, 20);
}

}  // namespace
}  // namespace stylet::figures
