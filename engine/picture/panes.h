// Where the pictures of a session stand in one frame: the 3-D view on the left, ultrasound above a plot on the right.
#pragma once

#include "engine/picture/picture.h"

#include <vector>

namespace stylet::picture {

/// A rectangle of a frame, pixels from its upper left corner.
struct Pane {
  int x = 0;
  int y = 0;
  int width = 0;
  int height = 0;
};

struct PaneLayout {
  Pane scene;
  Pane ultrasound;
  Pane plot;

  /// For a frame of any size >= 1 x 1. Without a plot the ultrasound takes the whole right column.
  static PaneLayout of(int width, int height, bool with_plot);
};

/// The largest rectangle with the aspect of width x height that fits `pane`, centred.
Pane fitted(const Pane& pane, int width, int height);

/// Draws `picture` into `pane` of `frame`, scaled to fit with its aspect kept: averaged where it shrinks (over the
/// area of each pixel), bilinear where it grows, in the values as stored.
void draw_fitted(Picture& frame, const Pane& pane, const Picture& picture);

/// One frame of a video: the pictures in their panes on a dark ground. An empty plot leaves its pane to the
/// ultrasound.
Picture compose(int width, int height, const Picture& scene, const Picture& ultrasound, const Picture& plot);

}  // namespace stylet::picture
