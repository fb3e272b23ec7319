#include "engine/import/source_surface.h"

namespace stylet::import {

Eigen::Affine3d patient_from_file(Axes axes, double metres_per_unit) {
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  switch (axes) {
    case Axes::patient:
      break;
    case Axes::ras:
      turn << -1, 0, 0, 0, 0, 1, 0, 1, 0;
      break;
    case Axes::lps:
      turn << 1, 0, 0, 0, 0, 1, 0, -1, 0;
      break;
  }
  Eigen::Affine3d out = Eigen::Affine3d::Identity();
  out.linear() = metres_per_unit * turn;
  return out;
}

std::optional<Axes> stated_axes(std::string_view comment) {
  if (comment.find("SPACE=RAS") != std::string_view::npos) return Axes::ras;
  if (comment.find("SPACE=LPS") != std::string_view::npos) return Axes::lps;
  return {};
}

}  // namespace stylet::import
