// Times of both loops by mesh size, with 12 to 16 constraint rows: what Table II and the low-rate loop are made of.
#pragma once

#include "tools/bench/isodofs_gain.h"
#include "tools/bench/samples.h"
#include "tools/reference/reference_insertion.h"

#include <span>
#include <vector>

namespace stylet::bench {

struct TissueTimingOptions {
  int nodes_per_edge = 10;
  int alone_steps = 20;        ///< simulation steps with 16 rows timed with the worker in between
  int with_worker_steps = 20;  ///< and with the worker in its own thread
  int gain_repetitions = 5;
};

/// Of one mesh. Samples in us.
struct TissueTiming {
  int nodes = 0;
  int isolated_dofs = 0;  ///< with 16 rows
  // Haptic side, in simulation steps with 12 to 16 rows.
  Samples w_v;              ///< H_v W_bar H_v^T in the haptic step
  Samples x_iso;            ///< motion of the isolated tissue under lambda (paper eq. 7)
  Samples haptic_exchange;  ///< taking the latest patch and preparing its points
  Samples haptic_step;
  // Simulation side.
  Samples simulation_exchange;  ///< needle state in, patch out, without W_bar; 12 to 16 rows
  Samples w_bar;                ///< W_bar of that patch written in place, and condensed onto its contacts
  Samples step_alone;           ///< SimulationLoop::step() with 16 rows, no other thread
  Samples step_with_worker;     ///< the same beside the factorisation worker, as in a session
  Samples factorisation;        ///< FactorisationWorker::step()
  IsodofsGain gain;
};

/// R1 without its withdrawals, in lockstep, to 8 contacts (16 rows) and on at a slow speed.
/// The factor is renewed about as often as a worker of its own thread manages at 50 Hz.
/// @param insertion  R1; its nodes per edge are those of the options
TissueTiming time_tissue(const reference::ReferenceInsertion& insertion, const TissueTimingOptions& options);

/// Which meshes: cubes of the reference insertion, nodes along an edge.
std::vector<int> timed_meshes(bool quick, bool full);

/// time_tissue() for each mesh. Prints its progress to stderr.
std::vector<TissueTiming> time_tissues(const reference::ReferenceInsertion& insertion,
                                       std::span<const int> nodes_per_edge);

}  // namespace stylet::bench
