#include "physics/tissue/factorisation.h"

#include "physics/tissue/blas.h"

#include <cholmod.h>

#include <cmath>
#include <stdexcept>

namespace stylet::physics {
namespace {

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

Factorisation::Factorisation(const Factorisation& other) {
  if (other.factor_ == nullptr) return;
  PlainCommon plain;
  factor_ = cholmod_copy_factor(other.factor_, &plain.common);
  if (factor_ == nullptr) throw std::runtime_error("tissue: no memory to copy a factor");
}

Factorisation::Factorisation(Factorisation&& other) noexcept : factor_(other.factor_) {
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
  return cholmod_factorize(&a, factor_, workspace.common()) != 0 && workspace.common()->status == CHOLMOD_OK &&
         factor_->minor == factor_->n;
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

int Factorisation::dof_count() const {
  return factor_ == nullptr ? 0 : static_cast<int>(factor_->n);
}

std::size_t Factorisation::factor_nonzeros() const {
  return factor_ == nullptr || factor_->is_super == 0 ? 0 : factor_->xsize;
}

}  // namespace stylet::physics
