#include "engine/picture/panes.h"

#include <algorithm>
#include <cmath>

namespace stylet::picture {

namespace {

/// Weights of source pixels for each target pixel along one axis: a box as wide as the pixel, never narrower than the
/// bilinear tent's.
struct Taps {
  int first = 0;
  std::vector<float> weights;
};

std::vector<Taps> taps_for(int source, int target) {
  const double scale = static_cast<double>(source) / target;
  const double radius = std::max(scale, 1.0);
  std::vector<Taps> all(static_cast<std::size_t>(target));
  for (int i = 0; i < target; ++i) {
    const double centre = (i + 0.5) * scale - 0.5;
    const int first = static_cast<int>(std::floor(centre - radius)) + 1;
    const int last = static_cast<int>(std::ceil(centre + radius)) - 1;
    Taps& taps = all[i];
    taps.first = std::clamp(first, 0, source - 1);
    double sum = 0;
    std::vector<double> weights(static_cast<std::size_t>(std::clamp(last, 0, source - 1) - taps.first + 1), 0.0);
    for (int k = first; k <= last; ++k) {
      const double weight = std::max(0.0, 1 - std::abs(k - centre) / radius);
      weights[std::clamp(k, 0, source - 1) - taps.first] += weight;
      sum += weight;
    }
    for (double weight : weights) taps.weights.push_back(static_cast<float>(weight / sum));
  }
  return all;
}

}  // namespace

PaneLayout PaneLayout::of(int width, int height, bool with_plot) {
  PaneLayout layout;
  const int column = std::min(width * 3 / 8, height * 4 / 3);
  const int split = with_plot ? height * 5 / 8 : height;
  layout.scene = {0, 0, width - column, height};
  layout.ultrasound = {width - column, 0, column, split};
  layout.plot = {width - column, split, column, height - split};
  return layout;
}

Pane fitted(const Pane& pane, int width, int height) {
  if (width < 1 || height < 1 || pane.width < 1 || pane.height < 1) return {pane.x, pane.y, 0, 0};
  const double scale = std::min(static_cast<double>(pane.width) / width, static_cast<double>(pane.height) / height);
  Pane fit;
  fit.width = std::clamp(static_cast<int>(std::lround(width * scale)), 1, pane.width);
  fit.height = std::clamp(static_cast<int>(std::lround(height * scale)), 1, pane.height);
  fit.x = pane.x + (pane.width - fit.width) / 2;
  fit.y = pane.y + (pane.height - fit.height) / 2;
  return fit;
}

void draw_fitted(Picture& frame, const Pane& pane, const Picture& picture) {
  const Pane to = fitted(pane, picture.width, picture.height);
  if (to.width == 0) return;
  if (to.width == picture.width && to.height == picture.height) {
    for (int y = 0; y < to.height; ++y)
      std::copy_n(picture.at(0, y), static_cast<std::size_t>(to.width) * 4, frame.at(to.x, to.y + y));
    return;
  }
  // First along x into rows of floats, then along y.
  const std::vector<Taps> columns = taps_for(picture.width, to.width);
  const std::vector<Taps> rows = taps_for(picture.height, to.height);
  const std::size_t stride = static_cast<std::size_t>(to.width) * 4;
  std::vector<float> narrow(stride * static_cast<std::size_t>(picture.height), 0.0F);
  for (int y = 0; y < picture.height; ++y)
    for (int x = 0; x < to.width; ++x) {
      float* out = &narrow[static_cast<std::size_t>(y) * stride + static_cast<std::size_t>(x) * 4];
      const Taps& taps = columns[x];
      for (std::size_t k = 0; k < taps.weights.size(); ++k)
        for (int c = 0; c < 4; ++c)
          out[c] += taps.weights[k] * static_cast<float>(picture.at(taps.first + static_cast<int>(k), y)[c]);
    }
  std::vector<float> row(stride);
  for (int y = 0; y < to.height; ++y) {
    std::fill(row.begin(), row.end(), 0.5F);
    const Taps& taps = rows[y];
    for (std::size_t k = 0; k < taps.weights.size(); ++k) {
      const float* in = &narrow[(static_cast<std::size_t>(taps.first) + k) * stride];
      for (std::size_t i = 0; i < stride; ++i) row[i] += taps.weights[k] * in[i];
    }
    std::uint8_t* out = frame.at(to.x, to.y + y);
    for (std::size_t i = 0; i < stride; ++i) out[i] = static_cast<std::uint8_t>(std::clamp(row[i], 0.0F, 255.0F));
  }
}

Picture compose(int width, int height, const Picture& scene, const Picture& ultrasound, const Picture& plot) {
  Picture frame(width, height, {14, 15, 18, 255});
  const PaneLayout layout = PaneLayout::of(width, height, plot.width > 0);
  draw_fitted(frame, layout.scene, scene);
  draw_fitted(frame, layout.ultrasound, ultrasound);
  draw_fitted(frame, layout.plot, plot);
  return frame;
}

}  // namespace stylet::picture
