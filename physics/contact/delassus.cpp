#include "physics/contact/delassus.h"

#include <algorithm>
#include <numeric>

namespace stylet::physics {

using Eigen::Vector3d;

namespace {

constexpr int kTileRows = 8;
constexpr int kTileColumns = 4;

int whole_tiles(int rows) {
  return (rows + kTileRows - 1) / kTileRows * kTileRows;
}

/// C += A^T B for a tile of 8 x 4, which stays in registers: A and B are rows of eight and four values, `stride`
/// apart. Eigen's packets because -ffp-contract=off keeps the compiler from fusing.
void add_tile(double* c, int c_stride, const double* a, const double* b, int depth, int stride) {
  using Packet = Eigen::internal::packet_traits<double>::type;
  constexpr int kLanes = Eigen::internal::packet_traits<double>::size;
  constexpr int kPackets = kTileRows / kLanes;
  Packet sum[kTileColumns][kPackets];
  for (auto& column : sum) {
    for (Packet& p : column) p = Eigen::internal::pset1<Packet>(0.0);
  }
  for (int k = 0; k < depth; ++k, a += stride, b += stride) {
    Packet left[kPackets];
    for (int p = 0; p < kPackets; ++p) left[p] = Eigen::internal::ploadu<Packet>(a + p * kLanes);
    for (int j = 0; j < kTileColumns; ++j) {
      const Packet right = Eigen::internal::pset1<Packet>(b[j]);
      for (int p = 0; p < kPackets; ++p) sum[j][p] = Eigen::internal::pmadd(left[p], right, sum[j][p]);
    }
  }
  for (int j = 0; j < kTileColumns; ++j) {
    double* target = c + static_cast<Eigen::Index>(j) * c_stride;
    for (int p = 0; p < kPackets; ++p) {
      const Packet before = Eigen::internal::ploadu<Packet>(target + p * kLanes);
      Eigen::internal::pstoreu(target + p * kLanes, Eigen::internal::padd(before, sum[j][p]));
    }
  }
}

/// Motion of the shaft's surface around the tangent per turn of a node of the beam, m.
double turn_weight(const ActiveContact& contact, std::size_t side) {
  const double x = contact.shaft.beam_fraction;
  return contact.lever * (side == 0 ? 1 - x : x);
}

}  // namespace

Delassus::Delassus(int node_count, int max_rows)
    : w_(Eigen::MatrixXd::Zero(whole_tiles(max_rows), whole_tiles(max_rows))),
      forward_(static_cast<std::size_t>(6 * node_count) * static_cast<std::size_t>(whole_tiles(max_rows))),
      row_stride_(whole_tiles(max_rows)),
      first_node_(static_cast<std::size_t>(row_stride_)),
      reached_(static_cast<std::size_t>(node_count)) {}

void Delassus::assemble(const Needle& needle, const TissuePoints& tissue, const std::vector<ActiveContact>& contacts,
                        int contact_count) {
  place_rows(needle, contacts, contact_count);
  couple(needle, tissue, contacts);
}

void Delassus::place_rows(const Needle& needle, const std::vector<ActiveContact>& contacts, int contact_count) {
  contact_count_ = contact_count;
  rows_ = row_count(contacts, contact_count);
  const int dofs = 6 * needle.node_count();
  for (int r = 0; r < dofs; ++r) std::fill_n(forward_.data() + r * row_stride_, whole_tiles(rows_), 0.0);
  std::fill(reached_.begin(), reached_.end(), 0);
  std::fill(first_node_.begin(), first_node_.end(), needle.node_count());
  for (int c = 0; c < contact_count; ++c) {
    const ActiveContact& contact = contacts[c];
    std::fill_n(first_node_.begin() + contact.first_row, contact.row_count, contact.shaft.beam);
    int& reached = reached_[contact.shaft.beam];
    reached = std::max(reached, contact.first_row + contact.row_count);
    for (std::size_t side = 0; side < 2; ++side) {
      const int node = contact.shaft.beam + static_cast<int>(side);
      if (node == 0 && !needle.base_is_free()) continue;  // a prescribed node does not yield
      const Vector3d& arm = contact.shaft.arms[side];
      for (int k = 0; k < contact.force_rows(); ++k) {
        const Vector3d n = contact.directions.col(k);
        double* row = forward_.data() + 6 * node * row_stride_ + contact.first_row + k;
        for (int d = 0; d < 3; ++d) row[d * row_stride_] = contact.shaft.weights[side] * n[d];
        if (arm.isZero(0)) continue;
        const Vector3d spin = arm.cross(n);
        for (int d = 0; d < 3; ++d) row[(3 + d) * row_stride_] = spin[d];
      }
      if (contact.turns()) {
        const Vector3d spin = turn_weight(contact, side) * contact.directions.col(2);
        double* row = forward_.data() + 6 * node * row_stride_ + contact.first_row + 3;
        for (int d = 0; d < 3; ++d) row[(3 + d) * row_stride_] = spin[d];
      }
    }
  }
  std::partial_sum(reached_.begin(), reached_.end(), reached_.begin(), [](int a, int b) { return std::max(a, b); });
}

void Delassus::couple(const Needle& needle, const TissuePoints& tissue, const std::vector<ActiveContact>& contacts) {
  w_.topLeftCorner(whole_tiles(rows_), whole_tiles(rows_)).setZero();
  add_tissue(tissue, contacts);
  mean_tissue_compliance_ = rows_ > 0 ? w_.topLeftCorner(rows_, rows_).diagonal().mean() : 0.0;
  add_needle(needle);
}

void Delassus::add_tissue(const TissuePoints& tissue, const std::vector<ActiveContact>& contacts) {
  for (int j = 0; j < contact_count_; ++j) {
    const ActiveContact& cj = contacts[j];
    for (int i = j; i < contact_count_; ++i) {
      const ActiveContact& ci = contacts[i];
      if (tissue.body(ci.point) != tissue.body(cj.point) && !tissue.bodies_coupled()) continue;
      const Eigen::Matrix3d compliance = tissue.compliance(ci.point, cj.point);
      for (int k = 0; k < cj.force_rows(); ++k) {
        const Vector3d moved = compliance * cj.directions.col(k);
        for (int m = 0; m < ci.force_rows(); ++m) {
          w_(ci.first_row + m, cj.first_row + k) += ci.directions.col(m).dot(moved);
        }
      }
    }
  }
}

// W_n = Y^T Y with L Y = H_n^T, in tiles of the lower triangle; Y is zero where a contact lies beyond the node.
void Delassus::add_needle(const Needle& needle) {
  needle.factor().forward_solve(forward_.data(), reached_, row_stride_);
  const int rows = whole_tiles(rows_);
  const auto first_of = [&](int start, int count) {
    return *std::min_element(first_node_.begin() + start, first_node_.begin() + start + count);
  };
  for (int c = 0; c < rows_; c += kTileColumns) {
    const int first_of_columns = first_of(c, kTileColumns);
    for (int r = c / kTileRows * kTileRows; r < rows; r += kTileRows) {
      const int first = std::max(first_of_columns, first_of(r, kTileRows));
      const int depth = 6 * (needle.node_count() - first);
      const double* y = forward_.data() + static_cast<Eigen::Index>(6) * first * row_stride_;
      add_tile(w_.col(c).data() + r, row_stride_, y + r, y + c, depth, row_stride_);
    }
  }
}

int row_count(const std::vector<ActiveContact>& contacts, int contact_count) {
  if (contact_count == 0) return 0;
  const ActiveContact& last = contacts[static_cast<std::size_t>(contact_count) - 1];
  return last.first_row + last.row_count;
}

void free_violation(Eigen::Ref<const Eigen::VectorXd> motion, const TissuePoints& tissue,
                    const std::vector<ActiveContact>& contacts, int contact_count,
                    Eigen::Ref<Eigen::VectorXd> delta) {
  for (int c = 0; c < contact_count; ++c) {
    const ActiveContact& contact = contacts[c];
    Vector3d gap = contact.shaft.position - tissue.free_position(contact.point);
    for (std::size_t side = 0; side < 2; ++side) {
      const Eigen::Index at = 6 * (contact.shaft.beam + static_cast<Eigen::Index>(side));
      gap += contact.shaft.weights[side] * motion.segment<3>(at);
      gap += motion.segment<3>(at + 3).cross(contact.shaft.arms[side]);
    }
    delta.segment(contact.first_row, contact.force_rows()) = contact.rows().transpose() * gap;
    if (!contact.turns()) continue;
    double turn = 0;
    for (std::size_t side = 0; side < 2; ++side) {
      const Eigen::Index at = 6 * (contact.shaft.beam + static_cast<Eigen::Index>(side));
      turn += turn_weight(contact, side) * motion.segment<3>(at + 3).dot(contact.directions.col(2));
    }
    delta[contact.first_row + 3] = turn;
  }
}

void needle_load(const std::vector<ActiveContact>& contacts, int contact_count,
                 Eigen::Ref<const Eigen::VectorXd> lambda, Eigen::Ref<Eigen::VectorXd> load) {
  load.setZero();
  for (int c = 0; c < contact_count; ++c) {
    const ActiveContact& contact = contacts[c];
    const Vector3d force = contact.rows() * lambda.segment(contact.first_row, contact.force_rows());
    for (std::size_t side = 0; side < 2; ++side) {
      const Eigen::Index at = 6 * (contact.shaft.beam + static_cast<Eigen::Index>(side));
      load.segment<3>(at) += contact.shaft.weights[side] * force;
      load.segment<3>(at + 3) += contact.shaft.arms[side].cross(force);
      if (!contact.turns()) continue;
      load.segment<3>(at + 3) +=
          turn_weight(contact, side) * lambda[contact.first_row + 3] * contact.directions.col(2);
    }
  }
}

}  // namespace stylet::physics
