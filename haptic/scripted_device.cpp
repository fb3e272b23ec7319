#include "haptic/scripted_device.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <utility>

namespace stylet::haptic {
namespace {

void check_motion(const ScriptedMotion& m) {
  const auto require = [](bool ok, const char* what) {
    if (!ok) throw std::invalid_argument(std::string("scripted stylus: ") + what);
  };
  require(m.entry.allFinite() && m.target.allFinite() && (m.target - m.entry).norm() > 1e-4,
          "entry and target must be finite and at least 0.1 mm apart");
  const Eigen::Vector3d axis = (m.target - m.entry).normalized();
  require(m.bevel.allFinite() && axis.cross(m.bevel).norm() > 1e-3 * m.bevel.norm() && m.bevel.norm() > 0,
          "the bevel normal must not be zero or along the needle");
  require(m.needle_length > 0 && std::isfinite(m.needle_length), "the needle length must be positive");
  require(m.duration_s > 0 && std::isfinite(m.duration_s), "the duration must be positive");
  require(std::isfinite(m.lateral_amplitude), "the lateral amplitude must be finite");
  require(m.depth.size() >= 2 && m.depth.front().time_fraction == 0 && m.depth.back().time_fraction == 1,
          "the depth keys must start at time fraction 0 and end at 1");
  for (std::size_t i = 1; i < m.depth.size(); ++i) {
    require(m.depth[i].time_fraction > m.depth[i - 1].time_fraction && std::isfinite(m.depth[i].depth_fraction),
            "the time fractions of the depth keys must increase");
  }
}

/// From 0 to 1 with minimum jerk (Flash & Hogan 1985): speed and acceleration are zero at both ends.
double minimum_jerk(double s) {
  return s * s * s * (10 + s * (6 * s - 15));
}

}  // namespace

ScriptedDevice::ScriptedDevice(const ScriptedMotion& motion, DeviceLimits limits, std::string name)
    : name_(std::move(name)), limits_(limits), motion_(motion) {
  check_motion(motion_);
  length_ = (motion_.target - motion_.entry).norm();
  axis_ = (motion_.target - motion_.entry) / length_;
  bevel_ = (motion_.bevel - axis_ * axis_.dot(motion_.bevel)).normalized();
  Eigen::Matrix3d patient_from_needle;
  patient_from_needle << bevel_, axis_.cross(bevel_), axis_;
  orientation_ = Eigen::Quaterniond(patient_from_needle).normalized();
  // The first way into the tissue: from a key not below the entry to a deeper one.
  first_insertion_ = motion_.depth.size();
  for (std::size_t i = 0; i + 1 < motion_.depth.size(); ++i) {
    if (motion_.depth[i].depth_fraction >= 0 &&
        motion_.depth[i + 1].depth_fraction > motion_.depth[i].depth_fraction) {
      first_insertion_ = i;
      break;
    }
  }
}

StylusSample ScriptedDevice::read(double now_s) {
  const std::vector<ScriptedMotion::DepthKey>& keys = motion_.depth;
  const double t = std::clamp(now_s / motion_.duration_s, 0.0, 1.0);
  std::size_t i = 0;
  while (i + 2 < keys.size() && t >= keys[i + 1].time_fraction) ++i;
  const double s = (t - keys[i].time_fraction) / (keys[i + 1].time_fraction - keys[i].time_fraction);
  const double u = minimum_jerk(s);
  const double depth = length_ * (keys[i].depth_fraction + u * (keys[i + 1].depth_fraction - keys[i].depth_fraction));
  const double lateral = i == first_insertion_ ? motion_.lateral_amplitude * std::sin(2 * std::numbers::pi * u) : 0.0;

  StylusSample out;
  out.time_s = now_s;
  out.position = motion_.entry + axis_ * (depth - motion_.needle_length) + bevel_ * lateral;
  out.orientation = orientation_;
  out.valid = true;
  return out;
}

}  // namespace stylet::haptic
