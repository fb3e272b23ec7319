// The tip of the needle: what it presses on, cuts and breaks through (coupling `stylet`).
#pragma once

#include "physics/contact/bounded_solver.h"
#include "physics/contact/hermite_shaft.h"
#include "physics/contact/surface_sweep.h"
#include "physics/contact/tissue_map.h"
#include "physics/contact/tissue_points.h"
#include "physics/contact/track_points.h"
#include "physics/contact/track_rows.h"
#include "physics/messages/messages.h"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <memory>

namespace stylet::physics {

struct PatchWalk;

/// A haptic step after its solve, as the needle's track goes on from it.
struct SolvedStep {
  const HermiteShaft& shaft;  ///< at the end of the step
  const TissuePatch& patch;
  const TrackRows& rows;
  const BoundedSolver& solver;
  const Eigen::VectorXd& lambda;  ///< [rows], N
  std::uint64_t number;           ///< of the haptic step
  double dt;                      ///< s
  double taken;                   ///< of the solved motion, by the needle: the rest is for the next steps

  /// Of a row, m: what the needle has not done has not slid or cut.
  double motion(int row) const { return taken * solver.motion()[static_cast<std::size_t>(row)]; }
};

/// State of the tip and the end of its track, with what it left behind in bodies that it went through or out of:
///
///   outside ── touch() ──▶ indenting ── advance(): the surface breaks ──▶ inside ── advance(): the end moves by
///      ▲                       │                                            │        cutting; surfaces in the way
///      ├──── advance(): lets go of ◀┘                                       │        are barriers until they break
///      └──── withdraw() past the hole, or advance() out of the body ◀───────┘
///   outside ── touch() near its old hole, or come_back() through a body it had gone through ──▶ inside
///
/// Where a call returns true, the end is another point than before: it must be made known to the tissue points again.
/// @realtime nothing after the constructor allocates
class NeedleTip {
public:
  NeedleTip(const NeedleTrackSettings& settings, double needle_radius, std::shared_ptr<const TissueMap> tissues);

  /// There is no tissue: forgets everything but the punctures counted.
  void clear();
  /// Finds the ends of tracks in a new patch. @return false if the tip's own is not in it
  /// @param tissue  as of the patch before
  bool find(const TissuePatch& patch, const TissuePoints& tissue);

  TipState state() const { return state_; }
  bool outside() const { return state_ == TipState::outside; }
  /// Inside, with its end in the patch.
  bool inside() const { return state_ == TipState::inside && end_.point >= 0; }
  /// Where the track ends; indenting: the surface point pressed on. With its index into the tissue points.
  TrackPoint& end() { return end_; }
  const TrackPoint& end() const { return end_; }
  /// Shaft in the tissue that the tip is in, m: up to the track's end, a little behind a tip that cuts.
  double reach(const HermiteShaft& shaft, const TissuePoints& tissue) const;
  /// Shaft in a body beyond its last contact, m.
  /// @param last   that contact
  /// @param reach  as above
  double overhang(const TrackPoint& last, double reach) const;
  /// Where the track ends in a body, at rest, m.
  const Eigen::Vector3d& end_in(int body) const {
    return state_ == TipState::inside && end_.body == body ? end_.rest : ends_[body].rest;
  }

  /// Row along what the tip presses on or cuts, and two across; none where nothing resists.   (README eq. 25, 26)
  void add_rows(const HermiteShaft& shaft, double dt, TrackRows& out) const;

  /// The tip has gone on: which surfaces it has gone through. (README eq. 25a)
  void sweep(const HermiteShaft& shaft, const TissuePatch& patch, TrackPoints& points);
  bool come_back(TrackPoints& points, double length);
  /// A tip that came back to a track, somewhere beside its end, presses on that from where it was when the end was
  /// known again.
  void begin_unpressed(const HermiteShaft& shaft, const TissuePoints& tissue);
  bool touch(const HermiteShaft& shaft, const TissuePatch& patch, const TissuePoints& tissue, TrackPoints& points);
  bool withdraw(TrackPoints& points);
  /// The shaft has been cut aside so far that its old track ahead is not its way any more: that ends where the tip
  /// is.
  bool begin_anew(int body, const SolvedStep& step, const TissuePoints& tissue, TrackPoints& points);
  /// The last point of the track was cut aside: so is the end. @realtime
  void go_aside(const SolvedStep& step, const Eigen::Vector3d& aside, TissuePoints& tissue);
  /// Forgets the points that the shaft was cut out of the body at; where they were the last ones, the tip is out,
  /// too.
  bool tear_out(TrackPoints& points);
  /// After a solve that the tip's rows were part of, if its contact was there.
  bool advance(const SolvedStep& step, TissuePoints& tissue, TrackPoints& points);
  /// Outside again: what it has just met cannot be used.
  void let_go() { leave(); }

