// A made-up tissue patch around a needle: random tetrahedra with a positive definite compliance.
#pragma once

#include "physics/contact/shaft.h"
#include "physics/messages/messages.h"

#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <random>
#include <stdexcept>
#include <string>

namespace stylet::physics::testing {

/// Lays `contacts` contacts on the needle's shaft, evenly from arc fraction `from` to `to` of the needle, each in its
/// own random tetrahedron around the point (neighbours share one node where `share_nodes`). Compliance decays with
/// distance: W_bar = scale exp(-|x_i - x_j| / decay) I plus a random positive semi-definite part that couples axes.
/// @throws std::invalid_argument if the body has no room for them
inline void lay_synthetic_body(BodyPatch& body, const NeedleState& needle, int contacts, double from, double to,
                               unsigned seed, bool share_nodes = true, double scale = 3e-3) {
  const int nodes_needed = share_nodes ? 3 * contacts + 1 : 4 * contacts;
  if (contacts < 1 || contacts > std::ssize(body.contacts) || nodes_needed > kMaxPatchNodes) {
    throw std::invalid_argument("a synthetic body takes 1 contact or more and at most " +
                                std::to_string(kMaxPatchNodes) + " nodes, not " + std::to_string(contacts) +
                                " contacts with " + std::to_string(nodes_needed) + " nodes");
  }
  std::mt19937 engine(seed);
  std::uniform_real_distribution<double> u(-1, 1);
  const auto random = [&] {  // one after the other: arguments have no order
    const double z = u(engine), y = u(engine), x = u(engine);
    return Eigen::Vector3d(x, y, z);
  };
  const auto nodes = needle.positions.leftCols(needle.node_count);
  const int beams = needle.node_count - 1;

  body.node_count = 0;
  body.contact_count = contacts;
  Eigen::Matrix3Xd rest(3, kMaxPatchNodes);
  for (int c = 0; c < contacts; ++c) {
    const double arc = contacts == 1 ? from : from + (to - from) * c / (contacts - 1);
    const int beam = std::min(static_cast<int>(arc * beams), beams - 1);
    const ShaftPoint on_shaft = shaft_point(nodes, beam, arc * beams - beam);
    PatchContact& contact = body.contacts[c];
    contact.id = static_cast<std::uint32_t>(100 * seed + c);
    contact.tet = 10 * c;
    contact.beam = beam;
    contact.beam_fraction = on_shaft.beam_fraction;
    contact.directions = lateral_directions(on_shaft.tangent, needle.orientations[beam]);
    contact.barycentric = Eigen::Vector4d(0.4, 0.3, 0.2, 0.1) + 0.05 * Eigen::Vector4d(u(engine), 0, 0, 0);
    contact.barycentric[3] = 1 - contact.barycentric.head<3>().sum();
    Eigen::Vector3d rest_of_sum = on_shaft.position;
    for (int k = 0; k < 4; ++k) {
      if (k == 0 && c > 0 && share_nodes) {
        contact.patch_nodes[0] = body.contacts[c - 1].patch_nodes[3];
      } else {
        contact.patch_nodes[k] = body.node_count++;
        rest.col(contact.patch_nodes[k]) = on_shaft.position + 8e-3 * random();
      }
      if (k < 3) rest_of_sum -= contact.barycentric[k] * rest.col(contact.patch_nodes[k]);
    }
    rest.col(contact.patch_nodes[3]) = rest_of_sum / contact.barycentric[3];  // the point lies on the shaft
  }
  const int n = body.node_count;
  for (int i = 0; i < n; ++i) body.node_ids[i] = 3 * i + 5;
  body.free_positions.leftCols(n) = rest.leftCols(n);

  Eigen::MatrixXd mixing(3 * n, 6);
  for (int i = 0; i < mixing.size(); ++i) mixing.data()[i] = u(engine);
  Eigen::MatrixXd w_bar = 0.05 * scale * mixing.lazyProduct(mixing.transpose());
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const double distance = (rest.col(i) - rest.col(j)).norm();
      w_bar.block<3, 3>(3 * i, 3 * j).diagonal().array() += scale * std::exp(-distance / 0.02);
    }
  }
  body.set_w_bar(w_bar);
  body.condense();
}

/// A patch with one such body.
inline TissuePatch synthetic_patch(const NeedleState& needle, int contacts, double from = 0.45, double to = 0.98,
                                   unsigned seed = 1) {
  TissuePatch patch;
  patch.epoch = 1;
  patch.body_count = 1;
  lay_synthetic_body(patch.bodies[0], needle, contacts, from, to, seed);
  return patch;
}

}  // namespace stylet::physics::testing
