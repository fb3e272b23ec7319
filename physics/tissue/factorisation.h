// Sparse Cholesky factorisation of a body's system matrix A_v (CHOLMOD, supernodal, METIS).
#pragma once

#include "physics/tissue/stiffness.h"

#include <Eigen/Core>

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

  Eigen::MatrixXd columns;  ///< right-hand sides and solutions of whoever is solving; grows

private:
  friend class Factorisation;
  cholmod_common_struct* common() const { return common_.get(); }
  std::unique_ptr<cholmod_common_struct> common_;
  cholmod_dense_struct* x_ = nullptr;  // CHOLMOD reuses these where they are large enough
  cholmod_dense_struct* y_ = nullptr;
  cholmod_dense_struct* e_ = nullptr;
  std::vector<float> permuted_;  // single-precision solves
  std::vector<float> gathered_;
};

/// P A P^T = L L^T. Copying copies L (that is how the slots of a LatestValue are filled at load).
/// Reading (solve) is const and safe from several threads, each with its own workspace.
class Factorisation {
public:
  Factorisation() = default;
  /// Symbolic analysis of the pattern: fill-reducing order and supernodes, once for the life of the mesh.
  /// @throws std::runtime_error if CHOLMOD refuses (out of memory)
  Factorisation(const StiffnessPattern& pattern, SolveWorkspace& workspace);
  Factorisation(const Factorisation& other);
  Factorisation(Factorisation&& other) noexcept;
  Factorisation& operator=(const Factorisation&) = delete;
  ~Factorisation();

  /// Numeric factorisation, into the storage of the last one.
  /// @param values  lower triangle in the pattern's order [pattern.nonzeros()]
  /// @return false if A is not positive definite or not finite: the factor must then not be used
  bool factorise(const StiffnessPattern& pattern, std::span<const double> values, SolveWorkspace& workspace);

  /// x = A^-1 b for all columns. x may be b's own storage.
  /// @param b  [DOFs x columns]
  void solve(const Eigen::Ref<const Eigen::MatrixXd>& b, Eigen::Ref<Eigen::MatrixXd> x,
             SolveWorkspace& workspace) const;

  /// x = A^-1 b to single precision (1e-7 times the condition): half the bytes of solve(), and bytes are what one
  /// right-hand side costs. For residuals of an iteration, whose fixed point it does not move. An ill-conditioned A
  /// is solved in double.
  /// @param b  [DOFs]; x may be b's own storage
  void solve_single(const Eigen::Ref<const Eigen::VectorXd>& b, Eigen::Ref<Eigen::VectorXd> x,
                    SolveWorkspace& workspace) const;

  /// A cheap estimate from the diagonal of L: 1 is best, below 1e-13 the body is hardly held.
  double reciprocal_condition(SolveWorkspace& workspace) const;
  int dof_count() const;
  /// Non-zeros of L, with the explicit zeros of its supernodes.
  std::size_t factor_nonzeros() const;

private:
  cholmod_factor_struct* factor_ = nullptr;
  std::vector<float> single_;  // L's supernodes as CHOLMOD lays them out; empty where A is too ill-conditioned
};

}  // namespace stylet::physics
