#include "physics/tissue/factorisation.h"

#include "physics/tissue/blas.h"
#include "physics/tissue/supernodes.h"
#include "physics/tissue/triangular_inverse.h"

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
// At this estimate an iteration still makes its error 20 times smaller a step with L in 16 bits, 7 times with 12.
constexpr double kConditionForFewBits = 1e-3;
// One part in so many, for an L whose trailing DOFs make it larger: 813 of 20,691 a tenth more than 210.
constexpr std::size_t kSpareRoom = 4;
constexpr std::size_t kWorthFewBits = std::size_t{1} << 20;  // entries of L; fewer stay in a core's cache
constexpr Eigen::Index kColumnsWorthSharing = 6;

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

/// `order` with `trailing` moved to its end and the rest postordered by itself: children right before their parents,
/// which is what makes supernodes. Empty if there is no memory.
std::vector<int> constrained_order(std::span<const int> order, std::span<const int> trailing,
                                   const StiffnessPattern& pattern, cholmod_common* common) {
  std::vector<char> is_trailing(order.size(), 0);
  for (const int dof : trailing) is_trailing[dof] = 1;
  std::vector<int> rest;
  rest.reserve(order.size());
  for (const int dof : order) {
    if (is_trailing[dof] == 0) rest.push_back(dof);
  }
  std::vector<int> constrained = rest;
  constrained.insert(constrained.end(), trailing.begin(), trailing.end());

  cholmod_sparse a = lower_triangle(pattern, nullptr);
  cholmod_sparse* upper = cholmod_ptranspose(&a, 0, constrained.data(), nullptr, 0, common);
  if (upper == nullptr) return {};
  std::vector<int> parent(order.size());
  const bool found = cholmod_etree(upper, parent.data(), common) != 0;
  cholmod_free_sparse(&upper, common);
  if (!found) return {};
  const auto leading = static_cast<int>(rest.size());
  for (int& p : parent) p = p < leading ? p : -1;
  std::vector<int> postorder(rest.size());
  if (cholmod_postorder(parent.data(), rest.size(), nullptr, postorder.data(), common) != leading) return {};
  for (std::size_t i = 0; i < rest.size(); ++i) constrained[i] = rest[postorder[i]];
  return constrained;
}

/// Where the numbers of an analysed factor go.
void lay(cholmod_factor& factor, void* numbers) {
  factor.x = numbers;
  factor.xtype = CHOLMOD_REAL;
  factor.dtype = CHOLMOD_DOUBLE;
  factor.minor = factor.n;
}

std::size_t with_spare_room(std::size_t entries) {
  return entries + entries / kSpareRoom;
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
  single_threaded_blas();
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
  const auto* order = static_cast<const int*>(factor_->Perm);
  fill_reducing_.assign(order, order + factor_->n);
}

Factorisation::Factorisation(const Factorisation& other)
    : cholesky_(other.cholesky_),
      own_from_(other.own_from_),
      compact_(other.compact_),
      symbols_kept_(other.symbols_kept_),
      coarsest_(other.coarsest_),
      twelve_from_(other.twelve_from_),
      fill_reducing_(other.fill_reducing_),
      trailing_(other.trailing_),
      trailing_block_(other.trailing_block_) {
  if (other.factor_ == nullptr) return;
  PlainCommon plain;
  factor_ = cholmod_copy_factor(other.factor_, &plain.common);
  if (factor_ == nullptr) throw std::runtime_error("tissue: no memory to copy a factor");
  if (factor_->xtype == CHOLMOD_PATTERN || factor_->xsize < own_from_) return;
  std::size_t room = factor_->xsize;
  factor_->x = cholmod_realloc(with_spare_room(room), sizeof(double), factor_->x, &room, &plain.common);
  // Pages cost their first touch, now and not while a session runs.
  std::fill(static_cast<double*>(factor_->x) + factor_->xsize, static_cast<double*>(factor_->x) + room, 0.0);
  room_ = room;
}

Factorisation::Factorisation(Factorisation&& other) noexcept
    : factor_(std::exchange(other.factor_, nullptr)),
      cholesky_(std::move(other.cholesky_)),
      own_from_(other.own_from_),
      compact_(std::move(other.compact_)),
      symbols_kept_(other.symbols_kept_),
      coarsest_(other.coarsest_),
      twelve_from_(other.twelve_from_),
      fill_reducing_(std::move(other.fill_reducing_)),
      trailing_(std::move(other.trailing_)),
      trailing_block_(std::move(other.trailing_block_)),
      room_(std::exchange(other.room_, 0)) {}

