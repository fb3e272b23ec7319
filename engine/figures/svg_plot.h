// Charts as inline SVG for pages, whose style sheet gives the colours: there without scripts and on paper; scripts
// add what follows the mouse. As wide as the page lets them be, with text that keeps its size: what is written for
// several widths has the class narrow, medium or broad, of which the style sheet shows one (from 0, 520 and 1000
// pixels on), and where it is narrow hides numbers of the class fine. Charts as pixels: plot.h.
#pragma once

#include <span>
#include <string>
#include <vector>

namespace stylet::figures {

struct SvgLine {
  std::string name{};   ///< class of the line, which gives its colour
  std::string label{};  ///< of the legend; empty: it has none
  std::vector<double> x{};
  std::vector<double> y{};  ///< same size; not finite: a gap
  bool dashed = false;
};

/// A vertical line at x with a number above it; marks of a plot are numbered in order.
struct SvgMark {
  double x = 0;
  std::string number{};
  std::string title{};  ///< shown when pointed at
  std::string name{};   ///< class
};

/// A dot, however wide the plot is.
struct SvgPoint {
  double x = 0;
  double y = 0;
  std::string name{};   ///< class
  std::string title{};  ///< shown when pointed at
};

struct SvgPlot {
  std::string id{};
  std::string title{};
  std::string x_label{};
  std::string y_label{};
  std::vector<SvgLine> lines{};
  std::vector<SvgPoint> points{};  ///< finite, over the lines
  std::vector<SvgMark> marks{};    ///< x ascending
  bool wide = false;               ///< as two others
};

/// A figure with legend. The box of its svg element spans the axis of x; scripts find the ends of the axes in its
/// attributes data-x0, data-x1, data-y0, data-y1 and where that of y lies, in pixels from above, in data-top and
/// data-bottom.
std::string svg_plot(const SvgPlot& plot);

/// Stages as bands, everything else as numbered marks above them, x ascending.
struct TimelineBand {
  double from_s = 0;
  double to_s = 0;
  std::string label{};
};
std::string svg_timeline(double duration_s, std::span<const TimelineBand> bands, std::span<const SvgMark> marks);

}  // namespace stylet::figures
