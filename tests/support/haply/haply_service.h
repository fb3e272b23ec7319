// The Haply Inverse Service as its documentation has it, without a network: what it says and what it does with a
// force.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <cstdint>
#include <functional>
#include <limits>
#include <string>
#include <string_view>
#include <vector>

namespace stylet::support {

struct HaplyHand {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();  ///< m; X right, Y away, Z up
  Eigen::Quaterniond orientation = Eigen::Quaterniond::Identity();
  bool a = false;
  bool b = false;
};

/// Strict: one answer for each message, unknown keys ignored, a force counts for kIdle and is then forgotten. Depends
/// on the calls and their times only (ns).
class HaplyService {
public:
  // What it is like.
  std::string arm = "049D";
  std::string grip = "6F21";  ///< empty: none
  bool second_grip = false;
  bool takes_vector = true;
  bool takes_values = false;
  std::string basis = "XYZ";  ///< that it keeps whatever is asked; empty: as asked
  std::function<HaplyHand(double time_s)> motion{};
  std::int64_t idle_ns = std::numeric_limits<std::int64_t>::max();  ///< without a message until the force is dropped

  // What is wrong with it.
  bool vanished = false;  ///< the arm
  bool powered = true;
  bool calibrated = true;
  bool grip_sleeps = false;
  bool echoes = true;  ///< tells the force that it was commanded
  bool other_schema = false;
  bool echoes_zero = false;  ///< tells none
  double gives = 1;          ///< what it tells, over what it was commanded
  double other_force = 0;    ///< of another program, up, N: told, not in applied()
  bool keeps_force = false;  ///< when a session ends
  std::string position_x{};  ///< written instead of the number

  std::string inventory(std::int64_t now_ns) { return state(now_ns, true); }
  /// Takes the message and answers.
  std::string answer(std::string_view text, std::int64_t now_ns);
  /// A session ends: its forces go with it.
  void disconnect() {
    if (!keeps_force) force_.setZero();
  }
  /// The hand's motion begins with the next message.
  void begin_again() { began_ns_ = -1; }

  /// N, by the motors, axes of the service.
  Eigen::Vector3d applied(std::int64_t now_ns) const;
  bool configured() const { return configured_; }
  std::uint64_t messages() const { return messages_; }
  std::uint64_t nonsense() const { return nonsense_; }  ///< messages that were no JSON
  std::uint64_t forces() const { return forces_; }      ///< that were taken and not zero
  double largest() const { return strongest_.norm(); }
  const Eigen::Vector3d& strongest() const { return strongest_; }  ///< N, axes of the service

private:
  std::string state(std::int64_t now_ns, bool whole);

  bool configured_ = false;
  std::uint64_t messages_ = 0;
  std::uint64_t nonsense_ = 0;
  std::uint64_t forces_ = 0;
  Eigen::Vector3d strongest_ = Eigen::Vector3d::Zero();
  std::int64_t began_ns_ = -1;
  std::int64_t force_ns_ = 0;
  Eigen::Vector3d force_ = Eigen::Vector3d::Zero();
};

}  // namespace stylet::support
