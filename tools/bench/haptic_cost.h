// What a haptic step must compute and move, and how fast this machine could do it.
#pragma once

namespace stylet::bench {

/// Work of one haptic step.
struct Cost {
  double flops = 0;
  double bytes = 0;  ///< every array of the step read or written once
};

/// Counted from the algorithms' matrix products and factorisations, in double precision; trigonometry, square roots
/// and copies are left out. All contacts in one body, no new patch.
/// @param rows  constraint rows, two a contact
Cost haptic_step_cost(int beams, int rows);

/// One core's peak, measured. Per microsecond, as the steps are.
struct MachinePeak {
  double flops_per_us = 0;         ///< product of two 96 x 96 matrices
  double cache_bytes_per_us = 0;   ///< a = b + s c over arrays of the step's size, which stay in the caches
  double memory_bytes_per_us = 0;  ///< the same over arrays that do not

  /// The step fits the caches, so it can be no faster than its flops or its bytes there, whichever take longer.
  double shortest_time_us(const Cost& cost) const;
};

/// Takes some tens of milliseconds.
MachinePeak measure_peak();

}  // namespace stylet::bench
