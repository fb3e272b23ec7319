// The needle's path through the bodies: contact points laid by the simulation loop (paper III-A, collision
// detection).
#pragma once

#include "physics/messages/messages.h"
#include "physics/tissue/tet_topology.h"
#include "physics/tissue/tissue_model.h"

#include <Eigen/Core>

#include <cstdint>
#include <span>
#include <vector>

namespace stylet::physics {

struct InsertionPathSettings {
  double spacing = 0.010;            ///< between contact points along the shaft, m
  double removal_hysteresis = 2e-4;  ///< how far the tip withdraws past a point before it is removed, m
};

/// A contact point: a material point of the tissue that the needle passes through, and where it is on the shaft.
struct PathContact {
  std::uint32_t id = 0;
  TetPoint point;
  int beam = 0;
  double beam_fraction = 0;
  Eigen::Matrix<double, 3, 2> directions = Eigen::Matrix<double, 3, 2>::Zero();  ///< lateral_directions() there
};

/// Contacts of all bodies. The first of a body is where the shaft enters its surface, then one every `spacing` along
/// the shaft as the tip advances, laid exactly on the current straight-edge shaft (so without violation at birth);
/// one is removed when the tip has been withdrawn past it. Ids are never used twice.
class InsertionPath {
public:
  /// `models` must outlive the path.
  InsertionPath(std::span<const TissueModel> models, const InsertionPathSettings& settings);

  /// Removes, lays and re-projects contacts.
  /// @param needle     at least two nodes, finite
  /// @param positions  deformed bodies [3 x nodes], m
  /// @return PatchFlag bits: with kMaxContacts contacts a new one takes the place of the body's last one; a body with
  /// more
  ///         than kMaxPatchNodes isolated nodes drops its oldest contacts
  std::uint32_t update(const NeedleState& needle, std::span<const Eigen::Matrix3Xd> positions);
  /// Removes all contacts: there is no needle.
  void clear();

  /// From entry to tip.
  std::span<const PathContact> contacts(int body) const { return contacts_[body]; }
  int contact_count() const;
  /// Nodes of the contacts' tetrahedra, ascending.
  std::vector<int> isolated_nodes(int body) const;
  /// Nodes that will probably be isolated next: of the tetrahedra where contacts will be laid if the needle goes
  /// straight on for `range`, and of their neighbours. Nearest first, distinct; not those of isolated_nodes().
  /// @param positions  of the body [3 x nodes], m
  std::vector<int> nodes_ahead(int body, const NeedleState& needle, const Eigen::Matrix3Xd& positions,
                               double range) const;

private:
  struct Shaft;
  void remove_withdrawn(const Shaft& shaft, const Eigen::Matrix3Xd& positions, std::size_t body);
  std::uint32_t lay_entry(const Shaft& shaft, const Eigen::Matrix3Xd& positions, std::size_t body);
  std::uint32_t lay_behind_tip(const Shaft& shaft, const Eigen::Matrix3Xd& positions, std::size_t body);
  std::uint32_t lay(const TetPoint& point, std::size_t body);

  std::span<const TissueModel> models_;
  InsertionPathSettings settings_;
  std::vector<std::vector<PathContact>> contacts_;  // [bodies]
  std::uint32_t next_id_ = 1;
};

}  // namespace stylet::physics
