// This computer's own records, and the lab's server where it is a station of one.
#pragma once

#include "engine/lab/store/lab.h"

#include <memory>
#include <string>

namespace stylet::lab::store {

/// What a station says instead of an address: its own files.
inline constexpr const char* kOwnFiles = "own";

struct Station {
  std::unique_ptr<Lab> own{};
  std::unique_ptr<Lab> server{};  ///< null: there is none, or it is away
  std::string away{};             ///< why, or what it refused, one line; empty: it is there, or there is none
  HandedOver handed_over{};       ///< at opening

  /// Where all attempts are, as far as can be known now.
  Lab& lab() { return server ? *server : *own; }
  /// A person of the own files; enrolled at the server too, where that is there. @throws files::ContentError  no name
  Person enrolled(const std::string& who);
  /// The same person in lab(). @param person  of the own files
  Person in_lab(const Person& person);
  /// Gives to the server what the own files have. @throws files::ContentError  it is away, or there is none
  HandedOver hand_over();
};

/// Address of the server: what was asked for, else STYLET_LAB_DATABASE, else kDatabase of the own files. Empty: none.
std::string server_of(Lab& own, const std::string& asked);

/// Opens both, and hands over what the own files have. A server that is away, or refuses, is no error: the station
/// goes on without. @param settings  `database` is what was asked for
/// @throws files::ContentError  of the own files
Station open_station(LabSettings settings);

/// "3 attempts are handed over to ..."; empty: nothing was.
std::string handed_over_words(const HandedOver& handed_over, const std::string& place);

}  // namespace stylet::lab::store
