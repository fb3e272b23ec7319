#include "engine/lab/store/station.h"

#include "engine/files/error.h"
#include "engine/lab/store/postgres.h"

#include <fmt/format.h>

#include <cstdlib>
#include <utility>

namespace stylet::lab::store {

std::string server_of(Lab& own, const std::string& asked) {
  std::string address = asked;
  const char* variable = std::getenv("STYLET_LAB_DATABASE");
  if (address.empty() && variable != nullptr) address = variable;
  if (address.empty()) address = own.setting(kDatabase);
  return address == kOwnFiles ? std::string() : address;
}

Station open_station(LabSettings settings) {
  Station station;
  const std::string asked = std::exchange(settings.database, {});
  station.own = std::make_unique<Lab>(settings);
  settings.database = server_of(*station.own, asked);
  if (settings.database.empty()) return station;
  try {
    station.server = std::make_unique<Lab>(settings);
    station.handed_over = station.hand_over();
  } catch (const files::ContentError& error) {
    station.server.reset();
    station.away = error.what();
  }
  return station;
}

HandedOver Station::hand_over() {
  if (!server) throw files::ContentError(away.empty() ? "this computer is a station of no server" : away);
  return own->hand_over(*server);
}

Person Station::enrolled(const std::string& who) {
  if (auto person = own->find(who)) return *std::move(person);
  if (server) {
    try {
      return own->known(server->enrolled(who));
    } catch (const ServerProblem& error) {
      server.reset();
      away = error.what();
    }
  }
  return away.empty() ? own->enrolled(who) : own->enrolled_without_server(who);
}

Person Station::in_lab(const Person& person) {
  return server ? server->of_station(person.id).value_or(person) : person;
}

std::string handed_over_words(const HandedOver& handed_over, const std::string& place) {
  std::string words;
  if (handed_over.attempts > 0 || handed_over.people > 0) {
    words = fmt::format("{} attempts and {} new people are handed over to {}", handed_over.attempts,
                        handed_over.people, place);
  }
  if (handed_over.erased > 0) {
    words +=
        fmt::format("{}{} people were erased there, and are here now{}", words.empty() ? "" : "; ",
                    handed_over.erased, handed_over.backups.empty() ? "" : "; backups that may still hold them:");
    for (const auto& backup : handed_over.backups) words += " " + backup.string();
  }
  if (handed_over.left > 0) {
    words += fmt::format("{}{} stay here, which it does not take: {}", words.empty() ? "" : "; ", handed_over.left,
                         handed_over.problem);
  }
  return words;
}

}  // namespace stylet::lab::store
