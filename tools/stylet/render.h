// What the two kinds of `stylet render` have in common: frames of a motion, and random frames for data sets.
#pragma once

#include "engine/content/picture_labels.h"
#include "engine/content/scene.h"
#include "engine/session/random_frame.h"
#include "tools/stylet/session_options.h"

#include <nlohmann/json.hpp>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace stylet::tools {

struct Size {
  int width;
  int height;
};

struct RenderOptions {
  std::string scenario;
  std::string out;
  std::string size = "1280x720";
  std::string ultrasound_size = "640x480";
  double frames_per_second = 10;
  double from_s = 0;
  std::optional<double> to_s;
  std::vector<double> camera;
  bool stereo = false;
  bool room = false;        ///< round the patient in the 3-D view
  bool ultrasound = false;  ///< and no 3-D view
  bool labels = false;
  int previews = 100;  ///< every so manyth frame has one, 0: none
  std::uint32_t seed = 1;
  std::string device;
  std::string coupling;
  std::string gpu;
  ScannerOptions scanner{};
  std::uint64_t random = 0;             ///< frames of a data set; 0: those of the motion
  std::string shard;                    ///< "I/N"; empty: all of them
  std::optional<std::uint64_t> only{};  ///< one frame of the data set
  session::RandomRanges ranges{};
};

/// Of "WIDTHxHEIGHT". @throws files::ContentError  in the name of the option
Size parse_size(const std::string& option, const std::string& text);

/// Frames of the scenario's motion. @return exit code
int render_motion(const RenderOptions& options);
/// Random frames, those of a shard that are not there yet. @return exit code
int render_dataset(const RenderOptions& options);

/// What set the image up, for manifests.
nlohmann::ordered_json scanner_json(const content::Probe& probe);

/// Names by index, for manifests.
nlohmann::ordered_json legend_json(const content::PictureLabels& labels);

}  // namespace stylet::tools
