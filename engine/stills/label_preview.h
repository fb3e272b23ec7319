// Label maps for the eye: colours of the labels over the picture they belong to.
#pragma once

#include "engine/picture/picture.h"

#include <cstdint>
#include <span>

namespace stylet::stills {

/// The picture, darkened by the colours of content::PictureLabels, with the borders between labels in full colour;
/// background as it is. [labels: width * height]
picture::Picture label_preview(picture::Picture picture, std::span<const std::uint8_t> labels);

/// A picture of grey values. [grey: width * height]
picture::Picture grey_picture(int width, int height, std::span<const std::uint8_t> grey);

}  // namespace stylet::stills