  void publish(NeedleState& out) const;
  /// NeedleFlag bits since the last call.
  std::uint32_t take_flags();

private:
  void leave();
  bool begin_inside(const HermiteShaft& shaft, const TissuePatch& patch, const TissuePoints& tissue,
                    TrackPoints& points);
  bool come_into_old_hole(int body, const HermiteShaft& shaft, const TissuePoints& tissue, TrackPoints& points);
  bool press_on(const SolvedStep& step, const ActiveContact* contact, TissuePoints& tissue, TrackPoints& points);
  /// Indenting, where the tip has slid over the surface: so does the point that it presses on.
  /// @return false if it has slid off the body
  bool follow_slide(const SolvedStep& step, const ActiveContact& contact, TissuePoints& tissue);
  /// @return false if the patch is not finite there: nothing was moved
  bool put_end(const PatchWalk& at, const TissuePatch& patch, TissuePoints& tissue);
  /// @param force     on the tip that broke in, N
  /// @param response  of the tip's row, m/N
  void enter(std::uint64_t step, double force, double response);
  /// @param contact  the tip's own, null: none
  bool move_end(const SolvedStep& step, const Eigen::Vector3d& target, const ActiveContact* contact,
                TissuePoints& tissue, TrackPoints& points);
  bool move_end_on(const SolvedStep& step, const Eigen::Vector3d& target, TissuePoints& tissue, TrackPoints& points);
  /// The end, or its row, is another one at once: for now the tip is off it by what leaves the forces as they are.
  void ease(const SolvedStep& step, const ActiveContact& contact, const TissuePoints& tissue);
  /// Indenting: of the dent that the mesh does not see, what needs no force any more, m. (eq. 20c)
  double crept() const;
  /// @param dent  all of it, m
  void relax(double dent, double dt);
  /// Of the tip's rows, m/N.
  double compliance() const;
  /// Of the tissue that the tip is in, N.
  double cutting_force() const;
  void meet_tissue(const SolvedStep& step, TissuePoints& tissue);
  void record(std::uint64_t step, int to, double force, double response);

  NeedleTrackSettings settings_;
  double radius_;  // of the needle, m
  std::shared_ptr<const TissueMap> tissues_;
  TipState state_ = TipState::outside;
  TrackPoint end_;
  double barrier_ = 0;                                // a surface at the end that holds up to this force, N; 0: none
  double pressed_ = 0;                                // indenting: force on the tip in the step before, N
  std::array<double, 2> caught_up_{};                 // and the dents that its fading parts remember, m (eq. 20c)
  int beyond_ = 0;                                    // tissue behind the barrier
  Eigen::Vector3d inward_ = Eigen::Vector3d::Zero();  // indenting: minus the surface's normal
  Eigen::Vector3d side_ = Eigen::Vector3d::Zero();    // of the tip from the end, sideways, without force there, m
  Eigen::Vector3d ease_ = Eigen::Vector3d::Zero();    // of the tip from the end for now, m; fades as it cuts on
  double ease_length_ = 1;                            // over which it does, m
  std::array<TrackPoint, kMaxBodies> ends_;           // of tracks that the tip is not in
  std::array<bool, kMaxBodies> threaded_{};           // the body has a track
  std::array<double, kMaxBodies> overhang_{};         // shaft between the last contact and where the tip left, m
  SurfaceSweep sweep_;
  bool held_up_ = false;     // the patch ends where the track does
  bool came_back_ = false;   // and its end was not known since
  double lag_ = 0;           // how far the end is behind what has been cut, m
  Eigen::Matrix3Xd places_;  // [3 x kMaxContacts] scratch
  std::uint32_t flags_ = 0;
  std::uint32_t punctures_ = 0;
  Puncture last_puncture_;
};

}  // namespace stylet::physics
