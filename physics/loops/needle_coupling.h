// What couples the needle to the tissue in a haptic step: where they touch and by what law.
#pragma once

#include "physics/contact/delassus.h"
#include "physics/contact/tissue_points.h"
#include "physics/contact/track_rows.h"
#include "physics/messages/messages.h"
#include "physics/needle/needle.h"

#include <Eigen/Core>

#include <cstdint>
#include <memory>
#include <utility>

namespace stylet::physics {

/// The contact system of a step, (W + C) lambda = -delta_free   (physics/README.md eq. 18). All memory is taken in
/// the constructor.
struct ContactSystem {
  TissuePoints tissue;
  TrackRows rows;                                                ///< laws and slip: Coupling::stylet only
  Eigen::VectorXd delta_free = Eigen::VectorXd::Zero(kMaxRows);  ///< [rows], m
  Eigen::VectorXd lambda = Eigen::VectorXd::Zero(kMaxRows);      ///< [rows], N; where a step begins, of the last one
  double taken = 1;  ///< of the solved step, by the needle: one that would turn it too far is shortened
};

/// The stages of a haptic step that differ between couplings, in the order in which HapticLoop calls them. Where
/// flags are returned they are NeedleFlag bits. One thread.
/// @realtime everything but clone(): no allocation, lock or exception
class NeedleCoupling {
public:
  virtual ~NeedleCoupling() = default;
  virtual std::unique_ptr<NeedleCoupling> clone() const = 0;
  /// There is no tissue: forgets all contacts.
  virtual void clear(TissuePoints& tissue) = 0;
  /// Takes a new patch. The flags hold for every step with it.
  virtual std::uint32_t load(const TissuePatch& patch, TissuePoints& tissue) = 0;
  /// Where contacts are on the needle: their shaft points and rows.
  /// @param predicted  where the step is linearised
  /// @param dt         duration of the step, s
  virtual void place(const NeedleShape& predicted, double dt, ContactSystem& system) = 0;
  /// Along what their rows act, where place() did not say it.
  virtual void direct(const NeedleShape& /*predicted*/, ContactSystem&) {}
  /// lambda, from W and delta_free. The flags have kNeedleSolveFailed if there is none to go on with.
  virtual std::uint32_t solve(const Delassus& delassus, ContactSystem& system) = 0;
  /// What contacts have become by the step solved; only where there is tissue.
  /// @param shape   at the end of the step, as the tissue's points are
  /// @param number  of the step
  virtual std::uint32_t advance(const NeedleShape& /*shape*/, const TissuePatch& /*patch*/, std::uint64_t /*number*/,
                                ContactSystem&) {
    return 0;
  }
  /// Contacts, track, tip and punctures.
  virtual void publish(const ContactSystem& system, NeedleState& out) const = 0;

protected:
  /// Smallest pivot over the tissue's own compliance below which rows count as dependent, and what they then get of
  /// it.
  static constexpr double kDependent = 1e-2;
  static constexpr double kSoftened = 1e-3;
};

/// A coupling that is copied with the loop that owns it.
class OwnedCoupling {
public:
  explicit OwnedCoupling(std::unique_ptr<NeedleCoupling> coupling) : coupling_(std::move(coupling)) {}
  OwnedCoupling(const OwnedCoupling& other) : coupling_(other.coupling_->clone()) {}
  OwnedCoupling(OwnedCoupling&&) noexcept = default;
  OwnedCoupling& operator=(OwnedCoupling other) noexcept {
    coupling_.swap(other.coupling_);
    return *this;
  }
  ~OwnedCoupling() = default;

  NeedleCoupling* operator->() { return coupling_.get(); }

private:
  std::unique_ptr<NeedleCoupling> coupling_;
};

}  // namespace stylet::physics
