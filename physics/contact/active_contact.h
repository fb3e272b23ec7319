// A contact of one haptic step: which point of the tissue meets which point of the shaft, and along which directions.
#pragma once

#include "physics/contact/shaft.h"

#include <Eigen/Core>

#include <algorithm>

namespace stylet::physics {

/// A tissue point in touch with the shaft in this step, with 1 to 4 rows of the contact system: forces along up to
/// three directions, then one about the third.
struct ActiveContact {
  int point = 0;      ///< index into TissuePoints
  int first_row = 0;  ///< its rows are first_row .. first_row + row_count - 1
  int row_count = 2;
  ShaftPoint shaft;
  Eigen::Matrix3d directions = Eigen::Matrix3d::Zero();  ///< the first row_count columns: unit
  double lever = 0;  ///< of the fourth row, whose force acts this far off the axis and turns the shaft, m
  int force_rows() const { return std::min(row_count, 3); }
  bool turns() const { return row_count > 3; }
  auto rows() const { return directions.leftCols(force_rows()); }
};

/// A contact with the two lateral rows alone.
inline ActiveContact lateral_contact(int point, int first_row, const ShaftPoint& shaft,
                                     const Eigen::Matrix<double, 3, 2>& directions) {
  ActiveContact contact{.point = point, .first_row = first_row, .row_count = 2, .shaft = shaft, .directions = {}};
  contact.directions << directions, Eigen::Vector3d::Zero();
  return contact;
}

}  // namespace stylet::physics
