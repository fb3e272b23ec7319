// The files of a figure: a plot with its caption as PNG, its numbers as CSV.
#pragma once

#include "engine/figures/plot.h"

#include <Eigen/Core>

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace stylet::bench {

/// A column of a CSV file.
struct FigureColumn {
  std::string name;  ///< with unit: force_y_frozen_n
  std::vector<double> values;
};

/// One component of vectors, scaled.
std::vector<double> component(const std::vector<Eigen::Vector3d>& vectors, int axis, double scale = 1);

/// Writes NAME.png and NAME.csv into `folder`, which is made if need be.
/// @param caption  lines below the panels
/// @throws std::runtime_error if a file cannot be written
void write_figure(const std::filesystem::path& folder, const std::string& name,
                  std::span<const figures::PlotPanel> panels, std::span<const std::string> caption,
                  std::span<const FigureColumn> columns);

}  // namespace stylet::bench
