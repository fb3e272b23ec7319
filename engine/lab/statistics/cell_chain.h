// Mean run length of a chart whose sums are no lattice (a metric's CUSUM or EWMA, a mix of risks): the interval
// between its limits is cut into cells, and the chain of them solved: (I - Q) L = 1 (Brook and Evans, Biometrika 59
// (1972) 539).
#pragma once

#include <functional>

namespace stylet::lab::statistics {

struct CellChain {
  double low = 0;
  double high = 0;       ///< a value at or beyond it is a signal
  bool barrier = false;  ///< what would fall below `low` stays there (CUSUM); else that is a signal too
  int cells = 0;         ///< the error falls with its square; the work grows with its cube
  double start = 0;
  std::function<double(double from, double to)> at_most;  ///< P(the next value, unheld, <= to | it is `from`)
};

double mean_run_length(const CellChain& chain);

/// One-sided CUSUM of standard normal values moved by `shift`: S = max(0, S + z - reference).
double normal_cusum_run_length(double reference, double limit, double shift, int cells = 400);
/// EWMA z = w x + (1 - w) z of the same, limits -+width sqrt(w / (2 - w)) (Lucas and Saccucci, Technometrics 32
/// (1990) 1).
double normal_ewma_run_length(double weight, double width, double shift, int cells = 401);

}  // namespace stylet::lab::statistics
