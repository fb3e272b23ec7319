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
  rows_ = 2 * contact_count;
  const int dofs = 6 * needle.node_count();
  for (int r = 0; r < dofs; ++r) std::fill_n(forward_.data() + r * row_stride_, rows_, 0.0);
  for (int c = 0; c < contact_count; ++c) {
    const ActiveContact& contact = contacts[static_cast<std::size_t>(c)];
    for (int side = 0; side < 2; ++side) {
      const int node = contact.beam + side;
      if (node == 0 && !needle.base_is_free()) continue;  // a prescribed node does not yield
      const double weight = side == 0 ? 1 - contact.beam_fraction : contact.beam_fraction;
      for (int d = 0; d < 3; ++d) {
        double* row = forward_.data() + (6 * node + d) * row_stride_ + 2 * c;
        row[0] = weight * contact.directions(d, 0);
        row[1] = weight * contact.directions(d, 1);
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
  const int contact_count = rows_ / 2;
  for (int j = 0; j < contact_count; ++j) {
    const ActiveContact& cj = contacts[static_cast<std::size_t>(j)];
    for (int i = j; i < contact_count; ++i) {
      const ActiveContact& ci = contacts[static_cast<std::size_t>(i)];
      if (tissue.body(ci.point) != tissue.body(cj.point)) continue;
      const Eigen::Matrix<double, 3, 2> moved = tissue.compliance(ci.point, cj.point) * cj.directions;
      w_.block<2, 2>(2 * i, 2 * j) += ci.directions.transpose() * moved;
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

void free_violation(const NeedleShape& shape, Eigen::Ref<const Eigen::VectorXd> motion, const TissuePoints& tissue,
                    const std::vector<ActiveContact>& contacts, int contact_count,
                    Eigen::Ref<Eigen::VectorXd> delta) {
  for (int c = 0; c < contact_count; ++c) {
    const ActiveContact& contact = contacts[static_cast<std::size_t>(c)];
    const int a = contact.beam;
    const int b = contact.beam + 1;
    const Vector3d first = shape.positions.col(a) + motion.segment<3>(6 * a);
    const Vector3d second = shape.positions.col(b) + motion.segment<3>(6 * b);
    const Vector3d gap = first + contact.beam_fraction * (second - first) - tissue.free_position(contact.point);
    delta.segment<2>(2 * c) = contact.directions.transpose() * gap;
  }
}

void needle_load(const std::vector<ActiveContact>& contacts, int contact_count,
                 Eigen::Ref<const Eigen::VectorXd> lambda, Eigen::Ref<Eigen::VectorXd> load) {
  load.setZero();
  for (int c = 0; c < contact_count; ++c) {
    const ActiveContact& contact = contacts[static_cast<std::size_t>(c)];
    const Vector3d force = contact.directions * lambda.segment<2>(2 * c);
    load.segment<3>(6 * contact.beam) += (1 - contact.beam_fraction) * force;
    load.segment<3>(6 * (contact.beam + 1)) += contact.beam_fraction * force;
  }
}

}  // namespace stylet::physics
