// A device in the other hand: it leads the probe.
#pragma once

#include "engine/content/scene.h"
#include "engine/session/felt_skin.h"
#include "engine/session/held_probe.h"
#include "engine/session/live_session.h"
#include "engine/session/probe_hand.h"
#include "haptic/hid/hid_stylus.h"

#include <memory>
#include <stop_token>
#include <string>
#include <thread>

namespace stylet::app {

/// The probe slides, turns and is pressed as the hand moves, from where the hand takes it up (session::ProbeHand);
/// while the clutch is held, or the device is away, it stays. A device with motors feels the skin along the probe's
/// axis, behind an OutputGuard of its own.
class ProbeDevice {
public:
  /// @param description  "hid", "hid:VID:PID", or NAME or NAME:ID of named_sources()
  /// @param taken        path of the device that leads the needle; empty: none
  /// @param scene, probe  outlive it
  /// @throws files::ContentError, haptic::hid::HidError
  ProbeDevice(const std::string& description, const std::string& taken, const content::Scene& scene,
              session::HeldProbe& probe);

  std::string name() const { return device_->name(); }
  const haptic::Device& device() const { return *device_; }
  /// It has motors, and the scene's probe presses on something.
  bool feels() const { return feels_; }
  /// What whoever holds it should know; empty: nothing.
  std::string warning() const;
  /// To be told of the steps of the session that it leads.
  session::StepListener& skin() { return skin_; }
  /// From now on, until the thread is destroyed: before `live` and this are.
  [[nodiscard]] std::jthread lead(const session::LiveSession& live);

private:
  void lead_without_force(const session::LiveSession& live, const std::stop_token& stop);
  void lead_with_force(const session::LiveSession& live, const std::stop_token& stop);

  std::unique_ptr<haptic::hid::HidStylus> device_;
  session::FeltSkin skin_;
  bool feels_;
  session::ProbeHand hand_;
};

}  // namespace stylet::app
