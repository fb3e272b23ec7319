// Sparse Cholesky factorisation of a body's system matrix A_v (CHOLMOD, supernodal, METIS), with the DOFs whose
// compliance will be asked for eliminated last.
#pragma once

#include "physics/tissue/compact_factor.h"
#include "physics/tissue/stiffness.h"
#include "physics/tissue/supernodal_cholesky.h"

#include <Eigen/Core>

#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <vector>

struct cholmod_common_struct;
struct cholmod_dense_struct;
struct cholmod_factor_struct;

namespace stylet::physics {

/// Scratch of solves and factorisations: CHOLMOD's common block and dense arrays. One a thread.
class SolveWorkspace {
public:
  SolveWorkspace();
  ~SolveWorkspace();
  SolveWorkspace(const SolveWorkspace&) = delete;
  SolveWorkspace& operator=(const SolveWorkspace&) = delete;

  Eigen::MatrixXd columns;    ///< right-hand sides and solutions of whoever is solving; grows
  std::vector<double> zeros;  ///< zero again when whoever used it is done; grows
  /// Shares the passes of one right-hand side, and large factorisations; the bits do not know of it.
  Companion* companion = nullptr;

private:
  friend class Factorisation;
  cholmod_common_struct* common() const { return common_.get(); }
  std::unique_ptr<cholmod_common_struct> common_;
  cholmod_dense_struct* x_ = nullptr;  // CHOLMOD reuses these where they are large enough
  cholmod_dense_struct* y_ = nullptr;
  cholmod_dense_struct* e_ = nullptr;
  CompactFactor::Scratch compact_;
  SupernodalCholesky::Scratch cholesky_;
  // In double: a vector in the order of elimination, and the rows of one supernode.
  std::vector<double> permuted_;
  std::vector<double> gathered_;
  Eigen::VectorXd eliminated_;
  std::vector<int> places_;  // of DOFs in the order of elimination
  std::array<std::vector<double>, 2> below_;
};

/// Rows that follow each other.
struct Rows {
  Eigen::Index first = 0, count = 0;
  Eigen::Index end() const { return first + count; }
};

/// P A P^T = L L^T. Copying copies L (that is how the slots of a LatestValue are filled at load).
/// Reading (solve) is const and safe from several threads, each with its own workspace.
///
/// The trailing DOFs S are eliminated last. With L_SS their block of L, the compliance of S is (L_SS L_SS^T)^-1 and
/// needs no solve; a force on S leaves all of L but L_SS alone in the first half of a solve   (physics/README.md eq.
/// 8)
class Factorisation {
public:
  Factorisation() = default;
  /// Symbolic analysis of the pattern: fill-reducing order and supernodes, without trailing DOFs.
  /// @throws std::runtime_error if CHOLMOD refuses (out of memory)
  Factorisation(const StiffnessPattern& pattern, SolveWorkspace& workspace);
  Factorisation(const Factorisation& other);
  Factorisation(Factorisation&& other) noexcept;
  Factorisation& operator=(const Factorisation&) = delete;
  ~Factorisation();

  /// Analyses again with other trailing DOFs; factorise() must follow. The rest keeps the fill-reducing order.
  /// @param trailing  distinct DOFs; they are eliminated in this order
  /// @return false if CHOLMOD refuses (out of memory): the factor stays as it was
  bool order_last(std::span<const int> trailing, const StiffnessPattern& pattern, SolveWorkspace& workspace);
  /// The trailing DOFs S, in their order.
  std::span<const int> trailing() const { return trailing_; }

  /// Numeric factorisation, into the storage of the last one.
  /// @param values  lower triangle in the pattern's order [pattern.nonzeros()]
  /// @return false if A is not positive definite or not finite: the factor must then not be used
  bool factorise(const StiffnessPattern& pattern, std::span<const double> values, SolveWorkspace& workspace);

  /// x = A^-1 b for all columns. x may be b's own storage.
  /// @param b  [DOFs x columns]
  void solve(const Eigen::Ref<const Eigen::MatrixXd>& b, Eigen::Ref<Eigen::MatrixXd> x,
             SolveWorkspace& workspace) const;

  static constexpr std::size_t kWorthTwelveBits = std::size_t{1} << 23;
  /// The coarsest that the passes may read L in, from the next factorise() on. Coarser is cheaper: bytes are what one
  /// right-hand side costs.
  /// @param twelve_from  entries of L from which 12 bits are worth it: fewer stay in the cache that the cores share,
  ///                     and are read in 16 as fast
  void limit_precision(PassPrecision coarsest, std::size_t twelve_from = kWorthTwelveBits) {
    coarsest_ = coarsest;
    twelve_from_ = twelve_from;
  }
  /// What they read it in: finer where A is ill-conditioned or L small.
  PassPrecision pass_precision() const { return compact_.empty() ? PassPrecision::full : compact_.precision(); }
  const CompactFactor& compact() const { return compact_; }

