// One time-stamped picture of the simulated world: what a renderer needs to draw a frame.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cstdint>
#include <vector>

namespace stylet::state {

/// Patient frame, metres, newtons. Arrays are sized at load and never grow.
struct FrameState {
  double time_s = 0;  ///< session time
  std::uint64_t simulation_step = 0;
  std::uint64_t haptic_step = 0;
  std::vector<std::vector<Eigen::Vector3f>> bodies;  ///< [body][node] deformed positions
  std::vector<Eigen::Vector3f> needle_positions;     ///< [needle node] hub first
  std::vector<Eigen::Quaternionf> needle_orientations;
  Eigen::Vector3f probe_position = Eigen::Vector3f::Zero();
  Eigen::Quaternionf probe_orientation = Eigen::Quaternionf::Identity();
  Eigen::Vector3f breath = Eigen::Vector3f::Zero();  ///< motion of rigid organs that breathe, m
  Eigen::Vector3f force = Eigen::Vector3f::Zero();   ///< on the hand
  float insertion_depth = 0;                         ///< arc length of needle in tissue, m
  Eigen::Vector3f target = Eigen::Vector3f::Zero();  ///< centre of the first target as the tissue carries it
  float target_distance = 0;                         ///< tip to target centre, m
  float probe_force = 0;                             ///< that presses the probe on the skin, along its axis, N
  float probe_area = 0;                              ///< of the skin that it touches, m^2
  float probe_lifted = 0;                            ///< 1: it is to press a body and touches nothing
};

/// How a FrameState was made.
enum class Provenance : std::uint8_t {
  none,          ///< nothing was published yet
  exact,         ///< a published state
  interpolated,  ///< between two published states
  held,          ///< asked beyond what was published: the nearest one, unchanged
};

}  // namespace stylet::state
