// A stylus that repeats a recorded track of poses.
#pragma once

#include "haptic/device.h"

#include <string>
#include <vector>

namespace stylet::haptic {

/// Plays a track back as a motion that is continuously differentiable for all times: the force depends on the pose
/// and on its rate, and a kink every sample of the track would be felt as a buzz.
///
/// Position: per axis, the cubic Hermite interpolant with the slopes of Fritsch & Butland (SIAM J. Sci. Stat. Comput.
/// 5(2), 1984), which never leaves the range of the two neighbouring samples. Orientation: the same interpolant on
/// the components of the quaternions (taken in one hemisphere), normalised. Before the first and after the last
/// sample the stylus rests there; the slopes at both ends are zero so that this too is differentiable. Buttons and
/// validity are those of the latest sample not after the time.
class RecordedDevice final : public Device {
public:
  /// @param track  at least one sample, finite, times strictly increasing (s), orientations non-zero
  /// @throws std::invalid_argument  one line with the index of the offending sample
  explicit RecordedDevice(std::vector<StylusSample> track, DeviceLimits limits = {},
                          std::string name = "recorded stylus");

  std::string name() const override { return name_; }
  DeviceLimits limits() const override { return limits_; }
  /// A pure function of the time. @realtime O(log samples)
  StylusSample read(double now_s) override;
  /// The recorded hand feels nothing.
  void write(const Eigen::Vector3d&, const Eigen::Vector3d&) override {}

  double start_s() const { return track_.front().time_s; }
  double end_s() const { return track_.back().time_s; }

private:
  using Key = Eigen::Matrix<double, 7, 1>;  // position, then quaternion x y z w

  std::string name_;
  DeviceLimits limits_;
  std::vector<StylusSample> track_;
  std::vector<Key> keys_;    // [samples] values that are interpolated
  std::vector<Key> slopes_;  // [samples] their time derivatives
};

}  // namespace stylet::haptic
