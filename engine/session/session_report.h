// What a session came to: session.json, and the same in words.
#pragma once

#include "engine/figures/force_trace.h"
#include "engine/session/force_scale.h"
#include "engine/session/frame_publisher.h"
#include "engine/session/picture_watch.h"
#include "engine/session/puncture_event.h"
#include "engine/session/run_statistics.h"
#include "physics/loops/passivity_observer.h"

#include <nlohmann/json.hpp>

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace stylet::session {

/// An ultrasound image that the trainee saved.
struct SavedImageFacts {
  std::string file{};               ///< in the results' folder
  double time_s = 0;                ///< of the session, of what it shows
  double depth = 0;                 ///< m
  double metres_per_pixel = 0;      ///< of the body
  std::vector<double> distances{};  ///< measured on it, m
};

struct SessionReport {
  std::string scenario{};
  std::string build{};
  std::string coupling{};
  std::string device{};                       ///< the stylus
  std::optional<std::uint32_t> start_seed{};  ///< of the start that was drawn; none: as the scenario has it
  std::string gpu{};                          ///< empty: nothing was drawn
  std::string gpu_driver{};
  std::string blas{};
  RunStatistics run{};
  figures::ForceSummary force{};
  physics::PassivitySummary passivity{};
  std::optional<ForceOutput> force_output{};  ///< not set: the stylus renders none
  std::vector<PunctureEvent> punctures{};
  double needle_bent_deg = 0;                ///< most that the needle was bent for good, as its events tell
  double closest_target_distance = 0;        ///< m; infinite without a target
  std::optional<ProbeSummary> probe{};       ///< not set: it was held in the air
  std::optional<PictureSummary> pictures{};  ///< not set: nothing was shown
  std::vector<SavedImageFacts> saved_images{};
  std::uint64_t state_hash = 0;
  std::optional<bool> replay_identical{};  ///< not set: the recording was not replayed
  std::uint64_t replay_hashes = 0;         ///< compared
};

/// The object of session.json; content/README.md specifies it.
nlohmann::ordered_json to_json(const SessionReport& report);
/// @throws files::ContentError  when the file cannot be written
void write_json(const std::filesystem::path& path, const nlohmann::ordered_json& json);
/// Some lines for the terminal.
std::string main_figures(const SessionReport& report);
/// "52 % of the needle's force"
std::string force_scale_text(double scale);
/// 16 hexadecimal digits.
std::string hash_text(std::uint64_t hash);

}  // namespace stylet::session
