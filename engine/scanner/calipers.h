// Distances that are measured on an ultrasound image: the marks of its calipers. Pure.
#pragma once

#include <Eigen/Core>

#include <optional>
#include <string>
#include <vector>

namespace stylet::scanner {

/// Between two points of the image plane, (x, z) in the probe frame, m: marks stay where they are in the body when
/// depth or window change.
struct Measure {
  Eigen::Vector2d from = Eigen::Vector2d::Zero();
  Eigen::Vector2d to = Eigen::Vector2d::Zero();

  double distance() const { return (to - from).norm(); }  ///< m
};
/// "23.4 mm": of two points that a hand has set, more digits would be made up.
std::string distance_text(const Measure& measure);

/// A press sets the first point, the second follows the pointer until another press, or until a button that was
/// pressed for a way is let go.
class Calipers {
public:
  /// More at a time cannot be told apart on the image; the oldest goes.
  static constexpr std::size_t kMost = 8;

  void press(const Eigen::Vector2d& at);
  void move(const Eigen::Vector2d& at);
  /// @param least  m between press and release that make a drag
  void release(const Eigen::Vector2d& at, double least);
  /// The one that is under way, else the newest.
  void remove_last();
  void clear();

  /// In the order in which they were begun, the one under way last.
  const std::vector<Measure>& measures() const { return measures_; }
  /// The second point of the last one follows the pointer.
  bool under_way() const { return under_way_; }
  /// Whose two points are set. m
  std::vector<double> distances() const;

private:
  std::vector<Measure> measures_;
  bool under_way_ = false;
};

}  // namespace stylet::scanner
