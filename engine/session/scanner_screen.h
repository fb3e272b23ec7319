// What stands beside a B-mode image on a machine's screen: settings, depth, focus, TGC, and why it is black.
#pragma once

#include "engine/session/canvas.h"
#include "engine/session/scanner_console.h"
#include "engine/ultrasound/scan_geometry.h"
#include "engine/view/picture.h"

#include <string>

namespace stylet::session {

/// One line at the bottom of an ultrasound picture. Nothing where `note` is empty.
void draw_note(view::Picture& picture, const std::string& note, const Font& font);

struct ScannerReadout {
  std::string probe;  ///< its name
  ultrasound::SectorGeometry sector;
  double probe_force = 0;  ///< N
  std::string note;        ///< why the image is black, or what a key could not do
};

/// Draws all of it into the black around the sector: names and numbers on the left, depths and focus at the scale on
/// the right, the TGC curve, the note at the bottom.
void draw_scanner_screen(view::Picture& picture, const ScannerReadout& readout, const ScannerConsole& console,
                         const Font& font);

}  // namespace stylet::session
