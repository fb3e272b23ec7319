// What the Haply Inverse Service says, by its documentation (docs.haply.co, inverseSDK 3.5).
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace stylet::haptic::haply {

/// Axes of the service with the basis XYZ: X right, Y away from the user, Z up. m, N. What a message does not carry,
/// or carries as something else than the documented type, is nothing.
struct Arm {
  std::string id{};
  std::string type{};        ///< "inverse3", "inverse3x", "minverse"; in the first message only
  std::string handedness{};  ///< the same
  std::string basis{};       ///< the same
  std::optional<Eigen::Vector3d> position{};
  std::optional<Eigen::Vector3d> force{};  ///< as the service says that it was commanded
  std::optional<bool> calibrated{};
  std::optional<bool> power{};  ///< the motors have their supply; USB alone does not drive them
  std::optional<bool> ready{};
  std::optional<bool> started{};
};

struct Grip {
  std::string id{};
  bool wireless = false;
  std::optional<Eigen::Quaterniond> orientation{};
  bool barrel = false;              ///< a, or the one button of a wired grip
  bool secondary = false;           ///< b
  bool there = true;                ///< of a wireless one: connected, awake and ready, as far as it says
  std::optional<double> battery{};  ///< 0 to 1
};

struct Message {
  std::vector<Arm> arms{};
  std::vector<Grip> grips{};
};

/// Unknown keys are ignored, as the documentation has it. @return nothing: it is no JSON object
std::optional<Message> parse_message(std::string_view text);

/// Device frame of the reports (X right, Y towards the user, Z down) from the service's: half a turn about X, and so
/// the same back.
inline Eigen::Vector3d turned(const Eigen::Vector3d& v) {
  return {v.x(), -v.y(), -v.z()};
}
inline Eigen::Quaterniond turned(const Eigen::Quaterniond& q) {
  return {q.w(), q.x(), -q.y(), -q.z()};
}

}  // namespace stylet::haptic::haply
