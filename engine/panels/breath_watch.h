// The patient is asked for the breath: by whom, what there is to tell of it, and what goes on record.
#pragma once

#include "engine/session/held_breath.h"
#include "engine/session/live_session.h"

#include <string>

namespace stylet::panels {

/// Thread: the one that draws.
class BreathWatch {
public:
  /// Keeps a reference to `breath`.
  explicit BreathWatch(session::HeldBreath& breath) : breath_(breath), seen_(breath.state()) {}

  /// A key or a button: the patient is to hold it, or to breathe on.
  void ask();
  /// With each frame: does what the stylus's button asks for, and puts on record what the patient does.
  void look(session::LiveSession& live);
  /// Nobody has asked, or the patient breathes on.
  bool breathes() const { return breath_.state() == session::HeldBreath::State::breathing; }
  /// What the patient does; empty: nothing to tell. @param time_s  of the session
  std::string in_words(double time_s) const;

  static constexpr double kSaid = 4;  ///< s, that the patient had to breathe

private:
  session::HeldBreath& breath_;
  session::HeldBreath::State seen_;
  double gave_up_s_ = -kSaid;  ///< when the patient had to breathe
  bool let_go_ = false;        ///< by the trainee
};

}  // namespace stylet::panels
