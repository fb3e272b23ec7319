#include "engine/stills/label_preview.h"

#include "engine/content/picture_labels.h"

#include <cassert>

namespace stylet::stills {

picture::Picture label_preview(picture::Picture picture, std::span<const std::uint8_t> labels) {
  assert(labels.size() == static_cast<std::size_t>(picture.width) * picture.height);
  const auto at = [&](int x, int y) { return labels[static_cast<std::size_t>(y) * picture.width + x]; };
  for (int y = 0; y < picture.height; ++y) {
    for (int x = 0; x < picture.width; ++x) {
      const std::uint8_t label = at(x, y);
      if (label == 0) continue;
      const bool border =
          (x + 1 < picture.width && at(x + 1, y) != label) || (y + 1 < picture.height && at(x, y + 1) != label);
      const std::array<std::uint8_t, 3> colour = content::PictureLabels::colour(label);
      std::uint8_t* pixel = picture.at(x, y);
      for (std::size_t c = 0; c < 3; ++c) {
        pixel[c] = border ? colour[c] : static_cast<std::uint8_t>((3 * pixel[c] + colour[c]) / 4);
      }
    }
  }
  return picture;
}

picture::Picture grey_picture(int width, int height, std::span<const std::uint8_t> grey) {
  assert(grey.size() == static_cast<std::size_t>(width) * height);
  picture::Picture picture(width, height);
  for (std::size_t i = 0; i < grey.size(); ++i) {
    for (std::size_t c = 0; c < 3; ++c) picture.rgba[4 * i + c] = grey[i];
  }
  return picture;
}

}  // namespace stylet::stills
