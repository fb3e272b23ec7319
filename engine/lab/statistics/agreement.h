// How far repeated measurements agree (Shrout and Fleiss, Psychol Bull 86 (1979) 420).
#pragma once

#include <Eigen/Core>

namespace stylet::lab::statistics {

/// Intraclass correlations, of one measurement and of the mean of k.
struct Icc {
  double one_way = 0;           ///< ICC(1,1)
  double agreement = 0;         ///< ICC(2,1)
  double consistency = 0;       ///< ICC(3,1)
  double one_way_mean = 0;      ///< ICC(1,k)
  double agreement_mean = 0;    ///< ICC(2,k)
  double consistency_mean = 0;  ///< ICC(3,k): Cronbach's alpha
};

/// @param scores  a row a person, a column a judge or an attempt [n x k], both at least 2
Icc intraclass_correlation(const Eigen::MatrixXd& scores);

}  // namespace stylet::lab::statistics
