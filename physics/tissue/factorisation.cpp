#include "physics/tissue/factorisation.h"

#include "physics/tissue/blas.h"

#include <cholmod.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

namespace stylet::physics {
namespace {

// The estimate is an upper bound of 1/condition, often by 10-100. Above it the error of a single-precision solve is a
// few per cent at most, in the softest modes: what an iteration forgives.
constexpr double kConditionForSingle = 1e-4;
constexpr int kPanel = 8;  // columns handled at once: as many streams as the prefetchers follow

using SinglePanel = Eigen::Map<const Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic>, 0, Eigen::OuterStride<>>;
using SingleVector = Eigen::Map<Eigen::VectorXf>;

/// A supernode of L: a dense trapezoid, columns contiguous in the permuted order.
struct Supernode {
  Supernode(const cholmod_factor& factor, const std::vector<float>& values, std::size_t s) {
    const auto* super = static_cast<const int*>(factor.super);
    const auto* row_start = static_cast<const int*>(factor.pi);
    const auto* value_start = static_cast<const int*>(factor.px);
    first = super[s];
    columns = super[s + 1] - first;
    rows = row_start[s + 1] - row_start[s];
    row = static_cast<const int*>(factor.s) + row_start[s];
    value = values.data() + value_start[s];
  }
  /// Columns from `column` on, from the diagonal down: the zeros above it are never read.
  SinglePanel panel(int column, int width) const {
    return SinglePanel(value + static_cast<std::ptrdiff_t>(column) * rows + column, rows - column, width,
                       Eigen::OuterStride<>(rows));
  }
  int first = 0;
  int columns = 0;
  int rows = 0;  // the first `columns` of them are the diagonal block's
  const int* row = nullptr;
  const float* value = nullptr;
};

/// y = L^-1 y for one supernode's columns, and what they do to the rows below.
void eliminate(const Supernode& node, float* y, float* scratch) {
  SingleVector w(scratch, node.rows);
  w.head(node.columns) = SingleVector(y + node.first, node.columns);
  w.tail(node.rows - node.columns).setZero();
  for (int c = 0; c < node.columns; c += kPanel) {
    const int width = std::min(kPanel, node.columns - c);
    const SinglePanel l = node.panel(c, width);
    l.topRows(width).triangularView<Eigen::Lower>().solveInPlace(w.segment(c, width));
    const int below = node.rows - c - width;
    w.tail(below).noalias() -= l.bottomRows(below) * w.segment(c, width);
  }
  SingleVector(y + node.first, node.columns) = w.head(node.columns);
  for (int i = node.columns; i < node.rows; ++i) y[node.row[i]] += w[i];
}

/// y = L^-T y for one supernode's columns, from the rows below.
void substitute_back(const Supernode& node, float* y, float* scratch) {
  SingleVector w(scratch, node.rows);
  for (int i = 0; i < node.rows; ++i) w[i] = y[node.row[i]];
  for (int c = (node.columns - 1) / kPanel * kPanel; c >= 0; c -= kPanel) {
    const int width = std::min(kPanel, node.columns - c);
    const SinglePanel l = node.panel(c, width);
    const int below = node.rows - c - width;
    w.segment(c, width).noalias() -= l.bottomRows(below).transpose() * w.tail(below);
    l.topRows(width).triangularView<Eigen::Lower>().transpose().solveInPlace(w.segment(c, width));
  }
  SingleVector(y + node.first, node.columns) = w.head(node.columns);
}

/// CHOLMOD's view of the pattern and its values: symmetric, lower triangle stored.
cholmod_sparse lower_triangle(const StiffnessPattern& pattern, const double* values) {
  cholmod_sparse a{};
  a.nrow = a.ncol = static_cast<std::size_t>(pattern.dof_count());
  a.nzmax = pattern.nonzeros();
  // CHOLMOD's interface is not const, but it only reads its input.
  a.p = const_cast<int*>(pattern.column_start().data());
  a.i = const_cast<int*>(pattern.rows().data());
  a.x = const_cast<double*>(values);
  a.stype = -1;
  a.itype = CHOLMOD_INT;
  a.xtype = values == nullptr ? CHOLMOD_PATTERN : CHOLMOD_REAL;
  a.dtype = CHOLMOD_DOUBLE;
  a.sorted = 1;
  a.packed = 1;
  return a;
}

/// A common block for copying and freeing factors: those need no settings.
struct PlainCommon {
  PlainCommon() { cholmod_start(&common); }
  ~PlainCommon() { cholmod_finish(&common); }
  PlainCommon(const PlainCommon&) = delete;
  PlainCommon& operator=(const PlainCommon&) = delete;
  cholmod_common common{};
};

}  // namespace

SolveWorkspace::SolveWorkspace() : common_(std::make_unique<cholmod_common>()) {
  cholmod_start(common_.get());
  common_->print = 0;
  common_->supernodal = CHOLMOD_SUPERNODAL;
  common_->final_ll = 1;
  common_->nmethods = 1;
  common_->method[0].ordering = CHOLMOD_METIS;
  common_->postorder = 1;
}

SolveWorkspace::~SolveWorkspace() {
  cholmod_free_dense(&x_, common_.get());
  cholmod_free_dense(&y_, common_.get());
  cholmod_free_dense(&e_, common_.get());
  cholmod_finish(common_.get());
}

Factorisation::Factorisation(const StiffnessPattern& pattern, SolveWorkspace& workspace) {
  cholmod_sparse a = lower_triangle(pattern, nullptr);
  factor_ = cholmod_analyze(&a, workspace.common());
  if (factor_ == nullptr) throw std::runtime_error("tissue: symbolic factorisation failed; is there enough memory?");
}

Factorisation::Factorisation(const Factorisation& other) : single_(other.single_) {
  if (other.factor_ == nullptr) return;
  PlainCommon plain;
  factor_ = cholmod_copy_factor(other.factor_, &plain.common);
  if (factor_ == nullptr) throw std::runtime_error("tissue: no memory to copy a factor");
}

Factorisation::Factorisation(Factorisation&& other) noexcept
    : factor_(other.factor_), single_(std::move(other.single_)) {
  other.factor_ = nullptr;
}

Factorisation::~Factorisation() {
  if (factor_ == nullptr) return;
  PlainCommon plain;
  cholmod_free_factor(&factor_, &plain.common);
}

bool Factorisation::factorise(const StiffnessPattern& pattern, std::span<const double> values,
                              SolveWorkspace& workspace) {
  if (!Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size())).allFinite()) {
    return false;
  }
  disable_openmp_teams();
  cholmod_sparse a = lower_triangle(pattern, values.data());
  if (cholmod_factorize(&a, factor_, workspace.common()) == 0 || workspace.common()->status != CHOLMOD_OK ||
      factor_->minor != factor_->n) {
    return false;
  }
  single_.clear();
  if (reciprocal_condition(workspace) >= kConditionForSingle) {
    const auto* l = static_cast<const double*>(factor_->x);
    single_.resize(factor_->xsize);
    std::transform(l, l + factor_->xsize, single_.begin(), [](double value) { return static_cast<float>(value); });
  }
  return true;
}

