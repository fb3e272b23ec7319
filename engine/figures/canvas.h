// Antialiased lines, dots, boxes and text on an RGBA image.
#pragma once

#include "engine/picture/picture.h"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace stylet::figures {

/// sRGB with opacity.
struct Colour {
  std::uint8_t r = 0, g = 0, b = 0, a = 255;
};

struct PixelPoint {
  double x = 0, y = 0;  ///< pixels from the top left corner; pixel centres are at .5
};

struct PixelBox {
  double left = 0, top = 0, right = 0, bottom = 0;
};

/// A TrueType font (stb_truetype).
class Font {
public:
  /// DejaVu Sans of Debian's fonts-dejavu-core, or `path`. A font that cannot be read leaves an empty Font that draws
  /// nothing, and warning() says so: a figure without text is better than none.
  static Font load(const std::filesystem::path& path = {});
  Font();
  Font(Font&&) noexcept;
  Font& operator=(Font&&) noexcept;
  ~Font();

  bool empty() const { return face_ == nullptr; }
  const std::string& warning() const { return warning_; }
  /// Width of a UTF-8 text, pixels. @param height  of a line (ascent to descent), pixels
  double width(std::string_view text, double height) const;

private:
  friend class Canvas;
  struct Face;
  std::unique_ptr<Face> face_;
  std::string warning_;
};

enum class Align : std::uint8_t { left, centre, right };

/// Draws onto an image; everything is clipped to the image and to the clip box.
class Canvas {
public:
  explicit Canvas(picture::Picture& image);

  void clip(const PixelBox& box) { clip_ = box; }
  void unclip();
  void fill(const PixelBox& box, Colour colour);
  /// One stroke: where it crosses itself it is not drawn twice. Points that are not finite leave a gap.
  void polyline(std::span<const PixelPoint> points, double width, Colour colour);
  void line(PixelPoint from, PixelPoint to, double width, Colour colour);
  void disc(PixelPoint centre, double radius, Colour colour);
  /// @param at    of the text's left end, middle or right end (see align) on the vertical middle of its lower-case
  /// letters
  /// @param turned  reads upwards instead of to the right
  void text(const Font& font, std::string_view text, PixelPoint at, double height, Colour colour,
            Align align = Align::left, bool turned = false);

private:
  void blend(int x, int y, Colour colour, double coverage);

  picture::Picture& image_;
  PixelBox clip_;
  std::vector<std::uint8_t> coverage_;  // of the stroke in progress [width * height], all 0 between strokes
};

}  // namespace stylet::figures
