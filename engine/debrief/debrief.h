// What a session leaves for people, drawn from the replay of its recording.
#pragma once

#include "engine/content/scene.h"
#include "engine/debrief/collect.h"
#include "engine/debrief/film.h"
#include "engine/figures/force_trace.h"
#include "engine/files/output_directory.h"
#include "engine/gpu/device.h"
#include "engine/recording/recording.h"
#include "engine/session/replay.h"

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace stylet::debrief {

struct DebriefSettings {
  StillSettings stills{};                   ///< with the look of the film
  bool film = true;                         ///< is made
  std::optional<Expert> expert{};           ///< to compare with
  std::vector<DebriefAttempt> attempts{};   ///< before this one
  std::vector<training::Metric> metrics{};  ///< as the session set them; empty: measured on the replay
};

/// What is being done, and how much of it.
using DebriefProgress = std::function<void(const std::string& doing, double share)>;

/// Writes force.csv and force.png, with the recording's events.
/// @throws files::ContentError
void write_force(const files::OutputDirectory& out, const recording::Recording& recording,
                 const figures::ForceTrace& trace);

/// Writes debrief.html, debrief.json, debrief.csv and path.csv of a session that was replayed.
/// @throws files::ContentError, gpu::GpuError
void write_page(const files::OutputDirectory& out, const content::Scene& scene, gpu::Device& device,
                const recording::Recording& recording, SessionReplay& replay, const DebriefSettings& settings);

/// What a session was, recorded and run again.
struct ReplayedSession {
  const content::Scene& scene;
  const recording::Recording& recording;
  SessionReplay& replay;
  const figures::ForceTrace& force;
};

/// Writes the page and its numbers, view.png, ultrasound.png and session.png (of the still_moment()), session.mp4.
/// @return frames of the film, 0: none was wanted
/// @throws files::ContentError, gpu::GpuError
int write_debrief(const files::OutputDirectory& out, const ReplayedSession& session, gpu::Device& device,
                  const DebriefSettings& settings, const DebriefProgress& progress = {});

}  // namespace stylet::debrief
