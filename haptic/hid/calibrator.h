// Measures a device with its user's help: which place comes next, and what was found there.
#pragma once

#include "haptic/hid/calibration.h"
#include "haptic/hid/stylus_map.h"

#include <stdexcept>
#include <string>
#include <vector>

namespace stylet::haptic::hid {

/// The places do not make a calibration. One line: what is wrong, what to do.
class CalibrationError final : public std::runtime_error {
public:
  using std::runtime_error::runtime_error;
};

struct CalibratorSettings {
  double still_s = 1;        ///< that the hand holds still at a place
  double still_m = 0.003;    ///< and how far it may stray meanwhile, from end to end
  double apart_m = 0.03;     ///< a corner from any place before it
  double span_m = 0.15;      ///< in the patient, that the shorter side of the corners shall reach over
  double most_scale = 4;     ///< of the span; the least is 1
  double still_share = 0.1;  ///< of the full deflection, that an axis at rest may stray
};

/// Styluses are taken to their rest place and to four corners, pens to four corners, joysticks to their rest place;
/// space mice are pushed once and let go. Depends on its inputs only.
class Calibrator {
public:
  explicit Calibrator(DeviceKind kind, const CalibratorSettings& settings = {});

  /// What the user is to do now, one sentence; empty: nothing more.
  std::string prompt() const;
  bool done() const { return next_ == steps_.size(); }
  /// The newest reading, at least every 50 ms, whether a report came or not. @return whether a step is done by it
  bool add(const HidReading& reading, double time_s);
  /// Once it is done. @throws CalibrationError
  Calibration result() const;

private:
  enum class Step { kRest, kNearLeft, kNearRight, kFarRight, kFarLeft, kPush, kRelease };
  using Values = Eigen::Matrix<double, 6, 1>;

  bool usable(const HidReading& reading) const;
  bool is_new_place(const Eigen::Vector3d& place) const;
  void restart(const Values& values, double time_s);
  const Eigen::Vector3d& place(Step step) const;
  void align(Calibration& found) const;

  DeviceKind kind_;
  CalibratorSettings settings_;
  std::vector<Step> steps_;
  std::size_t next_ = 0;
  std::vector<Eigen::Vector3d> places_;  // of the steps done
  // While the hand is still.
  bool started_ = false;
  double since_s_ = 0;
  Values lowest_ = Values::Zero();
  Values highest_ = Values::Zero();
};

}  // namespace stylet::haptic::hid
