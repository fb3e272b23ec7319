#include "physics/contact/panel_ldl.h"

#include <algorithm>
#include <cmath>

namespace stylet::physics {
namespace {

constexpr int kPanel = PanelLdl::kPanel;

int whole_panels(int rows) {
  return (rows + kPanel - 1) / kPanel * kPanel;
}

/// C -= A B.  C [rows x 8] and A [rows x depth] by columns, B [depth x 8] by rows; rows a multiple of eight.
/// Tiles of 8 x 4 stay in registers; Eigen's packets because -ffp-contract=off keeps the compiler from fusing.
void subtract_product(double* c, const double* a, const double* b, int rows, int depth, int c_stride, int a_stride) {
  using Packet = Eigen::internal::packet_traits<double>::type;
  constexpr int kLanes = Eigen::internal::packet_traits<double>::size;
  constexpr int kPackets = kPanel / kLanes;
  constexpr int kColumns = 4;
  for (int row = 0; row < rows; row += kPanel) {
    for (int half = 0; half < kPanel; half += kColumns) {
      Packet sum[kColumns][kPackets];
      for (int j = 0; j < kColumns; ++j) {
        for (int p = 0; p < kPackets; ++p) sum[j][p] = Eigen::internal::pset1<Packet>(0.0);
      }
      const double* left = a + row;
      const double* right = b + half;
      for (int k = 0; k < depth; ++k, left += a_stride, right += kPanel) {
        Packet l[kPackets];
        for (int p = 0; p < kPackets; ++p) l[p] = Eigen::internal::ploadu<Packet>(left + p * kLanes);
        for (int j = 0; j < kColumns; ++j) {
          const Packet r = Eigen::internal::pset1<Packet>(right[j]);
          for (int p = 0; p < kPackets; ++p) sum[j][p] = Eigen::internal::pmadd(l[p], r, sum[j][p]);
        }
      }
      for (int j = 0; j < kColumns; ++j) {
        double* target = c + row + static_cast<Eigen::Index>(half + j) * c_stride;
        for (int p = 0; p < kPackets; ++p) {
          Eigen::internal::pstoreu(
              target + p * kLanes,
              Eigen::internal::psub(Eigen::internal::ploadu<Packet>(target + p * kLanes), sum[j][p]));
        }
      }
    }
  }
}

using Segment = Eigen::Map<Eigen::VectorXd>;
using ConstSegment = Eigen::Map<const Eigen::VectorXd>;

}  // namespace

PanelLdl::PanelLdl(int max_rows)
    : stride_(whole_panels(max_rows) + kPanel),
      storage_(Eigen::MatrixXd::Zero(stride_, stride_)),
      pivots_(Eigen::VectorXd::Zero(stride_)),
      diagonal_(Eigen::VectorXd::Zero(stride_)),
      packed_(Eigen::VectorXd::Zero(kPanel * stride_)) {}

void PanelLdl::resize(int leading, int trailing) {
  leading_ = leading;
  padded_leading_ = whole_panels(leading);
  padded_size_ = padded_leading_ + whole_panels(trailing);
  for (int j = 0; j < padded_size_; ++j) {
    double* c = column(j);
    for (int i = j / kPanel * kPanel; i < j; ++i) c[i] = 0;  // above the diagonal, within the panel
    for (int i = std::max(leading, j); i < padded_leading_; ++i) c[i] = 0;
    for (int i = std::max(padded_leading_ + trailing, j); i < padded_size_; ++i) c[i] = 0;
    if (j >= leading && j < padded_leading_) {
      for (int i = j; i < padded_size_; ++i) c[i] = 0;
      c[j] = 1;
    }
  }
}

int PanelLdl::factorise(double* softening) {
  for (int j = 0; j < padded_leading_; ++j) diagonal_[j] = column(j)[j];
  int softened = 0;
  for (int j = 0; j < padded_size_; j += kPanel) {  // left-looking
    const int depth = std::min(j, padded_leading_);
    for (int k = 0; k < depth; ++k) {
      for (int i = 0; i < kPanel; ++i) packed_[k * kPanel + i] = column(k)[j + i] * pivots_[k];
    }
    if (depth > 0)
      subtract_product(column(j) + j, column(0) + j, packed_.data(), padded_size_ - j, depth, stride_, stride_);
    if (j < padded_leading_ && !factorise_panel(j, softening, softened)) return -1;
  }
  return softened;
}

bool PanelLdl::factorise_panel(int j, double* softening, int& softened) {
  for (int p = j; p < j + kPanel; ++p) {
    double* c = column(p);
    double pivot = c[p];
    if (!std::isfinite(pivot) || !(diagonal_[p] > 0)) return false;
    double added = 0;
    if (!(pivot > kLostDigits * diagonal_[p])) {
      added = kSoftening * diagonal_[p] - pivot;
      pivot = kSoftening * diagonal_[p];
      ++softened;
    }
    if (p < leading_) softening[p] = added;
    pivots_[p] = pivot;
    const int rest = padded_size_ - p - 1;
    Segment below(c + p + 1, rest);
    below *= 1 / pivot;
    for (int q = p + 1; q < j + kPanel; ++q) {
      Segment(column(q) + q, padded_size_ - q) -= (pivot * c[q]) * ConstSegment(c + q, padded_size_ - q);
    }
  }
  return true;
}

void PanelLdl::forward(double* x) const {
  for (int j = 0; j < leading_; ++j) {
    const int rest = padded_size_ - j - 1;
    Segment(x + j + 1, rest) -= x[j] * ConstSegment(column(j) + j + 1, rest);
  }
}

void PanelLdl::backward(double* x) const {
  for (int j = leading_; j-- > 0;) {
    const int rest = padded_size_ - j - 1;
    x[j] -= ConstSegment(column(j) + j + 1, rest).dot(ConstSegment(x + j + 1, rest));
  }
}

void PanelLdl::solve(double* x) const {
  forward(x);
  for (int j = 0; j < leading_; ++j) x[j] /= pivots_[j];
  backward(x);
}

void PanelLdl::coupling(Eigen::MatrixXd& y) {
  const int rows = padded_size_ - padded_leading_;
  const int y_stride = static_cast<int>(y.outerStride());
  if (rows == 0) return;
  for (int j = padded_leading_ - kPanel; j >= 0; j -= kPanel) {
    for (int p = j; p < j + kPanel; ++p) y.col(p).head(rows) = ConstSegment(column(p) + padded_leading_, rows);
    const int later = j + kPanel;
    const int depth = padded_leading_ - later;
    for (int p = 0; p < kPanel; ++p) {
      for (int k = 0; k < depth; ++k) packed_[k * kPanel + p] = column(j + p)[later + k];
    }
    if (depth > 0)
      subtract_product(y.col(j).data(), y.col(later).data(), packed_.data(), rows, depth, y_stride, y_stride);
    for (int p = j + kPanel - 1; p-- > j;) {
      for (int q = p + 1; q < j + kPanel; ++q) y.col(p).head(rows) -= column(p)[q] * y.col(q).head(rows);
    }
  }
}

}  // namespace stylet::physics
