// Antialiasing of a finished picture: for frames that a processor draws, where four samples a pixel cost most.
#pragma once

#include "engine/picture/picture.h"

namespace stylet::picture {

/// Blends pixels along edges with those across, by how far the edge's ends are: fast approximate antialiasing
/// (Lottes, NVIDIA 2009) on the luma of sRGB values. Flat places keep their bits; so does the outermost pixel.
void smooth_edges(Picture& picture);

}  // namespace stylet::picture
