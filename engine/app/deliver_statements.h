// What the lab's record store has not heard of yet is told to it.
#pragma once

#include "engine/lab/delivery/outbox.h"
#include "engine/lab/store/lab.h"

#include <cstdint>
#include <optional>
#include <string>

namespace stylet::app {

struct Delivery {
  lab::delivery::Sent sent{};
  lab::delivery::OutboxState left{};
};

/// What becomes of statements that wait for another store.
enum class Waiting : std::uint8_t { refuse, send, drop };

struct StoreAddress {
  std::string endpoint{};   ///< empty: nothing is told any more, and what waits stays
  std::string home_page{};  ///< of the lab's own, by which its people and activities are named; ends in "/"
  std::string key_file{};   ///< "name:secret"; empty: none
  std::string version{};    ///< of xAPI: 1.0.3, 2.0.0; empty: the newest that the store says it speaks
  Waiting waiting = Waiting::refuse;
};

struct Connected {
  std::string version{};
  std::string not_asked{};  ///< why the store did not say which; empty: it did, or it was given
  int tried_again = 0;      ///< statements that a store had refused
};

/// Where the lab's record store is, and who the lab is: checked, and kept with the records. What was refused earlier
/// waits again.
/// @throws files::ContentError  also where statements wait for another store and nobody says what is to become of
/// them
Connected connect_record_store(lab::store::Lab& lab, const StoreAddress& address);

/// Once through the outbox; waits for the store, ten seconds a request at most. Nothing: there is no record store.
/// @param failures  of the store in a row so far, as the last Delivery says: the wait doubles with each
/// @throws files::ContentError
std::optional<Delivery> deliver_statements(lab::store::Lab& lab, int failures = 0);

/// "3 statements delivered; 2 wait, the oldest since 2026-03-02: ..." one line.
std::string delivery_words(const Delivery& delivery);

}  // namespace stylet::app