  /// x = M b, M = A^-1 nearly: L is read in pass_precision(). For residuals of an iteration, whose fixed point it
  /// does not move. M is symmetric and positive definite, and exact on forces and motions of S.
  /// @param b  [DOFs]; x may be b's own storage
  void solve_nearly(const Eigen::Ref<const Eigen::VectorXd>& b, Eigen::Ref<Eigen::VectorXd> x,
                    SolveWorkspace& workspace) const;

  // The halves of solve_nearly(), so that a force known later can be added in between. L_SS is applied in double.

  /// y = L^-1 P b. Costs what b reaches in the elimination tree: next to nothing for forces on S.
  /// @param b  [DOFs]
  /// @param y  [DOFs] in the order of elimination, S at its end
  void eliminate(const Eigen::Ref<const Eigen::VectorXd>& b, Eigen::Ref<Eigen::VectorXd> y,
                 SolveWorkspace& workspace) const;
  /// x = P^T L^-T y. x may be y's own storage.
  void substitute_back(const Eigen::Ref<const Eigen::VectorXd>& y, Eigen::Ref<Eigen::VectorXd> x,
                       SolveWorkspace& workspace) const;
  /// The same where x_S [S] is known.
  void substitute_back(const Eigen::Ref<const Eigen::VectorXd>& y, const Eigen::VectorXd& x_s,
                       Eigen::Ref<Eigen::VectorXd> x, SolveWorkspace& workspace) const;
  /// The same on S alone, x_S = L_SS^-T y_S, for any number of columns.
  /// @param y  [DOFs x columns], as above
  Eigen::MatrixXd substitute_back_trailing(const Eigen::Ref<const Eigen::MatrixXd>& y) const;
  /// y = L^-1 P e_d in double for several DOFs d at once, a column each. Costs what they reach in the elimination
  /// tree.
  /// @param y  [DOFs x dofs], zero before
  /// @return the rows of y that may be other than zero, ascending
  std::vector<Rows> eliminate_units(std::span<const int> dofs, Eigen::Ref<Eigen::MatrixXd> y,
                                    SolveWorkspace& workspace) const;

  /// (L_SS L_SS^T)^-1, the block of A^-1 of the trailing DOFs in their order, exactly symmetric.
  /// @param[out] compliance  [S x S], m/N
  void trailing_compliance(Eigen::Ref<Eigen::MatrixXd> compliance) const;

  /// A cheap estimate from the diagonal of L: 1 is best, below 1e-13 the body is hardly held.
  double reciprocal_condition(SolveWorkspace& workspace) const;
  int dof_count() const;
  /// Non-zeros of L, with the explicit zeros of its supernodes.
  std::size_t factor_nonzeros() const;
  /// Multiplications and additions of a factorisation; 0 where CHOLMOD made it.
  double flops() const { return cholesky_.flops(); }
  /// An L of at least so many entries gets its numbers from SupernodalCholesky, a smaller one from CHOLMOD.
  void make_own_from(std::size_t entries) { own_from_ = entries; }

private:
  static constexpr std::size_t kWorthTwoThreads = std::size_t{8} << 20;
  int leading() const { return dof_count() - static_cast<int>(trailing_.size()); }
  void copy_trailing_block();
  bool make_numbers(const StiffnessPattern& pattern, std::span<const double> values, SolveWorkspace& workspace);
  PassPrecision fitting_precision(SolveWorkspace& workspace) const;
  /// x <- L^-1 x of the leading columns in the order of elimination, x_S -= L_S x; its transpose.
  void eliminate_leading(std::vector<float>& x, SolveWorkspace& workspace) const;
  void eliminate_leading(std::vector<double>& x, SolveWorkspace& workspace) const;
  void substitute_back_leading(std::vector<float>& x, SolveWorkspace& workspace) const;
  void substitute_back_leading(std::vector<double>& x, SolveWorkspace& workspace) const;
  template <typename Scalar>
  void eliminate_in(std::vector<Scalar>& x, const Eigen::Ref<const Eigen::VectorXd>& b, Eigen::Ref<Eigen::VectorXd> y,
                    SolveWorkspace& workspace) const;
  template <typename Scalar>
  void substitute_back_in(std::vector<Scalar>& z, const Eigen::Ref<const Eigen::VectorXd>& y,
                          const Eigen::VectorXd& x_s, Eigen::Ref<Eigen::VectorXd> x, SolveWorkspace& workspace) const;

  cholmod_factor_struct* factor_ = nullptr;
  SupernodalCholesky cholesky_;  // of a large factor; else empty
  std::size_t own_from_ = kWorthTwoThreads;
  CompactFactor compact_;      // of the leading columns; empty where A is too ill-conditioned
  bool symbols_kept_ = false;  // compact_ knows the supernodes
  PassPrecision coarsest_ = PassPrecision::twelve_bits;
  std::size_t twelve_from_ = kWorthTwelveBits;
  std::vector<int> fill_reducing_;  // [DOFs] the order without trailing DOFs
  std::vector<int> trailing_;
  Eigen::MatrixXd trailing_block_;  // L_SS, zero above the diagonal
  std::size_t room_ = 0;            // entries of L that fit where it lies; 0: CHOLMOD laid it
};

}  // namespace stylet::physics
