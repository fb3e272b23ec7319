// Deterministic frames of a scenario for data sets, tests and papers: those of a motion, and random ones.
#pragma once

#include "engine/app/load_scene.h"
#include "engine/app/observer.h"
#include "engine/content/picture_labels.h"
#include "engine/content/scene.h"
#include "engine/session/random_frame.h"

#include <nlohmann/json.hpp>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace stylet::app {

struct PictureSize {
  int width = 0;
  int height = 0;
};

/// What both kinds of frames have in common.
struct RenderSettings {
  std::string scenario{};  ///< a name in content/scenarios, or a file
  std::filesystem::path out{};
  PictureSize ultrasound_size{640, 480};
  double from_s = 0;             ///< of the motion
  std::optional<double> to_s{};  ///< not set: its end
  int previews = 100;            ///< every so manyth label map has one in colour, 0: none
  std::uint32_t seed = 1;        ///< of speckle and noise
  std::string coupling{};        ///< empty: the scenario's
  std::string gpu{};             ///< by a part of its name or its number; empty: the best
  ScannerSettings scanner{};
};

struct MotionFramesSettings {
  RenderSettings common{};
  PictureSize view_size{1280, 720};
  double frames_per_second = 10;
  std::vector<double> camera{};  ///< eye and point looked at, patient frame, m; empty: the scenario's
  bool stereo = false;
  bool room = false;        ///< round the patient in the 3-D view
  bool ultrasound = false;  ///< and no 3-D view
  bool labels = false;
  std::string stylus{};  ///< as of open_stylus()
};
struct MotionFrames {
  std::filesystem::path folder{};
  int frames = 0;
};
/// Frames of a motion: the 3-D view and the ultrasound image, or the image alone, also as a tracked sequence.
/// @throws files::ContentError, gpu::GpuError, Stopped
MotionFrames render_motion(const MotionFramesSettings& settings, Observer& observer);

/// The frames 0, 1, 2 ... of a data set: every `of`th from `index` on.
struct Shard {
  std::uint64_t index = 0;
  std::uint64_t of = 1;
};

struct DatasetSettings {
  RenderSettings common{};
  std::uint64_t frames = 0;  ///< of the whole data set
  Shard shard{};
  std::optional<std::uint64_t> only{};  ///< one frame
  session::RandomRanges ranges{};       ///< of the times only `common` counts
};
struct DatasetFrames {
  std::uint64_t drawn = 0;
  std::uint64_t kept = 0;   ///< were there
  std::uint64_t there = 0;  ///< now
};
/// Random ultrasound frames with labels, those of a shard that are not there yet.
/// @throws files::ContentError, gpu::GpuError, Stopped
DatasetFrames render_dataset(const DatasetSettings& settings, Observer& observer);

/// What set the image up, for manifests.
nlohmann::ordered_json scanner_json(const content::Probe& probe);

/// Names by index, for manifests.
nlohmann::ordered_json legend_json(const content::PictureLabels& labels);

}  // namespace stylet::app
