// A device in the other hand: it leads the probe.
#pragma once

#include "engine/content/scene.h"
#include "engine/session/held_probe.h"
#include "engine/session/live_session.h"
#include "engine/session/probe_hand.h"
#include "haptic/hid/hid_stylus.h"

#include <memory>
#include <string>
#include <thread>

namespace stylet::app {

/// The probe slides, turns and is pressed as the hand moves, from where the hand takes it up (session::ProbeHand);
/// while the clutch is held, or the device is away, it stays. Without force: its motors get none.
class ProbeDevice {
public:
  /// @param description  "hid", "hid:VID:PID", or NAME or NAME:ID of named_sources()
  /// @param taken        path of the device that leads the needle; empty: none
  /// @param scene, probe  outlive it
  /// @throws files::ContentError, haptic::hid::HidError
  ProbeDevice(const std::string& description, const std::string& taken, const content::Scene& scene,
              session::HeldProbe& probe);

  std::string name() const { return device_->name(); }
  /// From now on, until the thread is destroyed: before `live` and this are.
  [[nodiscard]] std::jthread lead(const session::LiveSession& live);

private:
  session::ProbeHand hand_;
  std::unique_ptr<haptic::hid::HidStylus> device_;
};

}  // namespace stylet::app
