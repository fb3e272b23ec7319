// Charts drawn on the CPU: lines over axes, as the figures of a report and as the live curve of a video.
#pragma once

#include "engine/figures/canvas.h"
#include "engine/figures/plot_axis.h"
#include "engine/picture/picture.h"

#include <span>
#include <string>
#include <vector>

namespace stylet::figures {

enum class PlotTheme : std::uint8_t { light, dark };

/// A line through points; a point that is not finite leaves a gap.
struct PlotSeries {
  std::string label;  ///< in the legend; empty: not there
  std::vector<double> x;
  std::vector<double> y;  ///< same size as x
  Colour colour;
  double width = 1.8;  ///< pixels
};

/// A vertical line at x with a short text.
struct PlotMarker {
  double x = 0;
  std::string label;
};

/// A dot that stands for "now".
struct PlotDot {
  double x = 0;
  double y = 0;
  Colour colour;
};

/// One chart.
struct PlotPanel {
  std::string title;
  PlotAxis x;
  PlotAxis y;
  std::vector<PlotSeries> series;
  std::vector<PlotMarker> markers;
  std::vector<PlotDot> dots;
};

/// Height of a marker's text over PlotSettings::text_height.
inline constexpr double kMarkerText = 0.8;

struct PlotSettings {
  int width = 1200;  ///< pixels, of the whole figure
  int height = 900;
  PlotTheme theme = PlotTheme::light;
  double text_height = 16;  ///< pixels, of the tick labels; title and labels follow
};

/// Colours of the series, in order: distinguishable for colour-blind eyes (Okabe & Ito), readable on the theme.
Colour plot_colour(int index, PlotTheme theme);

/// Draws the panels below each other. Without a font (see Font::load) there is no text.
picture::Picture draw_plot(std::span<const PlotPanel> panels, const PlotSettings& settings, const Font& font);

}  // namespace stylet::figures