Factorisation::~Factorisation() {
  if (factor_ == nullptr) return;
  PlainCommon plain;
  cholmod_free_factor(&factor_, &plain.common);
}

bool Factorisation::order_last(std::span<const int> trailing, const StiffnessPattern& pattern,
                               SolveWorkspace& workspace) {
  std::vector<int> order = constrained_order(fill_reducing_, trailing, pattern, workspace.common());
  if (order.empty()) return false;
  cholmod_common& common = *workspace.common();
  common.method[0].ordering = CHOLMOD_GIVEN;
  common.postorder = 0;  // CHOLMOD's would mix the trailing DOFs with the rest
  cholmod_sparse a = lower_triangle(pattern, nullptr);
  cholmod_factor* analysed = cholmod_analyze_p(&a, order.data(), nullptr, 0, &common);
  common.method[0].ordering = CHOLMOD_METIS;
  common.postorder = 1;
  if (analysed == nullptr) return false;
  if (room_ >= analysed->xsize && analysed->xsize >= own_from_ && factor_->x != nullptr) {
    // Fresh memory costs its pages, a sixth of a factorisation: the new L lies where the old one did.
    lay(*analysed, std::exchange(factor_->x, nullptr));
  } else {
    room_ = 0;
  }
  cholmod_free_factor(&factor_, &common);
  factor_ = analysed;
  cholesky_.clear();
  compact_.clear();
  symbols_kept_ = false;
  trailing_.assign(trailing.begin(), trailing.end());
  return true;
}

bool Factorisation::factorise(const StiffnessPattern& pattern, std::span<const double> values,
                              SolveWorkspace& workspace) {
  if (!Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size())).allFinite()) {
    return false;
  }
  if (!make_numbers(pattern, values, workspace)) return false;
  copy_trailing_block();
  const PassPrecision precision = fitting_precision(workspace);
  if (precision == PassPrecision::full) {
    compact_.clear();
    symbols_kept_ = false;
  } else {
    compact_.read(*factor_, leading(), precision, symbols_kept_, workspace.companion);
    symbols_kept_ = true;
  }
  return true;
}

bool Factorisation::make_numbers(const StiffnessPattern& pattern, std::span<const double> values,
                                 SolveWorkspace& workspace) {
  cholmod_common& common = *workspace.common();
  if (factor_nonzeros() >= own_from_) {
    if (factor_->xtype == CHOLMOD_PATTERN) {
      const std::size_t room = with_spare_room(factor_->xsize);
      void* const numbers = cholmod_malloc(room, sizeof(double), &common);
      if (numbers == nullptr) return false;
      lay(*factor_, numbers);
      room_ = room;
    }
    if (cholesky_.empty()) cholesky_.analyse(*factor_, pattern);
    return cholesky_.factorise(*factor_, values, workspace.cholesky_, workspace.companion);
  }
  disable_openmp_teams();
  cholmod_sparse a = lower_triangle(pattern, values.data());
  return cholmod_factorize(&a, factor_, &common) != 0 && common.status == CHOLMOD_OK && factor_->minor == factor_->n;
}

PassPrecision Factorisation::fitting_precision(SolveWorkspace& workspace) const {
  const double condition = reciprocal_condition(workspace);
  if (!(condition >= kConditionForSingle)) return PassPrecision::full;
  PassPrecision fitting = PassPrecision::single;
  if (condition >= kConditionForFewBits && factor_->xsize >= std::min(kWorthFewBits, twelve_from_)) {
    fitting = factor_->xsize >= twelve_from_ ? PassPrecision::twelve_bits : PassPrecision::sixteen_bits;
  }
  return std::max(fitting, coarsest_);
}

