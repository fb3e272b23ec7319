// How the simulation loop fills a TissuePatch.
#pragma once

#include "physics/contact/insertion_path.h"
#include "physics/messages/messages.h"
#include "physics/tissue/factorisation_worker.h"
#include "physics/tissue/quadratic.h"
#include "physics/tissue/tissue_model.h"

#include <Eigen/Core>

#include <span>
#include <vector>

namespace stylet::physics {

/// What a body's patch is cut from.
struct PatchSource {
  const TissueModel& model;
  std::span<const int> nodes;                    ///< isolated, ascending
  std::span<const int> held;                     ///< others in the patch, ascending
  const Eigen::Matrix3Xd& positions;             ///< [3 x all nodes] deformed, m
  const Eigen::Matrix3Xd& free_positions;        ///< [3 x nodes isolated], m
  std::span<const PathContact> contacts;         ///< of the simulation loop's path; none in coupling `stylet`
  std::span<const PointStiffness> stiffening{};  ///< [points] or empty: as at rest
};

/// Fills a body's patch but for W_bar; kPatchTetOverflow in `flags` where its tetrahedra do not fit.
void fill_body_patch(const PatchSource& source, BodyPatch& out, std::uint32_t& flags);
/// Last of all, so that the haptic side finds it in a cache: W_bar is most of what it reads.
void fill_w_bar(const IsolatedDofs& isolated, BodyPatch& out);

}  // namespace stylet::physics
