// Who trains: chosen by name and PIN before a session, where the lab has names.
#pragma once

#include "engine/lab/store/station.h"
#include "engine/panels/trainee_choice.h"

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace stylet::app {

inline constexpr std::size_t kShortestPin = 4;
inline constexpr std::size_t kLongestPin = 12;
/// Digits alone.
bool is_pin(std::string_view text);

/// A lab's names behind a TraineeChoice: of its server, where this computer is a station of one that is there. One
/// thread.
class TraineeDoor {
public:
  /// @param folder  of the records; empty: lab::store::default_lab_folder()
  /// @return null: there are no records, or nobody is in them; nothing is made
  /// @throws files::ContentError
  static std::unique_ptr<TraineeDoor> at(std::filesystem::path folder);

  /// Of everybody by name, those without one by pseudonym. Keeps a reference to this.
  panels::TraineeChoice choice();
  /// Each wrong one makes the next try wait longer.
  panels::PinAnswer try_pin(const std::string& pseudonym, const std::string& pin);

private:
  explicit TraineeDoor(lab::store::Station station) : station_(std::move(station)) {}

  lab::store::Station station_;
  std::vector<panels::TraineeEntry> entries_{};
};

}  // namespace stylet::app
