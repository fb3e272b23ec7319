// What the hand felt, against time and depth: as numbers, as a file, as figures.
#pragma once

#include "engine/figures/canvas.h"
#include "engine/figures/plot.h"

#include <Eigen/Core>

#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace stylet::figures {

/// One row. SI, patient frame.
struct ForceSample {
  double time_s = 0;
  Eigen::Vector3d hub = Eigen::Vector3d::Zero();    ///< position of the needle hub, m
  double depth = 0;                                 ///< arc length of needle in tissue, m
  Eigen::Vector3d force = Eigen::Vector3d::Zero();  ///< on the hand, N
  double axial = 0;                                 ///< N, positive: pushes the needle out, against insertion
  double lateral = 0;                               ///< N, norm of the part across the needle
  double work = 0;                                  ///< of the hand on the needle since the start, J
};

/// The main figures.
struct ForceSummary {
  std::size_t samples = 0;
  double duration_s = 0;
  double peak_force = 0;  ///< N, norm
  double peak_force_time_s = 0;
  double peak_axial = 0;    ///< N, greatest against insertion
  double peak_lateral = 0;  ///< N
  double max_depth = 0;     ///< m
  double max_jump = 0;      ///< N, greatest |F(k+1) - F(k)| between neighbouring samples kept
  /// J, the least that the hand had done at any step, kept or not; 0 at the start. Below zero is energy given to a
  /// hand that had not put it in: made by the coupling, where nothing else (breathing) moves the tissue.
  double least_work = 0;
};

/// A named moment to mark in figures.
struct TraceEvent {
  double time_s = 0;
  std::string name;
};

/// Collects samples in memory reserved at construction.
class ForceTrace {
public:
  /// @param capacity  samples kept at most
  /// @param every     keeps one sample in so many
  explicit ForceTrace(std::size_t capacity, int every = 1);

  /// @param needle_axis  unit, from hub to tip
  /// @param work         physics::NeedleState::hand_work, J
  /// @return false when the capacity is used up (the sample is counted in dropped())
  /// @realtime no allocation; one thread
  bool add(double time_s, const Eigen::Vector3d& hub, const Eigen::Vector3d& needle_axis, double depth,
           const Eigen::Vector3d& force, double work = 0);

  std::span<const ForceSample> samples() const { return samples_; }
  std::size_t dropped() const { return dropped_; }
  ForceSummary summary() const;

private:
  std::size_t capacity_;
  int every_;
  std::size_t seen_ = 0;
  std::size_t dropped_ = 0;
  double least_work_ = 0;
  std::vector<ForceSample> samples_;
};

/// force.csv: RFC 4180, one header line with units in the names, numbers that read back to the same bits; the last
/// column names the events (in order of time or not) of the row, "; " between them. A file that could not be written
/// whole is removed.
/// @throws files::ContentError  when the file cannot be written
void write_force_csv(const std::filesystem::path& path, const ForceTrace& trace,
                     std::span<const TraceEvent> events = {});

/// force.png: components and norm against time with events above, axial and lateral force against depth below.
picture::Picture draw_force_figure(const ForceTrace& trace, std::span<const TraceEvent> events, const Font& font,
                                   int width = 1200, int height = 900);

/// The live curve of the video: axial and lateral force against depth up to a time, with a dot at that time. Its axes
/// are those of the whole trace, so nothing moves but the curve. Dark.
picture::Picture draw_force_depth_strip(const ForceTrace& trace, double time_s, const Font& font, int width,
                                        int height);

}  // namespace stylet::figures
