// The material points that the needle passes, in the order in which they were laid.
#pragma once

#include "physics/contact/lugre.h"
#include "physics/contact/patch_walk.h"
#include "physics/contact/subgrid_compliance.h"
#include "physics/contact/surface_sweep.h"
#include "physics/contact/tissue_map.h"
#include "physics/contact/tissue_points.h"
#include "physics/messages/messages.h"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace stylet::physics {

/// A material point of the needle's track.
struct TrackPoint {
  PatchContact place;  ///< id, tetrahedron, patch nodes, barycentric
  int body = -1;
  int tissue = 0;                                  ///< index into the map
  int patch_tet = -1;                              ///< -1: not in the patch
  Eigen::Vector3d rest = Eigen::Vector3d::Zero();  ///< where it is in the patient at rest, m
  int kept_patches = 0;                            ///< how many have lacked it
  int point = -1;                                  ///< index into TissuePoints
  bool active = false;                             ///< the shaft is there
  bool lost = false;                               ///< it was, when the patch ceased to hold the point
  double arc = 0;                                  ///< of the shaft at the point, m
  double held_arc = 0;                             ///< needle material that sticks to the point, m
  double share = 0;                                ///< of the shaft, m
  double modulus = 0;  ///< mean E of the tissue along its share, at rest, Pa; 0: not known, that of `site` counts
  std::array<double, 2> halves{};  ///< E of the way to it from the point before, of either half, Pa
  std::array<Eigen::Vector3d, 2> halves_of{Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};  ///< [the two] then, m
  SubgridSite site{};   ///< what the mesh is like there
  Bristles bristles{};  ///< with ShaftFriction::lugre
  double pressed = 0;   ///< lateral force of the last step there, N
  double turned = 0;    ///< how far the shaft's surface has gone round since it stuck to the point, m
  bool cuts = false;    ///< in the last step, sideways
  double torn = 0;      ///< how far beyond the body's surface the shaft is there, cut out of it sideways, m
};

/// Puts a point into a tetrahedron of a patch. Its `site` goes with it.
void put_in_patch(const TissuePatch& patch, int patch_tet, const Eigen::Vector4d& barycentric, TrackPoint& point);
/// Looks a point up in a patch. @return whether it is there
bool find_in_patch(const TissuePatch& patch, TrackPoint& point);
/// The same; a point that was known up to now and is not there is kept as it was, for some patches.
bool find_or_keep(const TissuePatch& patch, const TissuePoints& tissue, TrackPoint& point);
/// From a point that is in the patch to where the tissue is now that is seen at `x` beside it: near the point the
/// tissue is as far off the patch as the point is (README eq. 17b).
PatchWalk walk_from(const TissuePatch& patch, const TrackPoint& point, const Eigen::Vector3d& x,
                    const TissuePoints& tissue);
/// What the mesh is like at a point that is in the patch: continuous along the track.
SubgridSite site_in_patch(const TissuePatch& patch, const TrackPoint& point);
/// The same where the patch has the surface alone.
/// @param barycentric  of the point in the tetrahedron behind the face
SubgridSite site_on_surface(const SurfacePatch& surface, const SurfaceHit& hit, const Eigen::Vector4d& barycentric);

/// Points `spacing` apart, all bodies together, and the share of the shaft that each stands for.
///
/// When all places are taken, a point far behind the tip gives its share to its neighbours while the tip goes on to
/// the next point to lay, and makes room for that: every second one first, so the track gets coarser from the hub on.
/// @realtime nothing after the constructor allocates
class TrackPoints {
public:
  static constexpr int kMost = 60;  ///< three rows each, and three of the tip

  /// @param spacing  between two of them, m
  explicit TrackPoints(double spacing);

  std::span<TrackPoint> all() { return {points_.data(), static_cast<std::size_t>(count_)}; }
  std::span<const TrackPoint> all() const { return {points_.data(), static_cast<std::size_t>(count_)}; }
  /// The first one of a body, and the last one that the shaft reaches; null: none.
  TrackPoint* first(int body);
  TrackPoint* last_active(int body);

  void clear();
  void forget(int body);
  /// Those of a body that the shaft is withdrawn from.
  void forget_withdrawn(int body);
  /// Forgets those of a body that the shaft is that far out of it at. @return whether there were any
  bool drop_torn(int body, double most);
  /// One more, active, with an id of its own. Where no point has gone yet to make room, one goes at once, which is
  /// felt.
  /// @param end  where the track ends; arc: of the shaft there, m
  /// @return whether there was room without that
  bool lay(const TrackPoint& end, double arc);

  /// Shares of a body's active points: the shaft half way to the neighbours. The last one has the overhang too, and
  /// takes half of the gap before it over as that grows to `spacing`.
  /// @param end       where the track ends, at rest, m
  /// @param overhang  of the shaft beyond the last one, m
  void share_shaft(int body, const Eigen::Vector3d& end, double overhang, const TissueMap& tissues);
  /// How far the tip is beyond the last point: what makes room goes in proportion.
  void fade_leaving(double overhang);
  void share_out_leaving();

private:
  void share_out_leaving(int body);
  void choose_leaving();
  bool make_room();

  double spacing_;
  std::vector<TrackPoint> points_;  // [count_]
  int count_ = 0;
  std::uint32_t next_id_ = 1;
  std::uint32_t leaving_ = 0;  // point that makes room for the next one to lay; 0: none has to
  double left_ = 0;            // part of its share that its neighbours have
};

}  // namespace stylet::physics
