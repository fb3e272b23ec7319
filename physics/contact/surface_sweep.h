// The way of the needle's tip against the surfaces of all bodies: nothing is gone into unseen, however fast.
#pragma once

#include "physics/messages/messages.h"
#include "physics/messages/surface_patch.h"
#include "physics/tissue/tissue_model.h"

#include <Eigen/Core>

#include <array>
#include <cstdint>
#include <utility>

namespace stylet::physics {

/// Faces and tree of a body's boundary.
SurfaceTopology surface_topology(const TissueModel& model);
/// Boxes around the faces where they are now. O(faces), no allocation.
void refit(SurfacePatch& surface);

/// A point of a surface: x = sum weights[k] * x[corner k of the face].
struct SurfaceHit {
  int face = -1;                                      ///< -1: none
  Eigen::Vector3d weights = Eigen::Vector3d::Zero();  ///< >= 0, sum 1
  double along = 0;                                   ///< of the segment, 0 to 1
  bool entering = false;                              ///< the segment goes into the body there
};

/// Where a segment first meets a surface. An edge between two faces belongs to both: nothing slips through.
/// @realtime no allocation; O(log faces) boxes where the surface is not folded
SurfaceHit first_hit(const SurfacePatch& surface, const Eigen::Vector3d& from, const Eigen::Vector3d& to);
/// The point of a surface that is nearest to `x`; face -1: none within `range`.
SurfaceHit nearest(const SurfacePatch& surface, const Eigen::Vector3d& x, double range);
/// Whether `x` is inside: by the side from which a ray against `direction` meets the surface first, so faces that are
/// met twice at an edge do not matter.
/// @param direction  unit
bool is_inside(const SurfacePatch& surface, const Eigen::Vector3d& x, const Eigen::Vector3d& direction);

Eigen::Vector3d position_on(const SurfacePatch& surface, const SurfaceHit& hit);
/// Unit, outward.
Eigen::Vector3d normal_on(const SurfacePatch& surface, const SurfaceHit& hit);

/// Follows the tip of a needle against every body that it has no track in. Bodies are judged where the patch has
/// them; when a new one comes with the body elsewhere, the tip's side of it is found anew.
/// @realtime nothing allocates
class SurfaceSweep {
public:
  /// The tip has gone on. A body that is not watched counts as left; one that the tip is deep in at first as well.
  /// @param watched  bodies that the tip may go into
  /// @param held_up  the track cannot follow the tip
  void follow(const TissuePatch& patch, const Eigen::Vector3d& tip, const Eigen::Vector3d& tangent,
              const std::array<bool, kMaxBodies>& watched, bool held_up);
  /// The tip has just let go of a surface: the next step inwards is to meet it again.
  /// @param tip  put a little off it
  void start_from(int body, const Eigen::Vector3d& tip);
  /// There is no tissue.
  void clear();

  /// The body gone into first that has not been left or taken since; -1: none.
  int entered() const;
  /// Where that was.
  const SurfaceHit& hit(int body) const { return bodies_[body].hit; }
  /// The track has it.
  void take(int body) { leave(bodies_[body]); }
  /// The tip is in there without having gone in by its surface. It is not to meet that until it has left the body.
  void pass_over(int body) {
    leave(bodies_[body]);
    bodies_[body].began_inside = bodies_[body].passed_over = true;
  }
  /// A body passed over that the tip has gone on in since, by more than it came back before; -1: none.
  int went_on() const;
  /// How far the tip went in the last step, m.
  double way(int body) const { return bodies_[body].way; }
  /// Whether a surface was taken or left, since the last call, that the tip had gone through while the track could
  /// not follow: felt late, or not at all.
  bool late() { return std::exchange(late_, false); }

private:
  struct Body {
    bool known = false;    // `from` is where the tip was
    bool watched = false;  // in the step before
    double way = 0;        // of the last step, m
    Eigen::Vector3d from = Eigen::Vector3d::Zero();
    bool began_inside = false;  // no surface was met: the first patch had the tip in there, or passed over
    bool passed_over = false;
    double went_on = 0;       // then, along the needle since it turned round, m
    SurfaceHit hit{};         // face >= 0: gone into there
    std::uint64_t order = 0;  // of entering
    bool late = false;        // and the track could not follow
  };
  void enter(Body& body, const SurfaceHit& hit);
  void leave(Body& body);

  std::array<Body, kMaxBodies> bodies_;
  std::uint64_t epoch_ = 0;
  std::uint64_t entries_ = 0;
  bool late_ = false;
};

}  // namespace stylet::physics
