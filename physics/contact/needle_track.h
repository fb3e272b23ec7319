// The track of the needle through the bodies, kept at haptic rate (coupling `stylet`): where it touches, what it
// cuts, what it breaks through, and the law of every row.
#pragma once

#include "physics/contact/active_contact.h"
#include "physics/contact/bounded_solver.h"
#include "physics/contact/hermite_shaft.h"
#include "physics/contact/subgrid_compliance.h"
#include "physics/contact/tissue_map.h"
#include "physics/contact/tissue_points.h"
#include "physics/loops/messages.h"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace stylet::physics {

struct NeedleTrackSettings {
  double spacing = 0.010;          ///< between contact points along the shaft, m
  bool subgrid_compliance = true;  ///< of shaft and tip, README eq. 19-21
  double bevel_ratio = 0;   ///< lateral over axial force on the tip that cuts; pushes away from the bevel's face
  double tip_friction = 1;  ///< Coulomb, sideways, of a tip that presses on something
  /// Of the area that a tip presses on, m. More than the needle's: a capsule and the stiffening of strained tissue
  /// spread the load, and neither is modelled.
  double tip_radius = 5e-3;
  double side_length = 2e-3;       ///< over which a tip that cuts loses what presses it sideways, m
  double reentry_distance = 2e-3;  ///< a tip that touches a body this close to its old hole goes in there, m
};

/// The contact system of a step, filled by NeedleTrack::place(). All memory is taken in the constructor.
struct TrackRows {
  TrackRows();
  int contact_count = 0;
  int row_count = 0;
  std::vector<ActiveContact> contacts;  ///< [contact_count] hub to tip, the tip's own last
  std::vector<ContactRow> laws;         ///< [row_count]
  Eigen::VectorXd slip;                 ///< [row_count] how far needle material has slid past the point so far, m
};

/// Material points that the needle passes, `spacing` apart, laid where the tip has been; and the track's end, which
/// moves only when the tip cuts. A withdrawn needle leaves its points behind; they are in touch again when it comes
/// back, and until it reaches the end nothing is cut.
///
/// A contact stands for the shaft half way to its neighbours, the last one also for what is between it and the tip.
/// A new one is laid at the tip, on the shaft, and takes its share over as the tip goes on: its compliance
/// (per length, eq. 19) starts so large and its friction at zero that neither birth nor removal is felt.
///
/// When all places are taken, a point far behind the tip gives its share to its neighbours while the tip goes on to
/// the next point to lay, and makes room for that: every second one first, so the track gets coarser from the hub on.
/// One thread; no allocation after the constructor.
class NeedleTrack {
public:
  /// @param tissues  what resists where; shared, never changed
  NeedleTrack(const NeedleTrackSettings& settings, double needle_radius, std::shared_ptr<const TissueMap> tissues);

  /// There is no tissue: forgets everything.
  void clear(TissuePoints& tissue);
  /// A new patch: finds the track in it. @realtime
  void load(const TissuePatch& patch, TissuePoints& tissue);
  /// Contacts, their rows and laws on a shaft. @realtime
  void place(const HermiteShaft& shaft, const TissuePoints& tissue, double dt, TrackRows& out);
  /// After the solve: what has slid, cut and broken through, on the shaft as it is now. @realtime
  /// @param tissue  moved by the step's forces
  void advance(const HermiteShaft& shaft, const TissuePatch& patch, const TrackRows& rows,
               const BoundedSolver& solver, Eigen::Ref<const Eigen::VectorXd> lambda, std::uint64_t step,
               TissuePoints& tissue);
  /// Tip, contacts, track and punctures. @realtime
  void publish(const TissuePoints& tissue, double beam_length, double length, NeedleState& out) const;
  /// NeedleFlag bits of the last load(), place() and advance().
  std::uint32_t flags() const { return flags_; }

private:
  struct TrackPoint {
    PatchContact place;  // id, tetrahedron, patch nodes, barycentric
    int body = -1;
    int tissue = 0;       // index into the map
    int patch_tet = -1;   // -1: not in the patch
    int point = -1;       // index into TissuePoints
    bool active = false;  // the shaft is there
    double arc = 0;       // of the shaft at the point, m
    double held_arc = 0;  // needle material that sticks to the point, m
    double share = 0;     // of the shaft, m
    SubgridSite site{};   // what the mesh is like there
  };
  struct Tip {
    TipState state = TipState::outside;
    TrackPoint end;      // where the track ends; indenting: the surface point it presses on
    double barrier = 0;  // a surface at the end that holds up to this force, N; 0: none
    int beyond = 0;      // tissue behind the barrier
    Eigen::Vector3d inward = Eigen::Vector3d::Zero();  // indenting: minus the surface's normal
  };

  bool find(const TissuePatch& patch, TrackPoint& point) const;
  void place_points(const TissuePatch& patch, TissuePoints& tissue);
  void share_shaft(double reach);
  void share_out_leaving(int body);
  void choose_leaving();
  bool make_room();
  void add_contact(const HermiteShaft& shaft, const TrackPoint& point, const ShaftPoint& at, double dt,
                   TrackRows& out) const;
  void add_tip(const HermiteShaft& shaft, double dt, TrackRows& out) const;
  void slide(const TrackRows& rows, const BoundedSolver& solver);
  void touch(const HermiteShaft& shaft, const TissuePatch& patch, TissuePoints& tissue);
  void enter(std::uint64_t step, double force);
  void advance_tip(const HermiteShaft& shaft, const TissuePatch& patch, const TrackRows& rows,
                   const BoundedSolver& solver, Eigen::Ref<const Eigen::VectorXd> lambda, std::uint64_t step,
                   TissuePoints& tissue);
  void move_end(const HermiteShaft& shaft, const Eigen::Vector3d& target, const TissuePatch& patch,
                TissuePoints& tissue);
  void meet_tissue(const TissuePatch& patch);
  void lay(const HermiteShaft& shaft, const TissuePatch& patch, TissuePoints& tissue);
  void come_back(double length);
  void describe(const TissuePatch& patch, TrackPoint& point) const;
  void record(std::uint64_t step, int to, double force);
  TrackPoint* last_active(int body);
  std::span<TrackPoint> points() { return {points_.data(), static_cast<std::size_t>(count_)}; }
  std::span<const TrackPoint> points() const { return {points_.data(), static_cast<std::size_t>(count_)}; }

  NeedleTrackSettings settings_;
  double radius_;
  std::shared_ptr<const TissueMap> tissues_;
  std::vector<TrackPoint> points_;  // [count_] in the order of laying
  int count_ = 0;
  std::uint32_t next_id_ = 1;
  std::uint32_t leaving_ = 0;  // point that makes room for the next one to lay; 0: none has to
  double left_ = 0;            // part of its share that its neighbours have
  Tip tip_;
  std::array<TrackPoint, kMaxBodies> ends_;    // of tracks that the tip is not in
  std::array<bool, kMaxBodies> threaded_{};    // the body has a track
  std::array<double, kMaxBodies> overhang_{};  // shaft between the last contact and where the tip left, m
  std::uint32_t flags_ = 0;
  std::uint32_t punctures_ = 0;
  Puncture last_puncture_;
  std::vector<PatchContact> scratch_contacts_;
  std::vector<int> scratch_bodies_;
};

}  // namespace stylet::physics
