#include "engine/desktop/layout.h"

#include <algorithm>
#include <cmath>

namespace stylet::desktop {
namespace {

// Ems.
constexpr double kMargin = 0.8;
constexpr double kColumn = 22.6;      // of the panels on the left
constexpr double kCourse = 17;        // height at most
constexpr double kForce = 15.4;       // height
constexpr double kFlatForce = 12;     // where the instructor's panel is above it
constexpr double kMiddle = 36;        // width at most
constexpr double kInstructor = 17;    // height, on the left
constexpr double kScannerLeast = 21;  // height that the knobs take

// Text of a window of 1280 x 720, and how far a window's size may change it.
constexpr double kWidth = 1280;
constexpr double kHeight = 720;
constexpr double kSmallest = 0.8;
constexpr double kLargest = 1.5;

int pixels(double length) {
  return static_cast<int>(std::floor(length));
}

picture::Pane pane(double x, double y, double width, double height) {
  return {pixels(x), pixels(y), std::max(pixels(width), 0), std::max(pixels(height), 0)};
}

}  // namespace

double text_scale(int width, int height, double content_scale) {
  const double by_size = std::min(width / kWidth, height / kHeight) / content_scale;
  return content_scale * std::clamp(by_size, kSmallest, kLargest);
}

Layout layout_of(int width, int height, double em, const OpenPanels& open) {
  const double margin = kMargin * em, column = kColumn * em, w = width, h = height;
  Layout layout;
  // 4:3; leaves room for the panels in the middle, and below it for the knobs.
  const double under = kScannerLeast * em + 3 * margin;
  const double image = std::max(std::min({w * 3 / 8, h * 2 / 3, (h - under) * 4 / 3}), h / 3);
  layout.ultrasound = pane(w - margin - image, margin, image, image * 3 / 4);
  const double right = w - margin - image, below = margin + image * 3 / 4 + margin;
  const bool instructor_left = open.instructor && open.scanner;
  double bottom = h - margin;  // of what is free on the left
  if (open.force) {
    const double tall = (instructor_left ? kFlatForce : kForce) * em;
    layout.force = pane(margin, bottom - tall, column, tall);
    bottom -= tall + margin;
  }
  if (open.scanner) layout.scanner = pane(right, below, image, h - margin - below);
  if (open.instructor && !instructor_left) layout.instructor = pane(right, below, image, h - margin - below);
  if (instructor_left) {
    const double tall = kInstructor * em;
    layout.instructor = pane(margin, bottom - tall, column, tall);
    bottom -= tall + margin;
  }
  layout.course = pane(margin, margin, column, std::min(bottom - margin, kCourse * em));
  const double left = margin + column + margin;
  const picture::Pane middle = pane(left, margin, right - margin - left, h - 2 * margin);
  if (open.briefing || open.ending) {  // lines that are read easily
    const double wide = std::min<double>(middle.width, kMiddle * em);
    layout.middle = pane(middle.x + (middle.width - wide) / 2, middle.y, wide, middle.height);
  }
  layout.needle = middle;
  if (open.left_handed) {
    for (picture::Pane* const pane : {&layout.ultrasound, &layout.course, &layout.force, &layout.scanner,
                                      &layout.instructor, &layout.middle, &layout.needle}) {
      if (pane->width > 0) pane->x = width - pane->x - pane->width;
    }
  }
  return layout;
}

}  // namespace stylet::desktop
