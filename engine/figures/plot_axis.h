// Axes of charts, drawn as pixels (plot.h) or as SVG (svg_plot.h): their ends, their ticks, the numbers beside them.
#pragma once

#include <limits>
#include <span>
#include <string>
#include <vector>

namespace stylet::figures {

/// Ends that are NaN are taken from the data and rounded outwards to ticks.
struct PlotAxis {
  std::string label;  ///< with unit
  double min = std::numeric_limits<double>::quiet_NaN();
  double max = std::numeric_limits<double>::quiet_NaN();
};

struct AxisRange {
  double min = 0;
  double max = 1;
};
/// Of no values: what extend() begins with.
inline constexpr AxisRange kNoRange{.min = std::numeric_limits<double>::infinity(),
                                    .max = -std::numeric_limits<double>::infinity()};

/// Widens a range to the finite ones of some values.
void extend(AxisRange& range, std::span<const double> values);

/// The axis' own ends, else those of the data, rounded outwards to ticks; [0, 1] where there is neither.
AxisRange rounded(const AxisRange& data, const PlotAxis& axis);

/// At most `max_count` round values (1, 2 or 5 times a power of ten) that lie in [min, max]. Finite, min < max.
std::vector<double> nice_ticks(double min, double max, int max_count);

/// Between two ticks; 1 where there are not two.
double tick_step(std::span<const double> ticks);

/// A tick's number, with as many decimals as the step asks for.
std::string tick_text(double value, double step);

}  // namespace stylet::figures
