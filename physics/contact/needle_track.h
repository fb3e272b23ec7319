// The track of the needle through the bodies, kept at haptic rate (coupling `stylet`): where it touches, what it
// cuts, what it breaks through, and the law of every row.
#pragma once

#include "physics/contact/bounded_solver.h"
#include "physics/contact/hermite_shaft.h"
#include "physics/contact/needle_tip.h"
#include "physics/contact/tissue_map.h"
#include "physics/contact/tissue_points.h"
#include "physics/contact/track_points.h"
#include "physics/contact/track_rows.h"
#include "physics/messages/messages.h"

#include <Eigen/Core>

#include <algorithm>
#include <cstdint>
#include <memory>
#include <vector>

namespace stylet::physics {

/// Material points that the needle passes, `spacing` apart, laid where the tip has been; and the track's end, which
/// moves only when the tip cuts. A withdrawn needle leaves its points behind; they are in touch again when it comes
/// back, and until it reaches the end nothing is cut.
///
/// A contact stands for the shaft half way to its neighbours, the last one also for what is between it and the tip.
/// A new one is laid at the tip, on the shaft, and takes its share over as the tip goes on: its compliance
/// (per length, eq. 19) starts so large and its friction at zero that neither birth nor removal is felt.
///
/// A point that the shaft presses on beyond the tissue's strength goes aside with it (eq. 38), and a shaft that turns
/// about itself is held by friction as one that slides along is (eq. 39).
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
  void place(const HermiteShaft& shaft, TissuePoints& tissue, double dt, TrackRows& out);
  /// After the solve: what has slid, cut and broken through. @realtime
  /// @param tissue  moved by the step's forces
  void advance(const SolvedStep& step, TissuePoints& tissue);
  /// Tip, contacts, track and punctures. @realtime
  void publish(const TissuePoints& tissue, double beam_length, double length, NeedleState& out) const;
  /// NeedleFlag bits of the last load(), place() and advance().
  std::uint32_t flags() const { return flags_; }

private:
  void place_points(const TissuePatch& patch, TissuePoints& tissue);
  void share_shaft(double reach);
  void add_contact(const HermiteShaft& shaft, const TrackPoint& point, const ShaftPoint& at, double dt,
                   TrackRows& out) const;
  LugreRow lugre_row(const TrackPoint& point) const;
  void slide(const SolvedStep& step);
  bool turn(const HermiteShaft& shaft);
  struct Cut {
    Eigen::Vector3d aside = Eigen::Vector3d::Zero();  // m
    double slid = 0;                                  // against the tissue's strength, m
    double work = 0;                                  // J
  };
  Cut cut_at(const SolvedStep& step, const TissuePoints& tissue, const TrackPoint& point) const;
  void cut_aside(const SolvedStep& step, TissuePoints& tissue);
  /// @return how far the target is outside the body, m
  double move_aside(const TissuePatch& patch, const Eigen::Vector3d& target, TrackPoint& point, TissuePoints& tissue);
  /// What is left of the hold of a point that the shaft is cut out of the body at.
  double grip(const TrackPoint& point) const { return std::max(0.0, 1 - point.torn / settings_.tear_distance); }
  void lay(const HermiteShaft& shaft, const TissuePatch& patch, TissuePoints& tissue);

  NeedleTrackSettings settings_;
  double radius_;
  std::shared_ptr<const TissueMap> tissues_;
  TrackPoints points_;
  NeedleTip tip_;
  double dt_ = 0;                                            // of the step placed, s
  Eigen::Quaterniond hub_ = Eigen::Quaterniond::Identity();  // end of the last step
  Eigen::Vector3d hub_turn_ = Eigen::Vector3d::Zero();       // of the whole needle with its hub in this step, rad
  double idle_turn_ = 0;  // about the axis of the hub since the shaft was last free of moments, rad
  bool known_ = false;    // hub_ is
  bool turns_ = false;    // contacts resist the shaft's turning
  int strayed_ = -1;      // a body whose old track the shaft comes back far beside
  double side_cut_ = 0;   // m^2
  double side_work_ = 0;  // J
  std::uint32_t flags_ = 0;
  std::vector<PatchContact> scratch_contacts_;
  std::vector<int> scratch_bodies_;
};

}  // namespace stylet::physics
