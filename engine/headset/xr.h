// What every use of OpenXR here needs: errors in one line, and poses as Eigen has them.
#pragma once

#include <Eigen/Geometry>

#include <openxr/openxr.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>
#include <string_view>

namespace stylet::headset {

/// One line: what the runtime of the headset refused or lacks. `code` tells a loss from the rest.
class HeadsetError : public std::runtime_error {
public:
  explicit HeadsetError(const std::string& what, XrResult code = XR_ERROR_RUNTIME_FAILURE)
      : std::runtime_error(what), code_(code) {}
  XrResult code() const { return code_; }

private:
  XrResult code_;
};

namespace xr {

/// Name of a result code, "XR_ERROR_SESSION_LOST".
const char* result_name(XrResult result);

/// Throws HeadsetError "xrWaitFrame: XR_ERROR_SESSION_LOST" for an error; success codes pass.
void check(XrResult result, const char* call);

inline Eigen::Isometry3d pose(const XrPosef& p) {
  Eigen::Isometry3d out = Eigen::Isometry3d::Identity();
  out.translate(Eigen::Vector3d(p.position.x, p.position.y, p.position.z));
  out.rotate(Eigen::Quaterniond(p.orientation.w, p.orientation.x, p.orientation.y, p.orientation.z).normalized());
  return out;
}

/// It is a place and a rotation: a runtime may call valid what is no number.
inline bool is_pose(const XrPosef& p) {
  const Eigen::Vector4f q(p.orientation.x, p.orientation.y, p.orientation.z, p.orientation.w);
  const bool place = std::isfinite(p.position.x) && std::isfinite(p.position.y) && std::isfinite(p.position.z);
  return place && q.allFinite() && q.norm() > 0.5F;
}

/// Into an array of a struct; cut where it is too long.
template <std::size_t N>
void put_text(char (&to)[N], std::string_view text) {
  const std::size_t length = std::min(text.size(), N - 1);
  std::copy_n(text.data(), length, to);
  to[length] = '\0';
}

inline constexpr XrPosef kIdentityPose{{0, 0, 0, 1}, {0, 0, 0}};

}  // namespace xr
}  // namespace stylet::headset
