#include "engine/picture/smooth_edges.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace stylet::picture {

namespace {

constexpr int kLeastContrast = 14;  // of 255; less is no edge ...
constexpr int kContrastShare = 8;   // ... and less than a part of this many of what is brightest there
constexpr int kReach = 12;          // pixels that an edge is followed to either side
constexpr float kSubpixel = 0.75F;  // share of what is taken off single pixels

struct Luma {
  int width;
  std::vector<int> values;
  int at(int x, int y) const { return values[static_cast<std::size_t>(y) * width + x]; }
};

Luma luma_of(const Picture& picture) {
  Luma luma{picture.width, std::vector<int>(picture.rgba.size() / 4)};
  for (std::size_t i = 0; i < luma.values.size(); ++i) {
    const std::uint8_t* p = &picture.rgba[4 * i];
    luma.values[i] = (77 * p[0] + 150 * p[1] + 29 * p[2]) >> 8;
  }
  return luma;
}

/// How much of the pixel across the edge belongs into a pixel, and which one that is: -1 or 1 along x or y.
struct Blend {
  float share = 0;
  int dx = 0, dy = 0;
};

Blend blend_at(const Luma& luma, int height, int x, int y) {
  const int l = luma.at(x, y);
  const int n = luma.at(x, y - 1), s = luma.at(x, y + 1), w = luma.at(x - 1, y), e = luma.at(x + 1, y);
  const int most = std::max({l, n, s, w, e}), range = most - std::min({l, n, s, w, e});
  if (range < std::max(kLeastContrast, most / kContrastShare)) return {};
  const int nw = luma.at(x - 1, y - 1), ne = luma.at(x + 1, y - 1), sw = luma.at(x - 1, y + 1),
            se = luma.at(x + 1, y + 1);
  // Second differences are large across an edge.
  const int in_x = std::abs(nw + ne - 2 * n) + 2 * std::abs(w + e - 2 * l) + std::abs(sw + se - 2 * s);
  const int in_y = std::abs(nw + sw - 2 * w) + 2 * std::abs(n + s - 2 * l) + std::abs(ne + se - 2 * e);
  const bool level = in_y >= in_x;
  const int before = level ? n : w, behind = level ? s : e;
  const int side = std::abs(before - l) >= std::abs(behind - l) ? -1 : 1;
  const int other = side < 0 ? before : behind;
  Blend blend{.dx = level ? 0 : side, .dy = level ? side : 0};

  const float middle = 0.5F * static_cast<float>(other + l);
  const float ends = 0.25F * static_cast<float>(std::abs(other - l));
  float way[2] = {kReach, kReach}, found[2] = {0, 0};
  for (int k = 0; k < 2; ++k) {
    const int step = k == 0 ? -1 : 1;
    for (int i = 1; i <= kReach; ++i) {
      const int px = x + (level ? step * i : 0), py = y + (level ? 0 : step * i);
      if (px < 1 || py < 1 || px >= luma.width - 1 || py >= height - 1) break;
      found[k] = 0.5F * static_cast<float>(luma.at(px, py) + luma.at(px + blend.dx, py + blend.dy)) - middle;
      if (std::abs(found[k]) < ends) continue;
      way[k] = static_cast<float>(i);
      break;
    }
  }
  const int nearer = way[0] < way[1] ? 0 : 1;
  const bool here = (static_cast<float>(l) - middle < 0) != (found[nearer] < 0);
  if (here) blend.share = 0.5F - way[nearer] / (way[0] + way[1]);
  const float around = static_cast<float>(2 * (n + s + w + e) + nw + ne + sw + se) / 12;
  const float t = std::min(std::abs(around - static_cast<float>(l)) / static_cast<float>(range), 1.0F);
  const float single = t * t * (3 - 2 * t);
  blend.share = std::max(blend.share, kSubpixel * single * single);
  return blend;
}

}  // namespace

void smooth_edges(Picture& picture) {
  const Picture from = picture;
  const Luma luma = luma_of(from);
  for (int y = 1; y + 1 < picture.height; ++y) {
    for (int x = 1; x + 1 < picture.width; ++x) {
      const Blend blend = blend_at(luma, picture.height, x, y);
      if (blend.share <= 0) continue;
      const std::uint8_t* a = from.at(x, y);
      const std::uint8_t* b = from.at(x + blend.dx, y + blend.dy);
      std::uint8_t* out = picture.at(x, y);
      for (int c = 0; c < 3; ++c) {
        const auto value = static_cast<float>(a[c]) + blend.share * static_cast<float>(b[c] - a[c]);
        out[c] = static_cast<std::uint8_t>(value + 0.5F);
      }
    }
  }
}

}  // namespace stylet::picture
