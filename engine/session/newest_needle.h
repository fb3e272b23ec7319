// The needle as the haptic loop has it now: pictures of the simulation's states show it as it was.
#pragma once

#include "engine/session/coupled_loops.h"
#include "engine/state/frame_state.h"
#include "physics/messages/latest_value.h"

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <algorithm>
#include <span>
#include <vector>

namespace stylet::session {

/// Keeps the shape of the needle after every haptic step. The haptic thread writes, one other reads.
class NewestNeedle final : public StepListener {
public:
  /// @param rest  has as many needle nodes as all states to come
  explicit NewestNeedle(const state::FrameState& rest)
      : latest_(Shape{rest.needle_positions, rest.needle_orientations}) {}

  /// @realtime
  void haptic_stepped(const recording::HapticStepRecord& record, const physics::NeedleState& needle) override {
    Shape& shape = latest_.back();
    if (static_cast<std::size_t>(needle.node_count) != shape.positions.size()) return;
    for (int i = 0; i < needle.node_count; ++i) {
      shape.positions[i] = needle.positions.col(i).cast<float>();
      shape.orientations[i] = needle.orientations[i].cast<float>();
    }
    shape.time_s = record.time_s;
    latest_.publish();
  }

  /// Reader: replaces the needle of a picture, if it has one. Before the first step nothing.
  void show(std::span<Eigen::Vector3f> positions, std::span<Eigen::Quaternionf> orientations) {
    known_ = latest_.update() || known_;
    const Shape& shape = latest_.front();
    if (!known_ || positions.size() != shape.positions.size()) return;
    std::copy(shape.positions.begin(), shape.positions.end(), positions.begin());
    std::copy(shape.orientations.begin(), shape.orientations.end(), orientations.begin());
  }

  /// Reader: session time of the step that was shown last, s.
  double shown_s() const { return latest_.front().time_s; }

private:
  struct Shape {
    std::vector<Eigen::Vector3f> positions;
    std::vector<Eigen::Quaternionf> orientations;
    double time_s = 0;
  };
  physics::LatestValue<Shape> latest_;
  bool known_ = false;  // reader's
};

}  // namespace stylet::session