double Factorisation::reciprocal_condition(SolveWorkspace& workspace) const {
  return cholmod_rcond(factor_, workspace.common());
}

void Factorisation::solve(const Eigen::Ref<const Eigen::MatrixXd>& b, Eigen::Ref<Eigen::MatrixXd> x,
                          SolveWorkspace& workspace) const {
  cholmod_dense rhs{};
  rhs.nrow = static_cast<std::size_t>(b.rows());
  rhs.ncol = static_cast<std::size_t>(b.cols());
  rhs.d = static_cast<std::size_t>(b.outerStride());
  rhs.nzmax = rhs.d * rhs.ncol;
  rhs.x = const_cast<double*>(b.data());  // only read
  rhs.xtype = CHOLMOD_REAL;
  rhs.dtype = CHOLMOD_DOUBLE;
  if (cholmod_solve2(CHOLMOD_A, factor_, &rhs, nullptr, &workspace.x_, nullptr, &workspace.y_, &workspace.e_,
                     workspace.common()) == 0) {
    x.setConstant(std::nan(""));  // out of memory: the caller refuses what is not finite
    return;
  }
  x = Eigen::Map<const Eigen::MatrixXd>(static_cast<const double*>(workspace.x_->x), b.rows(), b.cols());
}

void Factorisation::solve_single(const Eigen::Ref<const Eigen::VectorXd>& b, Eigen::Ref<Eigen::VectorXd> x,
                                 SolveWorkspace& workspace) const {
  // Scaled to its largest entry: neither tiny residuals nor huge ones leave the range of a float.
  const double scale = b.cwiseAbs().maxCoeff();
  if (scale == 0) {
    x.setZero();
    return;
  }
  if (single_.empty() || !std::isfinite(scale)) {
    solve(b, x, workspace);
    return;
  }
  const auto* order = static_cast<const int*>(factor_->Perm);
  const auto n = static_cast<Eigen::Index>(factor_->n);
  workspace.permuted_.resize(factor_->n);
  workspace.gathered_.resize(factor_->maxesize + factor_->n);
  float* const y = workspace.permuted_.data();
  for (Eigen::Index i = 0; i < n; ++i) y[i] = static_cast<float>(b[order[i]] / scale);
  for (std::size_t s = 0; s < factor_->nsuper; ++s) {
    eliminate(Supernode(*factor_, single_, s), y, workspace.gathered_.data());
  }
  for (std::size_t s = factor_->nsuper; s-- > 0;) {
    substitute_back(Supernode(*factor_, single_, s), y, workspace.gathered_.data());
  }
  for (Eigen::Index i = 0; i < n; ++i) x[order[i]] = scale * static_cast<double>(y[i]);
}

int Factorisation::dof_count() const {
  return factor_ == nullptr ? 0 : static_cast<int>(factor_->n);
}

std::size_t Factorisation::factor_nonzeros() const {
  return factor_ == nullptr || factor_->is_super == 0 ? 0 : factor_->xsize;
}

}  // namespace stylet::physics
