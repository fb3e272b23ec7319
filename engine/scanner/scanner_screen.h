// What stands beside a B-mode image on a machine's screen: settings, depth, focus, TGC, and why it is black.
#pragma once

#include "engine/figures/canvas.h"
#include "engine/picture/picture.h"
#include "engine/scanner/calipers.h"
#include "engine/scanner/scanner_console.h"
#include "engine/ultrasound/scan_geometry.h"

#include <span>
#include <string>

namespace stylet::scanner {

/// One line at the bottom of an ultrasound picture. Nothing where `note` is empty.
void draw_note(picture::Picture& picture, const std::string& note, const figures::Font& font);

struct ScannerReadout {
  std::string probe;  ///< its name
  ultrasound::SectorGeometry sector;
  double rate_hz = 0;      ///< of the images
  double probe_force = 0;  ///< N
  std::string note;        ///< why the image is black, or what a key could not do
  double depth = 0;        ///< of the image, m: that of the knobs where it is not frozen
  double focus = 0;        ///< the same
  std::span<const Measure> measures{};
};

/// Draws all of it into the black around the sector: names and numbers on the left, depths and focus at the scale on
/// the right, the TGC curve, the note at the bottom; and over the image the measures, each with its distance.
void draw_scanner_screen(picture::Picture& picture, const ScannerReadout& readout, const ScannerConsole& console,
                         const figures::Font& font);

}  // namespace stylet::scanner
