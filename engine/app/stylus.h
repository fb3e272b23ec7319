// The styluses that can lead the needle, by the names that users give them.
#pragma once

#include "engine/content/scene.h"
#include "engine/readers/motion.h"
#include "engine/session/start_pose.h"
#include "haptic/device.h"

#include <cstdint>
#include <limits>
#include <memory>
#include <span>
#include <string>

namespace stylet {
namespace haptic {
class HandDevice;
class MouseDevice;
namespace hid {
class ReportLog;
}  // namespace hid
}  // namespace haptic
namespace link {
class LinkStylus;
}  // namespace link
}  // namespace stylet

namespace stylet::app {

/// What the session must have for a stylus to be moved.
enum class StylusNeed : std::uint8_t { nothing, window, headset, link };

struct Stylus;

/// What a stylus is opened with.
struct StylusOpening {
  const content::Scene& scene;
  std::string argument{};
  haptic::hid::ReportLog* log = nullptr;
  const session::StartPose* start = nullptr;  ///< of who holds it; null: as the scene has it
};

/// A row of the table of styluses.
struct StylusKind {
  const char* name;                ///< as in --device NAME
  const char* argument;            ///< of NAME:ARGUMENT; empty: NAME alone
  const char* help;                ///< what it is, in words
  bool held = false;               ///< by somebody who begins and ends the session; else it plays by itself
  bool in_real_time_only = false;  ///< it moves whether or not time waits for the pictures
  StylusNeed need = StylusNeed::nothing;
  Stylus (*open)(const StylusOpening& opening);
  /// Whether it is there, as far as that can be told without a scene; null: it always is. Throws as open_stylus().
  void (*find)(const std::string& argument) = nullptr;
};
/// In the order in which they are listed.
std::span<const StylusKind> stylus_kinds();
/// All of them in words: "hid (...), mouse (...) or scripted (...)".
std::string stylus_help();

/// Where others than the haptic thread move a stylus: at most one is there, a part of the stylus.
struct StylusInput {
  haptic::MouseDevice* mouse = nullptr;  ///< by a window
  haptic::HandDevice* hand = nullptr;    ///< by a headset
  link::LinkStylus* tracked = nullptr;   ///< by an OpenIGTLink connection
};

/// A stylus that is open.
struct Stylus {
  std::unique_ptr<haptic::Device> device{};
  /// Of its motion; infinite: as long as the user wants.
  double duration_s = std::numeric_limits<double>::infinity();
  bool own_motion = false;  ///< it plays the scenario's motion
  StylusInput input{};
  int breath_button = 0;      ///< that asks for the breath to be held, counted from 1; 0: none is free
  readers::RawReports hid{};  ///< of a HID device: which, and what its reports mean; its reports are in the log
  std::string path{};         ///< of a device that sends reports; empty: it is none
  std::string warning{};      ///< for who holds it, one line; empty: none
  const StylusKind* kind = nullptr;  ///< set by open_stylus()

  bool held() const { return kind->held; }
};

/// "button 3": the one that asks for the breath; empty: there is none.
std::string button_words(const Stylus& stylus);

/// Refuses at once what open_stylus() would refuse after the scene is loaded: a name that there is none of, a file
/// that cannot be read, a device that is not plugged in. @param description  as of open_stylus()
/// @throws files::ContentError
const StylusKind& find_stylus(const std::string& description);

/// @param description  NAME or NAME:ARGUMENT of the table; empty: recorded
/// @param log  takes the raw reports of a HID device; outlives the stylus; null: nobody wants them
/// @param start  where who holds it finds the needle; null: as the scene has it
/// @throws files::ContentError  there is no such stylus, or it cannot lead the needle of this scene
/// @throws haptic::hid::HidError
Stylus open_stylus(const std::string& description, const content::Scene& scene, haptic::hid::ReportLog* log = nullptr,
                   const session::StartPose* start = nullptr);

}  // namespace stylet::app
