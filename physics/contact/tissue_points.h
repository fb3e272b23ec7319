// The tissue's side of the contacts: material points of the patch, their compliance and their motion under the
// needle.
#pragma once

#include "physics/contact/active_contact.h"
#include "physics/contact/organ_coupling.h"
#include "physics/messages/messages.h"

#include <Eigen/Core>

#include <cstddef>
#include <span>
#include <vector>

namespace stylet::physics {

/// The contact points of a patch, all bodies together.
///
/// H_v of the paper factors into directions and barycentric weights, H_v = -D B, and only D changes between two
/// simulation steps. So B W_bar B^T, a 3x3 block for every pair of points, is formed once a patch; a haptic step then
/// costs one 2x2 block a pair, and the isolated DOFs' motion (paper eq. 7) is needed at the points only:
///   W_v = D^T (B W_bar B^T) D,   x = B x_free + (B W_bar B^T) f,   f = -D lambda    (physics/README.md eq. 15-17)
class TissuePoints {
public:
  TissuePoints();

  /// Takes the contacts of a patch. Forces of contacts that the last patch had too (by body and id) are carried over,
  /// so that points keep their displaced positions. Beyond kMaxContacts the shallowest contacts are left out.
  /// @return false if contacts were left out
  /// @realtime no allocation; O(points^2)
  bool load(const TissuePatch& patch);
  /// The contacts between the bodies of a new patch: they count in what place() makes of it, not in load().
  /// @realtime no allocation; O(rows^3)
  void take_organs(const TissuePatch& patch) {
    organs_.load(patch.organs);
    drift_.setZero();
  }
  /// Which of those contacts carry force under the present forces; where that has changed, compliance and positions
  /// follow. After take_organs() and place(), and after apply().
  /// @realtime no allocation; O(rows^2), where it has changed O(rows^3 + points rows^2 + points^2 rows)
  void settle_organs(const TissuePatch& patch);
  /// What a new patch would have changed at once under the same forces, it changes bit by bit until the next one is
  /// due. After take_organs(), place() and settle_organs() for a new patch.   (README eq. 17b)
  /// @realtime no allocation; O(points^2)
  void hand_over();
  /// One haptic step further towards the patch. Before the step's rows are made.
  /// @realtime no allocation; O(points^2)
  void go_on();
  /// The last point has been put far from where it was, and its force with it: the others stay at `places` for now.
  /// @param places  [3 x count()] m
  /// @realtime no allocation
  void hold_others(Eigen::Ref<const Eigen::Matrix3Xd> places);
  /// Where a point is off the patch for now, m.
  Eigen::Vector3d drift(int point) const { return drift_.col(point); }
  /// Takes points of the haptic loop's own, at most kMaxContacts; forces are carried over in the same way. Those that
  /// are kept keep the compliance too that they had with each other and with the rest; none where there was none.
  /// @param contacts  id, tet, patch_nodes and barycentric count; of those kept free_position and nodes
  /// @realtime no allocation; O(points^2)
  void place(const TissuePatch& patch, std::span<const PatchContact> contacts, std::span<const int> bodies);
  /// One more point, with no force on it, after place(). There must be room.
  /// @realtime no allocation; O(points)
  void append(const TissuePatch& patch, const PatchContact& contact, int body);
  /// Puts the last point elsewhere; its force goes with it.
  /// @return false if the patch is not finite there: nothing was moved
  /// @realtime no allocation; O(points)
  bool move_last(const TissuePatch& patch, const PatchContact& contact, int body);
  /// Puts any point elsewhere in its body, force and all.
  /// @return false if the patch is not finite there: nothing was moved
  /// @realtime no allocation; O(points)
  bool move(const TissuePatch& patch, int point, const PatchContact& contact);
  void clear() {
    count_ = 0;
    finite_ = true;
    drift_.setZero();
    organs_.clear();
  }

  int count() const { return count_; }
  /// Whether the patch is finite where the points are. If not, their forces are all that is worth keeping.
  bool finite() const { return finite_; }
  int body(int point) const { return bodies_[point]; }
  const PatchContact& contact(int point) const { return contacts_[point]; }
  /// Position with all needle force removed, m.
  auto free_position(int point) const { return free_.col(point); }
  /// Position under the present forces, m.
  auto position(int point) const { return current_.col(point); }
  /// [3 x count()] of all of them.
  auto positions() const { return current_.leftCols(count_); }
  /// Force of the needle on the point, N.
  auto force(int point) const { return forces_.col(point); }
  /// Position of a node of the patch under the present forces, m.
  /// @realtime no allocation; O(points)
  Eigen::Vector3d node_position(const TissuePatch& patch, int body, int patch_node) const;
  /// Whether points of different bodies move each other: the bodies press on each other.
  bool bodies_coupled() const { return organs_.carrying() > 0; }
  /// Displacement of point i per force on point j, m/N [3 x 3]; zero between bodies that are not coupled.
  auto compliance(int i, int j) const {
    return Eigen::Map<const Eigen::Matrix3d, 0, Eigen::OuterStride<>>(
        compliance_.data() + 3 * i + std::ptrdiff_t{3} * j * stride_, Eigen::OuterStride<>(stride_));
  }

  /// Sets the needle's forces f = -D lambda and moves every point accordingly.
  /// @param lambda  multipliers [rows], N
  /// @realtime
  void apply(const std::vector<ActiveContact>& contacts, int contact_count, Eigen::Ref<const Eigen::VectorXd> lambda);

private:
  auto block(int i, int j) {
    return Eigen::Map<Eigen::Matrix3d, 0, Eigen::OuterStride<>>(
        compliance_.data() + 3 * i + std::ptrdiff_t{3} * j * stride_, Eigen::OuterStride<>(stride_));
  }
  void keep_old();
  void add(const PatchContact& contact, int body, const Eigen::Vector3d& free_position);
  void carry_forces();
  Eigen::Vector3d free_in(const TissuePatch& patch, const PatchContact& contact, int point) const;
  bool couple(const TissuePatch& patch, int point);
  bool couple_pair(const TissuePatch& patch, int i, int j);
  Eigen::Matrix3d old_compliance(int i, int j) const;
  void move_points();

  int count_ = 0;
  bool finite_ = true;
  OrganCoupling organs_;
  Eigen::MatrixXd openings_, folded_;         // [kMaxOrganRows x 3 kMaxContacts] y and z of each point
  Eigen::VectorXd moved_;                     // [kMaxOrganRows] scratch
  std::vector<PatchContact> contacts_;        // [count_]
  std::vector<int> bodies_;                   // [count_]
  Eigen::Matrix3Xd free_, current_, forces_;  // [3 x count_]
  // [3 count_ x 3 count_] symmetric, columns stride_ apart: no further than needed where the points stay as they are,
  // because another core's step has left nothing of it in a cache.
  Eigen::VectorXd compliance_;
  Eigen::Index stride_ = 0;
  Eigen::Matrix3Xd drift_;  // [3 x count_] of each point off the patch, m
  int steps_ = 0;           // since the patch came
  int period_ = 1;          // steps from the one before to it
  // of the patch before, while the next one is loaded
  int old_count_ = 0;
  bool old_finite_ = true;
  std::vector<PatchContact> old_contacts_;
  std::vector<int> old_bodies_;
  Eigen::Matrix3Xd old_forces_, old_current_, old_drift_;
  Eigen::VectorXd old_compliance_;
  Eigen::Index old_stride_ = 0;
};

}  // namespace stylet::physics
