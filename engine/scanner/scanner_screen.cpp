#include "engine/scanner/scanner_screen.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

namespace stylet::scanner {
namespace {

constexpr figures::Colour kReading{206, 214, 220, 255};
constexpr figures::Colour kFaint{130, 140, 148, 255};
constexpr figures::Colour kFocus{240, 190, 70, 255};
constexpr figures::Colour kNote{255, 196, 84, 255};
constexpr figures::Colour kMeasure{120, 230, 140, 255};
constexpr figures::Colour kShade{0, 0, 0, 200};

/// Text heights follow the picture's.
double text_height(const picture::Picture& picture) {
  return std::clamp(picture.height / 34.0, 9.0, 22.0);
}

/// Numbers each so many mm, so that there are three at least; the marks between are the image's own.
int numbered_mm(double depth) {
  return depth > 0.1 ? 50 : depth > 0.04 ? 20 : 10;
}

void draw_scale(figures::Canvas& canvas, const picture::Picture& picture, const ScannerReadout& readout,
                const figures::Font& font) {
  const double height = 0.8 * text_height(picture);
  const double right = picture.width - 16;
  for (int mm = 0; mm <= readout.depth * 1e3 + 0.5; mm += numbered_mm(readout.depth)) {
    const double y = readout.sector.pixel({0, mm * 1e-3}).y() + 0.5;
    canvas.text(font, fmt::format("{}", mm), {right, y}, height, kFaint, figures::Align::right);
  }
  const double focus = readout.sector.pixel({0, readout.focus}).y() + 0.5;
  const double size = 0.35 * text_height(picture);
  const figures::PixelPoint tip{picture.width - 16.0, focus};
  for (double side : {-1.0, 1.0}) canvas.line(tip, {tip.x + 1.6 * size, focus + side * size}, 2, kFocus);
  canvas.line({tip.x + 1.6 * size, focus - size}, {tip.x + 1.6 * size, focus + size}, 2, kFocus);
}

void draw_mark(figures::Canvas& canvas, figures::PixelPoint at, double size, figures::Colour colour, double width) {
  canvas.line({at.x - size, at.y}, {at.x + size, at.y}, width, colour);
  canvas.line({at.x, at.y - size}, {at.x, at.y + size}, width, colour);
}

/// Dots from mark to mark: what lies under a line could not be judged.
void draw_dots(figures::Canvas& canvas, figures::PixelPoint from, figures::PixelPoint to, double step) {
  const double length = std::hypot(to.x - from.x, to.y - from.y);
  for (double at = step; at < length - 0.5 * step; at += step) {
    const double share = at / length;
    canvas.disc({from.x + share * (to.x - from.x), from.y + share * (to.y - from.y)}, 0.9, kMeasure);
  }
}

/// Marks, dots between them, and the distance beside the second, on the side where the first is not.
void draw_measures(figures::Canvas& canvas, const picture::Picture& picture, const ScannerReadout& readout,
                   const figures::Font& font) {
  const double height = 0.9 * text_height(picture), size = 0.4 * text_height(picture);
  const auto pixel = [&](const Eigen::Vector2d& xz) {
    const Eigen::Vector2d uv = readout.sector.pixel(xz);
    return figures::PixelPoint{uv.x() + 0.5, uv.y() + 0.5};
  };
  for (std::size_t i = 0; i < readout.measures.size(); ++i) {
    const Measure& measure = readout.measures[i];
    const figures::PixelPoint from = pixel(measure.from), to = pixel(measure.to);
    draw_dots(canvas, from, to, 0.6 * height);
    for (const figures::PixelPoint& at : {from, to}) {
      draw_mark(canvas, at, size + 1, kShade, 4);
      draw_mark(canvas, at, size, kMeasure, 1.6);
    }
    const std::string text =
        readout.measures.size() > 1 ? fmt::format("{}: {}", i + 1, distance_text(measure)) : distance_text(measure);
    const double wide = font.width(text, height), gap = 1.6 * size;
    double left = to.x >= from.x ? to.x + gap : to.x - gap - wide;
    left = std::clamp(left, 2.0, std::max(2.0, picture.width - wide - 2));
    const double middle = std::clamp(to.y, height, picture.height - height);
    canvas.fill({left - 2, middle - 0.6 * height, left + wide + 2, middle + 0.6 * height}, kShade);
    canvas.text(font, text, {left, middle}, height, kMeasure);
  }
}

/// Sliders from the top (near) down, gain to the right.
void draw_tgc(figures::Canvas& canvas, const picture::Picture& picture, const ScannerConsole& console,
              const figures::Font& font) {
  const double height = text_height(picture);
  const figures::PixelBox box{8, picture.height - 11.5 * height, 8 + 4.5 * height, picture.height - 3.2 * height};
  const double middle = 0.5 * (box.left + box.right);
  const double per_db = (box.right - box.left) / 40;
  canvas.text(font, "TGC", {box.left, box.top - 0.6 * height}, 0.8 * height, kFaint);
  canvas.line({middle, box.top}, {middle, box.bottom}, 1, {90, 98, 104, 255});
  std::vector<figures::PixelPoint> curve;
  for (int i = 0; i < ultrasound::kTgcSliders; ++i) {
    const double y = box.top + (i + 0.5) / ultrasound::kTgcSliders * (box.bottom - box.top);
    curve.push_back({middle + per_db * console.controls().tgc_db[i], y});
  }
  canvas.polyline(curve, 1.5, kReading);
  for (int i = 0; i < ultrasound::kTgcSliders; ++i) {
    canvas.disc(curve[i], i == console.slider() ? 3.5 : 2, i == console.slider() ? kFocus : kReading);
  }
}

}  // namespace

void draw_note(picture::Picture& picture, const std::string& note, const figures::Font& font) {
  if (note.empty()) return;
  figures::Canvas canvas(picture);
  const double wanted = text_height(picture);
  const double height = std::min(wanted, 0.96 * picture.width / std::max(font.width(note, 1), 1e-3));
  const double y = picture.height - 0.9 * wanted;
  canvas.fill({0, y - 0.8 * wanted, double(picture.width), double(picture.height)}, kShade);
  canvas.text(font, note, {0.5 * picture.width, y}, height, kNote, figures::Align::centre);
}

void draw_scanner_screen(picture::Picture& picture, const ScannerReadout& readout, const ScannerConsole& console,
                         const figures::Font& font) {
  figures::Canvas canvas(picture);
  const ultrasound::ScannerControls& controls = console.controls();
  const double height = text_height(picture);
  double y = height;
  const auto line = [&](const std::string& text, figures::Colour colour) {
    canvas.text(font, text, {8, y}, height, colour);
    y += 1.3 * height;
  };
  line(readout.probe, kReading);
  line(ultrasound::preset_name(console.preset()), kFaint);
  line(fmt::format("{:.2f} MHz", controls.frequency_hz * 1e-6), kReading);
  line(fmt::format("Depth {:.0f} mm", controls.depth * 1e3), kReading);
  line(fmt::format("Focus {:.0f} mm", controls.focus * 1e3), kReading);
  line(fmt::format("Gain {:+.0f} dB", controls.gain_db), kReading);
  line(fmt::format("DR {:.0f} dB", controls.dynamic_range_db), kReading);
  line(fmt::format("Persist {:.1f}", controls.persistence), kFaint);
  if (readout.rate_hz > 0) line(fmt::format("{:.0f} images/s", readout.rate_hz), kFaint);
  canvas.text(font, fmt::format("{:.1f} N", std::max(0.0, readout.probe_force)),
              {picture.width - 16.0 - 2 * height, height}, height, kFaint, figures::Align::right);
  if (console.frozen()) {
    const double half = 0.5 * font.width("FROZEN", 1.2 * height) + 0.5 * height;
    canvas.fill({0.5 * picture.width - half, 0.2 * height, 0.5 * picture.width + half, 1.8 * height}, kShade);
    canvas.text(font, "FROZEN", {0.5 * picture.width, height}, 1.2 * height, kFocus, figures::Align::centre);
  }
  draw_scale(canvas, picture, readout, font);
  draw_tgc(canvas, picture, console, font);
  draw_measures(canvas, picture, readout, font);
  draw_note(picture, readout.note, font);
}

}  // namespace stylet::scanner
