#include "physics/contact/delassus.h"

#include <algorithm>

namespace stylet::physics {

using Eigen::Vector3d;

Delassus::Delassus(int node_count, int max_rows)
    : w_(Eigen::MatrixXd::Zero(max_rows, max_rows)),
      forward_(static_cast<std::size_t>(6 * node_count) * static_cast<std::size_t>(max_rows)),
      row_stride_(max_rows) {}

void Delassus::assemble(const Needle& needle, const TissuePoints& tissue, const std::vector<ActiveContact>& contacts,
                        int contact_count) {
  place_rows(needle, contacts, contact_count);
  couple(needle, tissue, contacts);
}

void Delassus::place_rows(const Needle& needle, const std::vector<ActiveContact>& contacts, int contact_count) {
  contact_count_ = contact_count;
  rows_ = row_count(contacts, contact_count);
  const int dofs = 6 * needle.node_count();
  for (int r = 0; r < dofs; ++r) std::fill_n(forward_.data() + r * row_stride_, rows_, 0.0);
  for (int c = 0; c < contact_count; ++c) {
    const ActiveContact& contact = contacts[static_cast<std::size_t>(c)];
    for (std::size_t side = 0; side < 2; ++side) {
      const int node = contact.shaft.beam + static_cast<int>(side);
      if (node == 0 && !needle.base_is_free()) continue;  // a prescribed node does not yield
      const Vector3d& arm = contact.shaft.arms[side];
      for (int k = 0; k < contact.row_count; ++k) {
        const Vector3d n = contact.directions.col(k);
        double* row = forward_.data() + 6 * node * row_stride_ + contact.first_row + k;
        for (int d = 0; d < 3; ++d) row[d * row_stride_] = contact.shaft.weights[side] * n[d];
        if (arm.isZero(0)) continue;
        const Vector3d spin = arm.cross(n);
        for (int d = 0; d < 3; ++d) row[(3 + d) * row_stride_] = spin[d];
      }
    }
  }
}

void Delassus::couple(const Needle& needle, const TissuePoints& tissue, const std::vector<ActiveContact>& contacts) {
  w_.topLeftCorner(rows_, rows_).setZero();
  add_tissue(tissue, contacts);
  mean_tissue_compliance_ = rows_ > 0 ? w_.topLeftCorner(rows_, rows_).diagonal().mean() : 0.0;
  add_needle(needle);
}

void Delassus::add_tissue(const TissuePoints& tissue, const std::vector<ActiveContact>& contacts) {
  for (int j = 0; j < contact_count_; ++j) {
    const ActiveContact& cj = contacts[static_cast<std::size_t>(j)];
    for (int i = j; i < contact_count_; ++i) {
      const ActiveContact& ci = contacts[static_cast<std::size_t>(i)];
      if (tissue.body(ci.point) != tissue.body(cj.point)) continue;
      const Eigen::Matrix3d compliance = tissue.compliance(ci.point, cj.point);
      for (int k = 0; k < cj.row_count; ++k) {
        const Vector3d moved = compliance * cj.directions.col(k);
        for (int m = 0; m < ci.row_count; ++m) {
          w_(ci.first_row + m, cj.first_row + k) += ci.directions.col(m).dot(moved);
        }
      }
    }
  }
}

void Delassus::add_needle(const Needle& needle) {
  using Row = Eigen::Map<const Eigen::ArrayXd>;
  needle.factor().forward_solve(forward_.data(), rows_, row_stride_);

  // W_n = Y^T Y, six DOFs (a node) at a time; Y is zero where a contact lies beyond the node.
  for (int node = 0; node < needle.node_count(); ++node) {
    const double* y = forward_.data() + 6 * node * row_stride_;
    for (int j = 0; j < rows_; ++j) {
      const double* column = y + j;
      const auto tail = [&](int d) { return Row(column + d * row_stride_, rows_ - j); };
      const auto a = [&](int d) { return column[d * row_stride_]; };
      w_.col(j).segment(j, rows_ - j).array() +=
          a(0) * tail(0) + a(1) * tail(1) + a(2) * tail(2) + a(3) * tail(3) + a(4) * tail(4) + a(5) * tail(5);
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
    const ActiveContact& contact = contacts[static_cast<std::size_t>(c)];
    Vector3d gap = contact.shaft.position - tissue.free_position(contact.point);
    for (std::size_t side = 0; side < 2; ++side) {
      const Eigen::Index at = 6 * (contact.shaft.beam + static_cast<Eigen::Index>(side));
      gap += contact.shaft.weights[side] * motion.segment<3>(at);
      gap += motion.segment<3>(at + 3).cross(contact.shaft.arms[side]);
    }
    delta.segment(contact.first_row, contact.row_count) = contact.rows().transpose() * gap;
  }
}

void needle_load(const std::vector<ActiveContact>& contacts, int contact_count,
                 Eigen::Ref<const Eigen::VectorXd> lambda, Eigen::Ref<Eigen::VectorXd> load) {
  load.setZero();
  for (int c = 0; c < contact_count; ++c) {
    const ActiveContact& contact = contacts[static_cast<std::size_t>(c)];
    const Vector3d force = contact.rows() * lambda.segment(contact.first_row, contact.row_count);
    for (std::size_t side = 0; side < 2; ++side) {
      const Eigen::Index at = 6 * (contact.shaft.beam + static_cast<Eigen::Index>(side));
      load.segment<3>(at) += contact.shaft.weights[side] * force;
      load.segment<3>(at + 3) += contact.shaft.arms[side].cross(force);
    }
  }
}

}  // namespace stylet::physics
