// Where the panels of a session lie in its window: one designed layout, from 1024 x 640 to 4K. Pure.
#pragma once

#include "engine/picture/panes.h"

namespace stylet::desktop {

/// The smallest window, pixels.
inline constexpr int kLeastWidth = 1024;
inline constexpr int kLeastHeight = 640;

/// Size of texts and spacing for a window of so many pixels: those of a window of 1280 x 720 at 1, on a display of
/// twice the density at 2; smaller in a small window, larger in a large one.
/// @param content_scale  of the display: view::Window::content_scale()
double text_scale(int width, int height, double content_scale);

/// Which of the panels are open.
struct OpenPanels {
  bool force = true;
  bool scanner = false;
  bool instructor = false;
  bool briefing = false;
  bool ending = false;
  bool left_handed = false;  ///< the scanner's image on the left, the rest on the right: the whole mirrored
};

/// Pixels of the window; a panel that is not open is empty. No two of them overlap, all lie inside the window.
struct Layout {
  picture::Pane ultrasound;  ///< the scanner's image
  picture::Pane course;      ///< what to do now
  picture::Pane force;
  picture::Pane scanner;
  picture::Pane instructor;
  picture::Pane middle;  ///< briefing or ending
  picture::Pane needle;  ///< what is left of the 3-D view, where the needle is to start
};
/// @param em  size of the font, pixels
Layout layout_of(int width, int height, double em, const OpenPanels& open);

}  // namespace stylet::desktop