void Factorisation::copy_trailing_block() {
  const int start = leading();
  const auto size = static_cast<Eigen::Index>(trailing_.size());
  trailing_block_.setZero(size, size);
  const auto* l = static_cast<const double*>(factor_->x);
  for (std::size_t s = factor_->nsuper; s-- > 0;) {
    const Supernode<double> node(*factor_, l, s, dof_count());
    if (node.first + node.columns <= start) break;
    // A supernode may hold the last of the leading columns and the first of the trailing ones.
    for (int c = std::max(0, start - node.first); c < node.columns; ++c) {
      const auto column = node.panel(c, 1);
      for (int i = c; i < node.rows; ++i) {
        trailing_block_(node.row[i] - start, node.first + c - start) = column(i - c, 0);
      }
    }
  }
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

void Factorisation::solve_nearly(const Eigen::Ref<const Eigen::VectorXd>& b, Eigen::Ref<Eigen::VectorXd> x,
                                 SolveWorkspace& workspace) const {
  workspace.eliminated_.resize(b.size());
  eliminate(b, workspace.eliminated_, workspace);
  substitute_back(workspace.eliminated_, x, workspace);
}

void Factorisation::eliminate(const Eigen::Ref<const Eigen::VectorXd>& b, Eigen::Ref<Eigen::VectorXd> y,
                              SolveWorkspace& workspace) const {
  if (compact_.empty()) {
    eliminate_in(workspace.permuted_, b, y, workspace);
  } else {
    eliminate_in(workspace.compact_.x, b, y, workspace);
  }
}

void Factorisation::substitute_back(const Eigen::Ref<const Eigen::VectorXd>& y, Eigen::Ref<Eigen::VectorXd> x,
                                    SolveWorkspace& workspace) const {
  substitute_back(y, substitute_back_trailing(y), x, workspace);
}

void Factorisation::substitute_back(const Eigen::Ref<const Eigen::VectorXd>& y, const Eigen::VectorXd& x_s,
                                    Eigen::Ref<Eigen::VectorXd> x, SolveWorkspace& workspace) const {
  if (compact_.empty()) {
    substitute_back_in(workspace.permuted_, y, x_s, x, workspace);
  } else {
    substitute_back_in(workspace.compact_.x, y, x_s, x, workspace);
  }
}

void Factorisation::eliminate_leading(std::vector<float>&, SolveWorkspace& workspace) const {
  compact_.eliminate(workspace.compact_, workspace.companion);
}

void Factorisation::substitute_back_leading(std::vector<float>&, SolveWorkspace& workspace) const {
  compact_.substitute_back(workspace.compact_, workspace.companion);
}

void Factorisation::eliminate_leading(std::vector<double>& x, SolveWorkspace& workspace) const {
  workspace.gathered_.resize(factor_->maxesize + factor_->n);
  const auto* l = static_cast<const double*>(factor_->x);
  for (std::size_t s = 0; s < factor_->nsuper; ++s) {
    const Supernode<double> node(*factor_, l, s, leading());
    if (node.columns <= 0) break;
    physics::eliminate(node, x.data(), workspace.gathered_.data());
  }
}

void Factorisation::substitute_back_leading(std::vector<double>& x, SolveWorkspace& workspace) const {
  workspace.gathered_.resize(factor_->maxesize + factor_->n);
  const auto* l = static_cast<const double*>(factor_->x);
  for (std::size_t s = factor_->nsuper; s-- > 0;) {
    const Supernode<double> node(*factor_, l, s, leading());
    if (node.columns > 0) physics::substitute_back(node, x.data(), workspace.gathered_.data());
  }
}

template <typename Scalar>
void Factorisation::eliminate_in(std::vector<Scalar>& x, const Eigen::Ref<const Eigen::VectorXd>& b,
                                 Eigen::Ref<Eigen::VectorXd> y, SolveWorkspace& workspace) const {
  // Scaled to its largest entry: neither tiny residuals nor huge ones leave the range of a float.
  const double scale = b.cwiseAbs().maxCoeff<Eigen::PropagateNaN>();
  if (scale == 0 || !std::isfinite(scale)) {
    y.setConstant(scale == 0 ? 0 : std::nan(""));  // a bad number stays visible
    return;
  }
  const auto* order = static_cast<const int*>(factor_->Perm);
  const int n = dof_count();
  const int start = leading();
  Eigen::Index trailing = 0;
  for (int i = start; i < n; ++i) trailing += b[order[i]] != 0 ? 1 : 0;
  if ((b.array() != 0).count() == trailing) {
    y.setZero();
  } else {
    if (x.size() < factor_->n) x.resize(factor_->n);
    for (int i = 0; i < start; ++i) x[i] = static_cast<Scalar>(b[order[i]] / scale);
    std::fill(x.begin() + start, x.begin() + n, Scalar(0));  // for what the leading part does to S
    eliminate_leading(x, workspace);
    for (int i = 0; i < n; ++i) y[i] = scale * static_cast<double>(x[i]);
  }
  if (start == n) return;
  for (int i = start; i < n; ++i) y[i] += b[order[i]];
  auto y_s = y.tail(n - start);
  trailing_block_.triangularView<Eigen::Lower>().solveInPlace(y_s);
}

template <typename Scalar>
void Factorisation::substitute_back_in(std::vector<Scalar>& z, const Eigen::Ref<const Eigen::VectorXd>& y,
                                       const Eigen::VectorXd& x_s, Eigen::Ref<Eigen::VectorXd> x,
                                       SolveWorkspace& workspace) const {
  const int n = dof_count();
  const int start = leading();
  const auto largest = [](const auto& v) {
    return v.size() == 0 ? 0 : v.cwiseAbs().template maxCoeff<Eigen::PropagateNaN>();
  };
  const double scale = largest(y.head(start)) + largest(x_s);
  if (scale == 0 || !std::isfinite(scale)) {
    x.setConstant(scale == 0 ? 0 : std::nan(""));
    return;
  }
  const auto* order = static_cast<const int*>(factor_->Perm);
  if (z.size() < factor_->n) z.resize(factor_->n);
  for (int i = 0; i < start; ++i) z[i] = static_cast<Scalar>(y[i] / scale);
  for (int i = start; i < n; ++i) z[i] = static_cast<Scalar>(x_s[i - start] / scale);
  substitute_back_leading(z, workspace);
  for (int i = 0; i < start; ++i) x[order[i]] = scale * static_cast<double>(z[i]);
  for (int i = start; i < n; ++i) x[order[i]] = x_s[i - start];
}

Eigen::MatrixXd Factorisation::substitute_back_trailing(const Eigen::Ref<const Eigen::MatrixXd>& y) const {
  Eigen::MatrixXd x = y.bottomRows(trailing_block_.rows());
  const auto l_transposed = trailing_block_.triangularView<Eigen::Lower>().transpose();
  if (x.cols() == 1) {  // without packing the block for a product
    auto column = x.col(0);
    l_transposed.solveInPlace(column);
  } else {
    l_transposed.solveInPlace(x);
  }
  return x;
}

std::vector<Rows> Factorisation::eliminate_units(std::span<const int> dofs, Eigen::Ref<Eigen::MatrixXd> y,
                                                 SolveWorkspace& workspace) const {
  const auto* order = static_cast<const int*>(factor_->Perm);
  const auto* super = static_cast<const int*>(factor_->super);
  const auto supernode_of = [&](int row) {
    return static_cast<std::size_t>(std::upper_bound(super, super + factor_->nsuper, row) - super - 1);
  };
  std::vector<int>& places = workspace.places_;
  places.resize(factor_->n);
  for (int i = 0; i < dof_count(); ++i) places[order[i]] = i;
  std::vector<char> reached(factor_->nsuper, 0);
  for (std::size_t c = 0; c < dofs.size(); ++c) {
    const int row = places[dofs[c]];
    y(row, static_cast<Eigen::Index>(c)) = 1;
    reached[supernode_of(row)] = 1;
  }
  const auto* l = static_cast<const double*>(factor_->x);
  std::vector<Rows> rows;
  for (std::size_t s = 0; s < factor_->nsuper; ++s) {
    if (reached[s] == 0) continue;
    const Supernode<double> node(*factor_, l, s, dof_count());
    if (node.rows > node.columns) reached[supernode_of(node.row[node.columns])] = 1;  // and so on to the root
    if (!rows.empty() && rows.back().end() == node.first) {
      rows.back().count += node.columns;
    } else {
      rows.push_back({.first = node.first, .count = node.columns});
    }
  }
  // Half of the columns each: a panel that one thread reads is in the shared cache for the other.
  const Eigen::Index halves = y.cols() < kColumnsWorthSharing || factor_nonzeros() < kWorthTwoThreads ? 1 : 2;
  in_parts(workspace.companion, static_cast<int>(halves), [&](int half) {
    const Eigen::Index begin = y.cols() * half / halves;
    auto columns = y.middleCols(begin, y.cols() * (half + 1) / halves - begin);
    for (std::size_t s = 0; s < factor_->nsuper; ++s) {
      if (reached[s] == 0) continue;
      eliminate_columns(Supernode<double>(*factor_, l, s, dof_count()), columns,
                        workspace.below_[static_cast<std::size_t>(half)]);
    }
  });
  return rows;
}

void Factorisation::trailing_compliance(Eigen::Ref<Eigen::MatrixXd> compliance) const {
  compliance = trailing_block_;
  invert_lower_triangle(compliance);
  multiply_by_own_transpose(compliance);
}

int Factorisation::dof_count() const {
  return factor_ == nullptr ? 0 : static_cast<int>(factor_->n);
}

std::size_t Factorisation::factor_nonzeros() const {
  return factor_ == nullptr || factor_->is_super == 0 ? 0 : factor_->xsize;
}

}  // namespace stylet::physics
