// What isolated degrees of freedom save: the Delassus operator of the tissue built in three ways.
#pragma once

#include "tools/bench/samples.h"

#include "physics/messages/messages.h"
#include "physics/tissue/factorisation.h"
#include "physics/tissue/tissue_model.h"

#include <Eigen/Core>

namespace stylet::bench {

/// Times in us of W_v = H A^-1 H^T of the same contacts with the same factor.
struct IsodofsGain {
  int rows = 0;
  Samples row_solves;    ///< one full solve a constraint row, no isolated DOFs
  Samples from_scratch;  ///< W_bar of all isolated DOFs, then H W_bar H^T: after a new factorisation
  Samples incremental;   ///< only the nodes of the deepest contact are new: a contact was laid
  Samples unchanged;     ///< no new node: the usual step
  double residual = 0;   ///< max |W - W by row solves| over the three, relative to max |W|
};

/// @param patch   with at least two contacts; all its isolated nodes are of `model`
/// @param factor  of A_v
IsodofsGain measure_isodofs_gain(const physics::TissueModel& model, const physics::Factorisation& factor,
                                 const physics::BodyPatch& patch, int repetitions);

}  // namespace stylet::bench
