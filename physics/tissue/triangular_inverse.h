// Inverse of a dense matrix from its Cholesky factor, by blocks: as fast as matrix products.
#pragma once

#include <Eigen/Core>

namespace stylet::physics {

/// L <- L^-1.
/// @param[in,out] l  lower triangle; what is above the diagonal is zero before and after
void invert_lower_triangle(Eigen::Ref<Eigen::MatrixXd> l);

/// X <- X^T X, exactly symmetric.
/// @param[in,out] x  lower triangle, zero above the diagonal; then the whole product
void multiply_by_own_transpose(Eigen::Ref<Eigen::MatrixXd> x);

}  // namespace stylet::physics
