#include "physics/tissue/warped_compliance.h"

namespace stylet::physics {

void warp_compliance(std::span<const Eigen::Quaterniond> rotations, Eigen::Ref<Eigen::MatrixXd> w_bar) {
  const auto nodes = static_cast<Eigen::Index>(rotations.size());
  for (Eigen::Index b = 0; b < nodes; ++b) {
    const Eigen::Matrix3d r_b = rotations[b].toRotationMatrix();
    for (Eigen::Index a = b; a < nodes; ++a) {
      const Eigen::Matrix3d r_a = rotations[a].toRotationMatrix();
      const Eigen::Matrix3d then = w_bar.block<3, 3>(3 * a, 3 * b);
      Eigen::Matrix3d now = r_a * then * r_b.transpose();
      if (a == b) now = (0.5 * (now + now.transpose())).eval();  // symmetric up to rounding: make it exactly so
      w_bar.block<3, 3>(3 * a, 3 * b) = now;
      w_bar.block<3, 3>(3 * b, 3 * a) = now.transpose();
    }
  }
}

}  // namespace stylet::physics
