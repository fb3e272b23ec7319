#include "engine/scanner/core_strips.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace stylet::scanner {
namespace {

constexpr figures::Colour kCaption{206, 214, 220, 255};
constexpr figures::Colour kRim{130, 140, 148, 255};
constexpr figures::Colour kBehind{0, 0, 0, 200};

// Of the height of a line of text.
constexpr double kLeft = 6.2;  // beside the TGC curve
constexpr double kAboveNote = 1.9;
constexpr double kRow = 1.4;
constexpr double kStrip = 0.75;  // height
constexpr double kGap = 0.7;     // between strip and caption

// Of the width of the picture.
constexpr double kLongest = 0.25;
constexpr double kCaptionWidth = 0.32;
constexpr double kMillimetre = 0.0095;  // some six pixels, unless the longest is too long

double text_height(int height) {
  return std::clamp(height / 34.0, 9.0, 22.0);
}

std::uint8_t srgb(float linear) {
  const double c = std::clamp(static_cast<double>(linear), 0.0, 1.0);
  return static_cast<std::uint8_t>(
      std::lround(255 * (c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1 / 2.4) - 0.055)));
}

figures::Colour colour_of(const state::CorePiece& piece, const content::Scene& scene) {
  const auto tissue = static_cast<std::size_t>(piece.tissue);
  if (tissue == 0 || tissue >= scene.tissues.size()) return {0, 0, 0, 255};
  const auto& colour = scene.tissues[tissue].colour;
  const float shade = piece.shade();
  return {srgb(shade * colour[0]), srgb(shade * colour[1]), srgb(shade * colour[2]), 255};
}

void draw_strip(figures::Canvas& canvas, const state::CoreTrack& core, const figures::PixelBox& box,
                const content::Scene& scene) {
  canvas.fill({box.left - 1, box.top - 1, box.right + 1, box.bottom + 1}, kRim);
  canvas.fill(box, {0, 0, 0, 255});
  const double wide = box.right - box.left, high = box.bottom - box.top;
  for (const state::CorePiece& piece : core.pieces) {
    canvas.fill({box.left + piece.from * wide, box.top + piece.low * high, box.left + piece.to * wide,
                 box.top + piece.high * high},
                colour_of(piece, scene));
  }
}

}  // namespace

std::string core_caption(const state::CoreTrack& core, std::size_t number) {
  return fmt::format("core {}: {:.0f} mm, {:.0f} % target", number, 1e3F * core.length(), 100 * core.target_share);
}

figures::PixelBox core_strips_box(int width, int height, std::size_t cores) {
  const double line = text_height(height), left = kLeft * line;
  const double bottom = height - kAboveNote * line;
  return {left, bottom - kRow * line * static_cast<double>(std::min(cores, kMostStrips)),
          left + (kLongest + kCaptionWidth) * width, bottom};
}

void draw_core_strips(picture::Picture& picture, std::span<const state::CoreTrack> cores, const content::Scene& scene,
                      const content::Texts* texts, const figures::Font& font) {
  if (cores.empty()) return;
  const double line = text_height(picture.height), row = kRow * line;
  const figures::PixelBox box = core_strips_box(picture.width, picture.height, cores.size());
  const std::size_t shown = std::min(cores.size(), kMostStrips), first = cores.size() - shown;
  float longest = 1e-3F;
  for (const state::CoreTrack& core : cores) longest = std::max(longest, core.length());
  const double metre = picture.width * std::min(1e3 * kMillimetre, kLongest / longest);
  figures::Canvas canvas(picture);
  canvas.clip(box);
  for (std::size_t i = 0; i < shown; ++i) {
    const state::CoreTrack& core = cores[first + i];
    const double middle = box.top + (static_cast<double>(i) + 0.5) * row;
    const double left = box.left + 2, right = left + metre * core.length();
    const std::string english = core_caption(core, first + i + 1);
    const std::string caption = texts != nullptr ? texts->of(english) : english;
    const double text = right + kGap * line;
    const double size =
        0.9 * line * std::min(1.0, (box.right - text) / std::max(font.width(caption, 0.9 * line), 1e-3));
    canvas.fill({box.left, middle - row / 2, text + font.width(caption, size) + 3, middle + row / 2}, kBehind);
    draw_strip(canvas, core, {left, middle - kStrip * line / 2, right, middle + kStrip * line / 2}, scene);
    canvas.text(font, caption, {text, middle}, size, kCaption);
  }
}

}  // namespace stylet::scanner
