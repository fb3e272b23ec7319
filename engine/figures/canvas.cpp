#include "engine/figures/canvas.h"

#include <fmt/core.h>
#include <stb_truetype.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>

namespace stylet::figures {
namespace {

constexpr const char* kDefaultFont = "/usr/share/fonts/truetype/dejavu/DejaVuSans.ttf";

/// Takes one code point off the front of a UTF-8 text; a malformed byte becomes U+FFFD.
int next_code_point(std::string_view& text) {
  const auto byte = [&text](std::size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned lead = byte(0);
  const std::size_t length = lead < 0x80 ? 1 : lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : lead >= 0xC0 ? 2 : 0;
  if (length == 0 || length > text.size()) {
    text.remove_prefix(1);
    return 0xFFFD;
  }
  int code = static_cast<int>(length == 1 ? lead : lead & (0x7Fu >> length));
  for (std::size_t i = 1; i < length; ++i) code = code << 6 | (byte(i) & 0x3F);
  text.remove_prefix(length);
  return code;
}

double distance_to_segment(double x, double y, const PixelPoint& a, const PixelPoint& b) {
  const double dx = b.x - a.x, dy = b.y - a.y;
  const double squared = dx * dx + dy * dy;
  const double s = squared > 0 ? std::clamp(((x - a.x) * dx + (y - a.y) * dy) / squared, 0.0, 1.0) : 0.0;
  return std::hypot(x - (a.x + s * dx), y - (a.y + s * dy));
}

struct PixelRange {
  int begin = 0, end = 0;
};

/// Pixels that [low, high] touches within [clip_low, clip_high]. Clamped before the conversion to int.
PixelRange pixels_between(double low, double high, double clip_low, double clip_high) {
  return {static_cast<int>(std::floor(std::clamp(low, clip_low, clip_high))),
          static_cast<int>(std::ceil(std::clamp(high, clip_low, clip_high)))};
}

}  // namespace

struct Font::Face {
  std::vector<unsigned char> file;
  stbtt_fontinfo metrics{};
};

Font::Font() = default;
Font::Font(Font&&) noexcept = default;
Font& Font::operator=(Font&&) noexcept = default;
Font::~Font() = default;

Font Font::load(const std::filesystem::path& path) {
  const std::filesystem::path wanted = path.empty() ? std::filesystem::path(kDefaultFont) : path;
  Font font;
  auto face = std::make_unique<Face>();
  std::ifstream file(wanted, std::ios::binary);
  face->file.assign(std::istreambuf_iterator<char>(file), {});
  // stb_truetype trusts the file, so only a font with the right first bytes gets that far.
  const bool is_font = face->file.size() > 1024 && stbtt_GetFontOffsetForIndex(face->file.data(), 0) == 0;
  if (!is_font || stbtt_InitFont(&face->metrics, face->file.data(), 0) == 0) {
    font.warning_ = fmt::format("{}: not a readable TrueType font; figures have no text (install fonts-dejavu-core)",
                                wanted.string());
    return font;
  }
  font.face_ = std::move(face);
  return font;
}

double Font::width(std::string_view text, double height) const {
  if (empty()) return 0;
  const double scale = stbtt_ScaleForPixelHeight(&face_->metrics, static_cast<float>(height));
  double units = 0;
  while (!text.empty()) {
    int advance = 0, bearing = 0;
    stbtt_GetCodepointHMetrics(&face_->metrics, next_code_point(text), &advance, &bearing);
    units += advance;
  }
  return units * scale;
}

Canvas::Canvas(picture::Picture& image)
    : image_(image), coverage_(static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height)) {
  unclip();
}

void Canvas::unclip() {
  clip_ = {0, 0, static_cast<double>(image_.width), static_cast<double>(image_.height)};
}

void Canvas::blend(int x, int y, Colour colour, double coverage) {
  if (x < 0 || y < 0 || x >= image_.width || y >= image_.height) return;
  if (x + 0.5 < clip_.left || x + 0.5 > clip_.right || y + 0.5 < clip_.top || y + 0.5 > clip_.bottom) return;
  const double opacity = std::clamp(coverage, 0.0, 1.0) * colour.a / 255.0;
  std::uint8_t* pixel = image_.at(x, y);
  const auto mix = [opacity](std::uint8_t below, std::uint8_t above) {
    return static_cast<std::uint8_t>(std::lround(below + opacity * (above - below)));
  };
  pixel[0] = mix(pixel[0], colour.r);
  pixel[1] = mix(pixel[1], colour.g);
  pixel[2] = mix(pixel[2], colour.b);
  pixel[3] = mix(pixel[3], 255);
}

void Canvas::fill(const PixelBox& box, Colour colour) {
  const auto [x0, x1] = pixels_between(box.left, box.right, 0, image_.width);
  const auto [y0, y1] = pixels_between(box.top, box.bottom, 0, image_.height);
  for (int y = y0; y < y1; ++y) {
    const double cover_y = std::min<double>(y + 1, box.bottom) - std::max<double>(y, box.top);
    for (int x = x0; x < x1; ++x) {
      const double cover_x = std::min<double>(x + 1, box.right) - std::max<double>(x, box.left);
      blend(x, y, colour, cover_x * cover_y);
    }
  }
}

void Canvas::polyline(std::span<const PixelPoint> points, double width, Colour colour) {
  // The coverage of a pixel is that of a one-pixel-wide ramp at the edge of the stroke; where segments meet or cross,
  // the greater one counts.
  const double reach = 0.5 * width + 0.5;
  const auto covered = [&](double distance) { return std::clamp(reach - distance, 0.0, 1.0); };
  PixelBox touched{static_cast<double>(image_.width), static_cast<double>(image_.height), 0, 0};
  for (std::size_t i = 0; i + 1 < points.size(); ++i) {
    const PixelPoint& a = points[i];
    const PixelPoint& b = points[i + 1];
    if (!std::isfinite(a.x + a.y + b.x + b.y)) continue;
    const auto [x0, x1] = pixels_between(std::min(a.x, b.x) - reach, std::max(a.x, b.x) + reach, 0, image_.width);
    const auto [y0, y1] = pixels_between(std::min(a.y, b.y) - reach, std::max(a.y, b.y) + reach, 0, image_.height);
    for (int y = y0; y < y1; ++y) {
      for (int x = x0; x < x1; ++x) {
        const double cover = covered(distance_to_segment(x + 0.5, y + 0.5, a, b));
        std::uint8_t& kept = coverage_[static_cast<std::size_t>(y) * image_.width + x];
        kept = std::max(kept, static_cast<std::uint8_t>(std::lround(255 * cover)));
      }
    }
    touched = {std::min<double>(touched.left, x0), std::min<double>(touched.top, y0),
               std::max<double>(touched.right, x1), std::max<double>(touched.bottom, y1)};
  }
  for (int y = static_cast<int>(touched.top); y < static_cast<int>(touched.bottom); ++y) {
    for (int x = static_cast<int>(touched.left); x < static_cast<int>(touched.right); ++x) {
      std::uint8_t& cover = coverage_[static_cast<std::size_t>(y) * image_.width + x];
      if (cover != 0) blend(x, y, colour, cover / 255.0);
      cover = 0;
    }
  }
}

void Canvas::line(PixelPoint from, PixelPoint to, double width, Colour colour) {
  const PixelPoint ends[2] = {from, to};
  polyline(ends, width, colour);
}

void Canvas::disc(PixelPoint centre, double radius, Colour colour) {
  line(centre, centre, 2 * radius, colour);
}

void Canvas::text(const Font& font, std::string_view text, PixelPoint at, double height, Colour colour, Align align,
                  bool turned) {
  if (font.empty()) return;
  const stbtt_fontinfo& face = font.face_->metrics;
  const float scale = stbtt_ScaleForPixelHeight(&face, static_cast<float>(height));
  const double width = font.width(text, height);
  // Along the line of text, and the base line below its middle: half the height of an x (0.55 em in DejaVu, em = 0.86
  // of the line height).
  double along = align == Align::left ? 0 : align == Align::centre ? -0.5 * width : -width;
  const double base = 0.235 * height;
  while (!text.empty()) {
    const int code = next_code_point(text);
    // Glyphs start at a fraction of a pixel; upright text is placed along x, turned text along -y.
    const double pen = turned ? along - at.y : along + at.x;
    const double whole = std::floor(pen);
    const double line = std::round((turned ? at.x : at.y) + base);
    int w = 0, h = 0, left = 0, top = 0;
    unsigned char* glyph = stbtt_GetCodepointBitmapSubpixel(&face, scale, scale, static_cast<float>(pen - whole), 0,
                                                            code, &w, &h, &left, &top);
    for (int v = 0; v < h; ++v) {
      for (int u = 0; u < w; ++u) {
        const double cover = glyph[v * w + u] / 255.0;
        if (cover == 0) continue;
        const int right = static_cast<int>(whole) + left + u;
        const int down = static_cast<int>(line) + top + v;
        if (turned) {
          blend(down, -right - 1, colour, cover);
        } else {
          blend(right, down, colour, cover);
        }
      }
    }
    stbtt_FreeBitmap(glyph, nullptr);
    int advance = 0, bearing = 0;
    stbtt_GetCodepointHMetrics(&face, code, &advance, &bearing);
    along += advance * static_cast<double>(scale);
  }
}

}  // namespace stylet::figures
